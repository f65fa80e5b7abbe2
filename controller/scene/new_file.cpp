// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/new_file.hpp"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "controller/scene/scene_error.hpp"

namespace kerf {

NewFile::NewFile(const std::filesystem::path& path)
    : path_(path), temporary_(path.string() + ".new-" + std::to_string(::getpid())) {
  constexpr mode_t kReadWriteAll = 0666;  // the user's mask takes away from this
  fd_ = ::open(temporary_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, kReadWriteAll);
  if (fd_ < 0) fail(errno);
}

NewFile::~NewFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!committed_) ::unlink(temporary_.c_str());
}

void NewFile::write(const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(fd_, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(errno);
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

void NewFile::close() {
  if (::close(std::exchange(fd_, -1)) != 0) fail(errno);
}

void NewFile::commit() {
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno);
  committed_ = true;
}

void NewFile::fail(int error) const {
  throw SceneError(path_.string() + ": cannot be written (" +
                   std::generic_category().message(error) + "); make room or choose another place");
}

}  // namespace kerf
