// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/command_line.hpp"

// The program kerf-volume, and the options and outputs that its commands share.

namespace kerf {

/// The program kerf-volume: info, import, crop, resample, phantom. Returns its exit code: 0, or 2
/// after one line on `err` for bad input. Never throws.
int run_volume_tool(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

/// The texts of options as values. Each throws LoadError, one line that names the option.
[[nodiscard]] Window window_from(const std::string& text);  ///< "-200,1500"
/// "0.2" or "1,1,2"
[[nodiscard]] std::array<double, 3> spacing_from(const std::string& option,
                                                 const std::string& text);
/// "256x256x161"
[[nodiscard]] VoxelGrid grid_from(const std::string& option, const std::string& text);

/// The options for size and axes of the voxels, as they are written.
struct FrameOptions {
  std::string spacing, override_spacing, axes;

  /// `with_spacing`: false where --spacing means something else.
  void add_to(Arguments& command, bool with_spacing = true);
  /// Throws as the functions above.
  void set(ReadOptions& options) const;
  [[nodiscard]] bool gives_spacing() const { return !spacing.empty() || !override_spacing.empty(); }
};

/// The inputs of a command, which its outputs must not replace: the volume's file or folder, and
/// its labels.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& volume);

/// Refuses an existing file, unless `force`.
void refuse_replacing(const std::filesystem::path& path, bool force);

/// Gives the files their names; refuses one that exists by now, unless `force`.
void commit(AtomicFiles& files, bool force);

}  // namespace kerf
