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

TickLogWriter::TickLogWriter(std::filesystem::path path, Begin begin, std::uint64_t most_rows,
                             std::uint64_t rows_a_part)
    : path_(std::move(path)), rows_a_part_(rows_a_part) {
  std::error_code none;
  const bool has_rows =
      begin == Begin::after_last && std::filesystem::file_size(path_, none) >= kTickLogHeaderBytes;
  const int create = begin == Begin::new_file ? O_CREAT | O_EXCL : 0;
  if (!has_rows && std::filesystem::exists(part_of_log(path_, 2), none)) {
    throw RecordError(part_of_log(path_, 2).string() + ": of a recording; choose another --out");
  }
  fd_ = lock_ = open(path_.c_str(), O_WRONLY | O_CLOEXEC | create, 0666);
  if (fd_ < 0 && errno == EEXIST) {
    throw RecordError(path_.string() + ": holds a recording; choose another --out");
  }
  if (fd_ < 0) fail(errno);
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(std::exchange(lock_, -1));
    throw RecordError(path_.string() + ": another recorder writes it; choose another --out");
  }
  if (has_rows) go_on(most_rows);
  const auto whole = static_cast<off_t>(kTickLogHeaderBytes + rows_of_part() * sizeof(TickRecord));
  if (begin == Begin::after_last && ftruncate(fd_, whole) != 0) fail(errno);
  buffer_.reserve(kBufferRows);
  write_header();
}

void TickLogWriter::go_on(std::uint64_t most_rows) {
  const TickLogReader log(path_);
  written_ = std::min(log.rows(), most_rows);
  for (const TickLogReader::Part& part : log.parts()) {
    if (part.first > written_) {
      std::filesystem::remove(part.path);
    } else {
      first_ = part.first;
      part_ = static_cast<std::size_t>(&part - log.parts().data()) + 1;
    }
  }
  if (part_ == 1) return;
  fd_ = open(part_of_log(path_, part_).c_str(), O_WRONLY | O_CLOEXEC);
  if (fd_ < 0) fail(errno);
}

TickLogWriter::~TickLogWriter() {
  if (fd_ >= 0 && fd_ != lock_) close(fd_);
  if (lock_ >= 0) close(lock_);
}

void TickLogWriter::begin_part() {
  sync();
  const int next =
      open(part_of_log(path_, ++part_).c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_TRUNC, 0666);
  if (next < 0) fail(errno);
  if (const int before = std::exchange(fd_, next); before != lock_) close(before);
  first_ = written_;
  write_header();
  if (fdatasync(fd_) != 0) fail(errno);  // on the disk before any row
}

void TickLogWriter::append(const TickRecord& record) {
  if (buffer_.size() == kBufferRows) flush();
  if (rows_of_part() + buffer_.size() >= rows_a_part_) begin_part();
  buffer_.push_back(record);
}

void TickLogWriter::flush() {
  const std::uint64_t offset = kTickLogHeaderBytes + rows_of_part() * sizeof(TickRecord);
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
  synced_ = written_;
}

void TickLogWriter::write_header() {
  const std::string header = tick_log_header(rows_of_part());
  const int error = write_at(fd_, header.data(), header.size(), 0);
  if (error != 0) fail(error);
}

void TickLogWriter::fail(int error) {
  if (fd_ >= 0) {
    // Complete rows stay usable: cut the row that did not fit, count the others. The header is on a
    // block that the file already has.
    const auto whole =
        static_cast<off_t>(kTickLogHeaderBytes + rows_of_part() * sizeof(TickRecord));
    const std::string header = tick_log_header(rows_of_part());
    if (ftruncate(fd_, whole) == 0 && rows_of_part() > 0) {
      static_cast<void>(write_at(fd_, header.data(), header.size(), 0));
    }
    buffer_.clear();
  }
  throw RecordError(part_of_log(path_, part_).string() + ": cannot be written (" +
                    std::generic_category().message(error) +
                    "); make room or choose another --out");
}

}  // namespace kerf
