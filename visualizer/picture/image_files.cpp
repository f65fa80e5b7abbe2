// SPDX-License-Identifier: Apache-2.0

#include "visualizer/picture/image_files.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <climits>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <png.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/posix/atomic_file.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

void write_png(const std::filesystem::path& path, PictureSize size,
               std::span<const std::uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(size.width);
  image.height = static_cast<png_uint_32>(size.height);
  image.format = PNG_FORMAT_RGB;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t length = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &length, 0, rgb.data(), 0, nullptr) == 0) {
    throw VisualizerError(path.string() + ": " + image.message);
  }
  bytes.resize(length);
  write_new_file(path, bytes);
}

void write_npy(const std::filesystem::path& path, PictureSize size, int channels,
               std::span<const float> values) {
  static_assert(std::endian::native == std::endian::little);
  std::string head = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                     std::to_string(size.height) + ", " + std::to_string(size.width) +
                     (channels > 1 ? ", " + std::to_string(channels) : "") + "), }";
  constexpr std::size_t kBefore = 10, kAligned = 64;  // magic, version, length of what follows
  const std::size_t whole = (kBefore + head.size() + 1 + kAligned - 1) / kAligned * kAligned;
  head.resize(whole - kBefore - 1, ' ');
  head += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += {static_cast<char>(head.size() & 0xff), static_cast<char>(head.size() >> 8)};
  bytes += head;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  write_new_file(path, bytes);
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw VisualizerError(folder.string() + ": " + error.message() +
                          "; name a place that can be written");
  }
}

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

int opened_raw(const std::string& path) {
  if (path == "-") {
    const int fd = dup(STDOUT_FILENO);
    dup2(STDERR_FILENO, STDOUT_FILENO);  // messages for the user would end up in the video
    return fd;
  }
  constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC;
  return is_stream(path) ? open_stream(path) : open(path.c_str(), kNew, 0666);
}

/// Starts ffmpeg, which reads YUV4MPEG2 from `from` and writes `path`; returns its id, or -errno.
/// It has a session of its own, so that a Ctrl-C of the terminal leaves it to end the file.
pid_t start_ffmpeg(int from, const std::string& path) {
  const std::string to = "file:" + std::filesystem::absolute(path).string();
  std::vector<std::string> words = {"ffmpeg", "-nostdin", "-loglevel", "quiet", "-y", "-i", "-"};
  // An odd side is padded, as 4:2:0 of H.264 has none. Fragments: whole without a proper end.
  for (const char* word : {"-vf",
                           "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                           "-c:v",
                           "libx264",
                           "-preset",
                           "ultrafast",
                           "-crf",
                           "20",
                           "-g",
                           "60",
                           "-pix_fmt",
                           "yuv420p",
                           "-colorspace",
                           "bt709",
                           "-color_primaries",
                           "bt709",
                           "-color_trc",
                           "bt709",
                           "-movflags",
                           "+frag_keyframe+empty_moov"}) {
    words.emplace_back(word);
  }
  words.push_back(to);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_adddup2(&actions, from, STDIN_FILENO);
  for (const int number : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, number, "/dev/null", O_WRONLY, 0);
  }
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, "ffmpeg", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0 ? child : -error;
}

// Of BT.709, times the range of the result over 255, in 1/65536.
constexpr int kBits = 16;
constexpr double kOne = 1 << kBits;
constexpr double kR = 0.2126, kG = 0.7152, kB = 0.0722;
constexpr double kLuma = 219.0 / 255.0 * kOne;
constexpr double kCb = 224.0 / 255.0 / 1.8556 * kOne;
constexpr double kCr = 224.0 / 255.0 / 1.5748 * kOne;

struct Weights {
  std::int32_t r, g, b;
};
constexpr std::int32_t nearest(double x) {
  return static_cast<std::int32_t>(x < 0.0 ? x - 0.5 : x + 0.5);
}
constexpr Weights kToY{nearest(kR * kLuma), nearest(kG* kLuma), nearest(kB* kLuma)};
constexpr Weights kToCb{nearest(-kR * kCb), nearest(-kG* kCb), nearest((1.0 - kB) * kCb)};
constexpr Weights kToCr{nearest((1.0 - kR) * kCr), nearest(-kG* kCr), nearest(-kB* kCr)};

/// Of the mean of 2^`halvings` pixels, whose sums are given.
std::uint8_t value(const Weights& weight, std::int32_t r, std::int32_t g, std::int32_t b,
                   std::int32_t zero, int halvings) {
  const std::int32_t sum = weight.r * r + weight.g * g + weight.b * b;
  const int shift = kBits + halvings;
  return static_cast<std::uint8_t>(zero + ((sum + (1 << (shift - 1))) >> shift));
}

}  // namespace

bool is_compressed(const std::string& path) {
  return path.ends_with(".mp4") || path.ends_with(".mkv");
}

bool have_ffmpeg() {
  const char* folders = std::getenv("PATH");
  std::istringstream list(folders == nullptr ? "" : folders);
  for (std::string folder; std::getline(list, folder, ':');) {
    if (!folder.empty() && access((folder + "/ffmpeg").c_str(), X_OK) == 0) return true;
  }
  return false;
}

void check_video(const std::string& path) {
  if (!is_compressed(path) || have_ffmpeg()) return;
  throw FileError("video " + path +
                  ": no ffmpeg to compress it; apt-get install ffmpeg, or name a .y4m");
}

std::string video_growth(const std::string& path, PictureSize size, int frames_per_s) {
  if (path == "-" || is_compressed(path) || is_stream(path)) return {};
  const double bytes = 1.5 * size.width * size.height * frames_per_s;
  return "raw, " + std::to_string(std::lround(bytes / 1e6)) + " MB a second; " +
         (have_ffmpeg() ? "a name that ends in .mp4 compresses it"
                        : "ffmpeg would compress it, apt-get install ffmpeg");
}

