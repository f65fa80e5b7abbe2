// SPDX-License-Identifier: Apache-2.0
#include "record/tick_log_writer.hpp"

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace kerf {
namespace {

/// Writes all of `bytes` at `offset`; 0 or the error.
[[nodiscard]] int write_at(int fd, const void* data, std::size_t bytes, std::uint64_t offset) {
  const auto* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = pwrite(fd, at, bytes, static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    if (written == 0) return ENOSPC;
    at += written;
    offset += static_cast<std::uint64_t>(written);
    bytes -= static_cast<std::size_t>(written);
  }
  return 0;
}

}  // namespace

TickLogWriter::TickLogWriter(std::filesystem::path path, Begin begin, std::uint64_t most_rows)
    : path_(std::move(path)) {
  std::error_code none;
  const bool has_rows =
      begin == Begin::after_last && std::filesystem::file_size(path_, none) >= kTickLogHeaderBytes;
  if (has_rows) written_ = std::min(TickLogReader(path_).rows(), most_rows);
  const int create = begin == Begin::new_file ? O_CREAT | O_EXCL : 0;
  fd_ = open(path_.c_str(), O_WRONLY | O_CLOEXEC | create, 0666);
  if (fd_ < 0 && errno == EEXIST) {
    throw RecordError(path_.string() + ": holds a recording; choose another --out");
  }
  if (fd_ < 0) fail(errno);
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(std::exchange(fd_, -1));
    throw RecordError(path_.string() + ": another recorder writes it; choose another --out");
  }
  const auto whole = static_cast<off_t>(kTickLogHeaderBytes + written_ * sizeof(TickRecord));
  if (begin == Begin::after_last && ftruncate(fd_, whole) != 0) fail(errno);
  buffer_.reserve(kBufferRows);
  write_header();
}

TickLogWriter::~TickLogWriter() {
  if (fd_ >= 0) close(fd_);
}

void TickLogWriter::append(const TickRecord& record) {
  if (buffer_.size() == kBufferRows) flush();
  buffer_.push_back(record);
}

void TickLogWriter::flush() {
  const std::uint64_t offset = kTickLogHeaderBytes + written_ * sizeof(TickRecord);
  const int error = write_at(fd_, buffer_.data(), buffer_.size() * sizeof(TickRecord), offset);
  if (error != 0) fail(error);
  written_ += buffer_.size();
  buffer_.clear();
}

void TickLogWriter::sync() {
  flush();
  if (fdatasync(fd_) != 0) fail(errno);
  write_header();
  if (fdatasync(fd_) != 0) fail(errno);
}

void TickLogWriter::write_header() {
  const std::string header = tick_log_header(written_);
  const int error = write_at(fd_, header.data(), header.size(), 0);
  if (error != 0) fail(error);
}

void TickLogWriter::fail(int error) {
  if (fd_ >= 0) {
    // Complete rows stay usable: cut the row that did not fit, count the others. The header is on a
    // block that the file already has.
    const auto whole = static_cast<off_t>(kTickLogHeaderBytes + written_ * sizeof(TickRecord));
    const std::string header = tick_log_header(written_);
    if (ftruncate(fd_, whole) == 0 && written_ > 0) {
      static_cast<void>(write_at(fd_, header.data(), header.size(), 0));
    }
    buffer_.clear();
  }
  throw RecordError(path_.string() + ": cannot be written (" +
                    std::generic_category().message(error) +
                    "); make room or choose another --out");
}

}  // namespace kerf
