// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "visualizer/app/video_file.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf {

/// Films what is drawn, at a fixed rate of the servo's clock, so that the video plays in true time:
/// a late picture fills the frames that it missed, and one that comes too early is left out.
class Recording {
 public:
  /// Throws FileError.
  Recording(const std::string& path, PictureSize size, int frames_per_s);

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

/// Films `target`, where there is a recording. One that fails ends, and the reason is returned; the
/// picture goes on.
[[nodiscard]] std::optional<std::string> film(std::optional<Recording>& recording,
                                              const RenderTarget& target, double servo_s);

}  // namespace kerf
