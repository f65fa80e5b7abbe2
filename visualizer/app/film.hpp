// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "visualizer/app/video_file.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf {

/// A video of what is drawn, with a fixed frame rate in the servo's time, so that it plays in true
/// time: a late picture fills the frames that it missed, and one that comes too early is left out.
class Film {
 public:
  /// Throws FileError.
  Film(const std::string& path, PictureSize size, int frames_per_s);

  /// Seconds of the servo's clock until `add` writes the next frame; not positive: at once.
  [[nodiscard]] double due_in_s(double servo_s) const noexcept;
  [[nodiscard]] bool due(double servo_s) const noexcept { return due_in_s(servo_s) <= 0.0; }
  /// `target` shows the state of `servo_s`, which begins anew with another controller. Throws
  /// FileError, also where the size is another one.
  void add(const RenderTarget& target, double servo_s);

  [[nodiscard]] const VideoFile& file() const noexcept { return file_; }

 private:
  [[nodiscard]] double filmed_s(double servo_s) const noexcept;

  VideoFile file_;
  double frames_per_s_;
  double filmed_s_ = 0.0;  ///< up to `servo_s_`
  double servo_s_ = -1.0;  ///< of the last picture; negative: none yet
  std::vector<std::uint8_t> yuv_;
};

/// Adds `target` to the film, where there is one. A film that fails ends, and the reason is
/// returned; the picture goes on.
[[nodiscard]] std::optional<std::string> add_frame(std::optional<Film>& film,
                                                   const RenderTarget& target, double servo_s);

}  // namespace kerf
