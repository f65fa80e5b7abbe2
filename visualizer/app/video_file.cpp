// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/video_file.hpp"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "shared/posix/new_file.hpp"

namespace kerf {

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

int opened(const std::string& path) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is an error of `write`
  if (path == "-") {
    const int fd = dup(STDOUT_FILENO);
    dup2(STDERR_FILENO, STDOUT_FILENO);  // where words for the user would end up in the video
    return fd;
  }
  // Does not wait for the reader of a pipe.
  return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0666);
}

}  // namespace

VideoFile::VideoFile(std::string path, PictureSize size, int frames_per_s)
    : path_(std::move(path)), size_(size), to_{opened(path_)} {
  if (to_.fd < 0) {
    fail(errno == ENXIO ? "nobody reads this pipe; start the reader first"
                        : std::string(std::strerror(errno)) + "; name a place that can be written");
  }
  // The colour differences stand in the middle of their squares, which y4m calls "jpeg"; the range
  // is limited all the same.
  write(bytes_of("YUV4MPEG2 W" + std::to_string(size.width) + " H" + std::to_string(size.height) +
                 " F" + std::to_string(frames_per_s) +
                 ":1 Ip A1:1 C420jpeg XCOLORRANGE=LIMITED\n"));
  whole_bytes_ = written_bytes_;
}

VideoFile::Descriptor::~Descriptor() {
  if (fd >= 0) close(fd);
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
    if (count == 0) fail("its reader takes nothing any more; record to a file");
    // What a pipe that is ready takes without waiting.
    const ssize_t written =
        ::write(to_.fd, bytes.data(), std::min<std::size_t>(bytes.size(), PIPE_BUF));
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (written < 0) {
      fail(errno == EPIPE ? "its reader has gone; record to a file"
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

}  // namespace kerf
