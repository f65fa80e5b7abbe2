// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Ticks of `tick_ns` between pictures that are spread over `seconds`; without them, or if there
/// is to be no picture, a second. At least 1.
[[nodiscard]] constexpr std::uint64_t ticks_between(std::uint32_t frames,
                                                    std::optional<double> seconds,
                                                    std::uint32_t tick_ns) noexcept {
  constexpr double kNsPerS = 1e9;
  const double apart_s = seconds && frames > 0 ? *seconds / frames : 1.0;
  return std::max(std::uint64_t{1}, static_cast<std::uint64_t>(apart_s * kNsPerS / tick_ns));
}

/// Which headless pictures are to be taken: picture i = 1, 2, ... once `i * every` ticks have
/// passed since arming. A late one is taken at the next chance, so none is left out.
class FrameSchedule {
 public:
  FrameSchedule(std::uint32_t frames, std::uint64_t every_ticks) noexcept
      : frames_(frames), every_ticks_(every_ticks) {}

  [[nodiscard]] bool complete() const noexcept { return taken_ == frames_; }
  [[nodiscard]] bool due(std::optional<std::uint64_t> ticks) const noexcept {
    return !complete() && ticks && *ticks / every_ticks_ > taken_;
  }
  /// Ticks since arming at which the next picture is due.
  [[nodiscard]] std::uint64_t next_ticks() const noexcept { return (taken_ + 1) * every_ticks_; }
  /// The end of the run has a picture too, unless the last one shows that tick already.
  [[nodiscard]] bool final_due(std::optional<std::uint64_t> ticks) const noexcept {
    return !complete() && (due(ticks) || taken_ == 0 || ticks.value_or(kUnarmed) != last_ticks_);
  }
  /// Returns the number of the picture, from 1.
  std::uint32_t take(std::optional<std::uint64_t> ticks) noexcept {
    last_ticks_ = ticks.value_or(kUnarmed);
    return ++taken_;
  }
  [[nodiscard]] std::uint32_t taken() const noexcept { return taken_; }

 private:
  static constexpr std::uint64_t kUnarmed = ~std::uint64_t{0};

  std::uint32_t frames_;
  std::uint64_t every_ticks_;
  std::uint32_t taken_ = 0;
  std::uint64_t last_ticks_ = kUnarmed;
};

/// Writes a PNG with one moment of a session, volumes and tool, as every renderer draws it, each
/// with its name; `seen_from`, or as the whole of it fills a tile. Needs a current GL context.
/// Throws FileError, and VisualizerError if a renderer cannot show the volumes.
void write_contact_sheet(const std::filesystem::path& file, const SceneView& scene,
                         std::span<const VolumeContent> contents, const Hands& hands,
                         const std::optional<CameraPose>& seen_from = {});

}  // namespace kerf
