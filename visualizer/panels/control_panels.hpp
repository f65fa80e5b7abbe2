// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/pixel_rect.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// What a user may open in a folder: folders, scenes and volumes, by their names.
struct FolderList {
  struct Entry {
    std::string name;
    bool is_folder = false;
    friend bool operator==(const Entry&, const Entry&) noexcept = default;
  };
  static constexpr std::size_t kMost = 2000;  ///< more are left out, and `note` reports it

  std::filesystem::path folder;
  std::vector<Entry> entries;  ///< the folder above, folders, files
  std::string note;            ///< one line: what is wrong, or left out; empty: nothing
  friend bool operator==(const FolderList&, const FolderList&) noexcept = default;
};

/// Throws nothing: a folder that cannot be read has only the one above, and a note.
[[nodiscard]] FolderList list_folder(const std::filesystem::path& folder);

/// Why `file` is neither a scene nor a volume, as one line; empty if it seems to be one.
[[nodiscard]] std::string why_not_open(const std::filesystem::path& file);

/// A tool in the list: its size and name, and its picture.
struct ToolChoice {
  std::string text;
  Silhouette side{};
  friend bool operator==(const ToolChoice&, const ToolChoice&) noexcept = default;
};

/// Input and output of the controls: the settings that they show and change.
struct ViewControls {
  ViewSettings settings;
  double own_iso = 0.5;                ///< of the main volume, 0..1: if the settings have none
  std::vector<ToolChoice> tools{};     ///< one alone is no choice
  std::size_t tool = 0;                ///< in the hand, or asked for
  std::vector<std::string> volumes{};  ///< their names
  bool has_iso = false;                ///< a volume shows its iso-surface
  Opacities opacities{};               ///< of all materials, as they are; empty: not shown
  bool write = false;                  ///< the user asks for a file with them
  std::optional<Pointer> over{};       ///< the mouse, while it is over them
  friend bool operator==(const ViewControls&, const ViewControls&) noexcept = default;
};

/// The controls that the mouse moves: the tool in the hand, renderers, gradient,
/// iso value, opacities, clip plane, stereo, voxel tool. Lower left corner.
class SettingsPanel {
 public:
  /// Between ImGui::NewFrame and ImGui::Render. Takes the mouse's changes over into `controls`.
  /// Returns the x at which the panel ends, in pixels, in a picture of `size`. Where the controls
  /// need more than `most_high` pixels or `most_area` square pixels, the panel scrolls.
  float draw(ViewControls& controls, PictureSize size, float most_high, float most_area);
  /// Of a panel that is of use.
  [[nodiscard]] static float least_high();

 private:
  void choose_iso(ViewControls& controls);

  float wide_ = 0.0F;                 ///< when it was drawn last
  std::optional<float> dragged_iso_;  ///< taken over when the drag ends: all is drawn anew then
};

/// `value` to the nearest multiple of `step`.
[[nodiscard]] double rounded_to(double step, double value);

}  // namespace kerf
