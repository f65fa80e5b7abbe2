// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <sys/types.h>

#include "visualizer/gl/target.hpp"
#include "visualizer/scene/pixel_rect.hpp"

namespace kerf {

/// `rgb` as in RenderTarget::read_rgb, 8-bit sRGB PNG, as one new file. Throws FileError.
void write_png(const std::filesystem::path& path, PictureSize size,
               std::span<const std::uint8_t> rgb);

/// An array of NumPy (format 1.0, little-endian float32, C order), as one new file: (height,
/// width), or (height, width, channels) if there is more than one. The first row is at the top.
/// Throws FileError.
void write_npy(const std::filesystem::path& path, PictureSize size, int channels,
               std::span<const float> values);

/// Makes the folder, and its parents, if it is missing. Throws VisualizerError.
void make_folder(const std::filesystem::path& folder);

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

/// Whether a video of that name is compressed, by its ending: .mp4 or .mkv.
[[nodiscard]] bool is_compressed(const std::string& path);

/// Whether the program that compresses, ffmpeg, is in PATH.
[[nodiscard]] bool have_ffmpeg();

/// Throws FileError for a name of a compressed video, if there is no ffmpeg.
void check_video(const std::string& path);

/// How fast a raw video in a file grows, and the way out; empty for a pipe and a compressed one.
[[nodiscard]] std::string video_growth(const std::string& path, PictureSize size, int frames_per_s);

/// Video that grows frame by frame: YUV4MPEG2 (4:2:0, BT.709, limited range), which players and
/// ffmpeg read. A file is good up to its last whole frame whenever writing ends; "-" is the
/// standard output, and a path that is a pipe is written to. One that `is_compressed` is made by
/// ffmpeg, which is good up to the last second if ffmpeg is killed.
///
/// Every failure is a FileError of one line. A reader that takes nothing for `kPatienceMs` counts
/// as gone: a picture must not wait for ever for who films it.
class VideoFile {
 public:
  static constexpr int kPatienceMs = 2000;

  /// Replaces a file that is there; a link is refused. The process ignores SIGPIPE from now on.
  /// With "-" its standard output is the video's, and what else is written there goes to standard
  /// error.
  VideoFile(std::string path, PictureSize size, int frames_per_s);

  /// `yuv` as from `fill_yuv420`.
  void write_frame(std::span<const std::uint8_t> yuv);

  [[nodiscard]] PictureSize size() const noexcept { return size_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }

 private:
  struct Descriptor {
    int fd = -1;
    pid_t ffmpeg = 0;  ///< 0: none
    ~Descriptor();     ///< waits until ffmpeg has written all
  };
  [[nodiscard]] static Descriptor opened(const std::string& path);

  void write(std::span<const std::uint8_t> bytes);
  [[noreturn]] void fail(const std::string& reason) const;

  std::string path_;
  PictureSize size_;
  Descriptor to_;
  std::uint64_t frames_ = 0;
  std::int64_t written_bytes_ = 0;
  std::int64_t whole_bytes_ = 0;  ///< up to the end of the last whole frame
};

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
  /// FileError, also if the size is another one.
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

/// Adds `target` to the film, if there is one. A film that fails ends, and the reason is
/// returned; the picture goes on.
[[nodiscard]] std::optional<std::string> add_frame(std::optional<Film>& film,
                                                   const RenderTarget& target, double servo_s);

}  // namespace kerf
