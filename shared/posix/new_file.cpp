// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/new_file.hpp"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "shared/posix/failure.hpp"

namespace kerf {

NewFile::NewFile(const std::filesystem::path& path) : path_(path) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) {
    temporary_ = path.string() + ".new-" + std::to_string(::getpid());
  }
  constexpr mode_t kReadWriteAll = 0666;  // the user's mask takes away from this
  const auto& target = temporary_.empty() ? path_ : temporary_;
  fd_ = ::open(target.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, kReadWriteAll);
  if (fd_ < 0) fail(errno);
}

NewFile::~NewFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!committed_ && !temporary_.empty()) ::unlink(temporary_.c_str());
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
  const bool stored = ::fsync(fd_) == 0 || errno == EINVAL || errno == EROFS;  // pipes cannot
  const int error = errno;
  if (::close(std::exchange(fd_, -1)) != 0) fail(errno);
  if (!stored) fail(error);
}

void NewFile::commit() {
  if (!temporary_.empty() && ::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno);
  committed_ = true;
}

void NewFile::fail(int error) const {
  throw FileError(path_.string() + ": cannot be written (" +
                  std::generic_category().message(error) + "); " +
                  way_out_of(error, "make room or choose another place"));
}

void check_new_file(const std::filesystem::path& path) {
  const NewFile never_committed(path);
}

void write_new_file(const std::filesystem::path& path, std::string_view bytes) {
  NewFile file(path);
  file.write(bytes.data(), bytes.size());
  file.close();
  file.commit();
}

}  // namespace kerf