VideoFile::Descriptor VideoFile::opened(const std::string& path) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is an error of `write`
  if (!is_compressed(path) || is_stream(path)) return {opened_raw(path)};
  check_video(path);
  check_new_file(path);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {};
  constexpr int kSomeFrames = 1 << 20;
  static_cast<void>(fcntl(ends[1], F_SETPIPE_SZ, kSomeFrames));
  const pid_t child = start_ffmpeg(ends[0], path);
  close(ends[0]);
  if (child > 0) return {ends[1], child};
  close(ends[1]);
  errno = -child;
  return {};
}

VideoFile::VideoFile(std::string path, PictureSize size, int frames_per_s)
    : path_(std::move(path)), size_(size), to_(opened(path_)) {
  if (to_.fd < 0) fail(not_written(errno));
  // The colour differences stand in the middle of their squares, which y4m calls "jpeg"; the range
  // is limited all the same.
  write(bytes_of("YUV4MPEG2 W" + std::to_string(size.width) + " H" + std::to_string(size.height) +
                 " F" + std::to_string(frames_per_s) +
                 ":1 Ip A1:1 C420jpeg XCOLORRANGE=LIMITED\n"));
  whole_bytes_ = written_bytes_;
}

VideoFile::Descriptor::~Descriptor() {
  if (fd >= 0) close(fd);
  if (ffmpeg == 0) return;
  while (waitpid(ffmpeg, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void VideoFile::fail(const std::string& reason) const {
  if (whole_bytes_ > 0) {
    static_cast<void>(ftruncate(to_.fd, whole_bytes_));  // of a pipe: refused, and nothing is lost
  }
  throw FileError("video " + path_ + ": " + reason + " (" + std::to_string(frames_) +
                  " frames are written)");
}

void VideoFile::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    pollfd ready{to_.fd, POLLOUT, 0};
    const int count = poll(&ready, 1, kPatienceMs);
    if (count < 0 && errno == EINTR) continue;
    const bool compressed = to_.ffmpeg != 0;
    if (count == 0) fail("its reader takes nothing any more; record to a file");
    // What a pipe that is ready takes without waiting.
    const ssize_t written =
        ::write(to_.fd, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (written < 0) {
      fail(errno == EPIPE && compressed ? "ffmpeg has ended; make room, or name a .y4m"
           : errno == EPIPE             ? "its reader has gone; record to a file"
                            : std::string(std::strerror(errno)) + "; name a place with room");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    written_bytes_ += written;
  }
}

void VideoFile::write_frame(std::span<const std::uint8_t> yuv) {
  write(bytes_of("FRAME\n"));
  write(yuv);
  ++frames_;
  whole_bytes_ = written_bytes_;
}

void fill_yuv420(PictureSize size, std::span<const std::uint8_t> rgb,
                 std::vector<std::uint8_t>& yuv) {
  const auto width = static_cast<std::size_t>(size.width);
  const auto height = static_cast<std::size_t>(size.height);
  const std::size_t half_width = (width + 1) / 2;
  const std::size_t half_height = (height + 1) / 2;
  yuv.resize(width * height + 2 * half_width * half_height);
  for (std::size_t i = 0; i < width * height; ++i) {
    yuv[i] = value(kToY, rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 16, 0);
  }
  std::uint8_t* cb = yuv.data() + width * height;
  std::uint8_t* cr = cb + half_width * half_height;
  for (std::size_t y = 0; y < height; y += 2) {
    const std::uint8_t* const upper = rgb.data() + 3 * width * y;
    const std::uint8_t* const lower = y + 1 < height ? upper + 3 * width : upper;
    for (std::size_t x = 0; x < width; x += 2) {
      const std::size_t left = 3 * x;
      const std::size_t right = 3 * std::min(x + 1, width - 1);
      const auto sum = [&](std::size_t colour) {
        return upper[left + colour] + upper[right + colour] + lower[left + colour] +
               lower[right + colour];
      };
      const std::int32_t r = sum(0), g = sum(1), b = sum(2);
      *cb++ = value(kToCb, r, g, b, 128, 2);
      *cr++ = value(kToCr, r, g, b, 128, 2);
    }
  }
}

Film::Film(const std::string& path, PictureSize size, int frames_per_s)
    : file_(path, size, frames_per_s), frames_per_s_(frames_per_s) {}

double Film::filmed_s(double servo_s) const noexcept {
  return servo_s_ < 0.0 ? 0.0 : filmed_s_ + std::max(servo_s - servo_s_, 0.0);
}

double Film::due_in_s(double servo_s) const noexcept {
  return static_cast<double>(file_.frames()) / frames_per_s_ - filmed_s(servo_s);
}

void Film::add(const RenderTarget& target, double servo_s) {
  if (target.size() != file_.size()) {
    throw FileError("video " + file_.path() + ": ends with " + std::to_string(file_.frames()) +
                    " frames, because the picture has another size; begin another one");
  }
  filmed_s_ = filmed_s(servo_s);
  servo_s_ = servo_s;
  if (!due(servo_s)) return;
  fill_yuv420(target.size(), target.read_rgb(), yuv_);
  while (due(servo_s)) file_.write_frame(yuv_);
}

std::optional<std::string> add_frame(std::optional<Film>& film, const RenderTarget& target,
                                     double servo_s) {
  if (!film) return std::nullopt;
  try {
    film->add(target, servo_s);
    return std::nullopt;
  } catch (const FileError& problem) {
    film.reset();
    return problem.what();
  }
}

}  // namespace kerf
