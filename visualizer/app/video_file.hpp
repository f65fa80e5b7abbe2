// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "visualizer/view/pixel_rect.hpp"

namespace kerf {

/// A picture as video has it: brightness for each pixel, then two planes of colour differences with
/// one value for each square of two by two pixels (fewer at an odd side), their mean.
///
/// ITU-R BT.709, limited range, 8 bits, each value rounded once: with R, G, B in 0..1,
///
///     Y' = 0.2126 R + 0.7152 G + 0.0722 B                      16 + 219 Y'
///     Cb = (B - Y') / 1.8556,  Cr = (R - Y') / 1.5748          128 + 224 C
///
/// `rgb` as from RenderTarget::read_rgb; `yuv` becomes Y, Cb, Cr.
void fill_yuv420(PictureSize size, std::span<const std::uint8_t> rgb,
                 std::vector<std::uint8_t>& yuv);

/// Raw video that grows frame by frame: YUV4MPEG2 (4:2:0, BT.709, limited range), which players and
/// ffmpeg read. A file is good up to its last whole frame whenever writing ends; "-" is the
/// standard output, and a path that is a pipe is written to.
///
/// Every failure is a FileError of one line. A reader that takes nothing for `kPatienceMs` counts
/// as gone: a picture must not wait for ever for who films it.
class VideoFile {
 public:
  static constexpr int kPatienceMs = 2000;

  /// Replaces a file that is there; a link is refused. The process ignores SIGPIPE from now on.
  /// With
  /// "-" its standard output is the video's, and what else is written there goes to standard error.
  VideoFile(std::string path, PictureSize size, int frames_per_s);

  /// `yuv` as from `fill_yuv420`.
  void write_frame(std::span<const std::uint8_t> yuv);

  [[nodiscard]] PictureSize size() const noexcept { return size_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }

 private:
  struct Descriptor {
    int fd;
    ~Descriptor();
  };

  void write(std::span<const std::uint8_t> bytes);
  [[noreturn]] void fail(const std::string& reason) const;

  std::string path_;
  PictureSize size_;
  Descriptor to_;
  std::uint64_t frames_ = 0;
  std::int64_t written_bytes_ = 0;
  std::int64_t whole_bytes_ = 0;  ///< up to the end of the last whole frame
};

}  // namespace kerf
