// SPDX-License-Identifier: Apache-2.0
#include "record/tick_log.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "record/packed_npy.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// NumPy's name of a type text: "<f8", "|u1".
[[nodiscard]] std::string numpy_type(std::string_view type) {
  const std::uint32_t bytes = type_bytes(type);
  return std::string(bytes == 1 ? "|" : "<") + type.front() + std::to_string(bytes);
}

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

std::string tick_log_header(std::uint64_t rows) {
  std::string columns;
  for (const LayoutField& field : kLayoutTable) {
    if (field.record != "TickRecord") continue;
    columns += "('" + std::string(field.name) + "', '" + numpy_type(field.type) + "'";
    if (field.count > 1) columns += ", (" + std::to_string(field.count) + ",)";
    columns += "), ";
  }
  return npy_header("[" + columns + "]", std::to_string(rows) + ",", kTickLogHeaderBytes);
}

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

namespace {

/// The row count of `header`; throws if it is not `tick_log_header` of that count.
[[nodiscard]] std::uint64_t rows_of(const std::string& header, const std::string& path) {
  constexpr std::string_view kShape = "'shape': (";
  const std::size_t at = header.find(kShape);
  if (header.size() < kTickLogHeaderBytes) {
    const std::string_view fixed = std::string_view(header).substr(0, at);
    if (tick_log_header(0).starts_with(fixed)) {
      throw RecordError(path + ": " + std::to_string(header.size()) +
                        " bytes, cut before its first tick; record it again");
    }
  }
  std::uint64_t rows = 0;
  if (at != std::string::npos) {
    const char* const digits = header.data() + at + kShape.size();
    std::from_chars(digits, header.data() + header.size(), rows);
  }
  if (header.size() < kTickLogHeaderBytes || header != tick_log_header(rows)) {
    throw RecordError(path + ": not a tick log of this version; record it again");
  }
  return rows;
}

}  // namespace

std::string way_to_recording(const std::filesystem::path& folder) {
  const std::filesystem::path below = folder / "log";
  std::error_code fault;
  const bool is_below = std::filesystem::is_regular_file(below / "ticks.npy", fault);
  return "give " + (is_below ? below.string() : "the folder of a recording");
}

TickLogReader::TickLogReader(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code fault;
  const bool is_file =
      std::filesystem::is_regular_file(path_, fault);  // a pipe would be waited for
  if (is_file) file_.open(path_, std::ios::binary);
  if (!file_.is_open()) {
    throw RecordError(path_.string() + ": cannot be read; " +
                      way_to_recording(path_.parent_path()));
  }
  std::string header(kTickLogHeaderBytes, '\0');
  file_.read(header.data(), static_cast<std::streamsize>(header.size()));
  header.resize(static_cast<std::size_t>(file_.gcount()));
  counted_ = rows_of(header, path_.string());
  file_.clear();
  file_.seekg(0, std::ios::end);
  const auto bytes = static_cast<std::uint64_t>(file_.tellg());
  rows_ = bytes < kTickLogHeaderBytes ? 0 : (bytes - kTickLogHeaderBytes) / sizeof(TickRecord);
}

std::size_t TickLogReader::read(std::uint64_t first, std::span<TickRecord> rows) {
  const std::uint64_t left = rows_ - std::min(first, rows_);
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(rows.size(), left));
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(kTickLogHeaderBytes + first * sizeof(TickRecord)));
  file_.read(reinterpret_cast<char*>(rows.data()),
             static_cast<std::streamsize>(count * sizeof(TickRecord)));
  if (!file_) throw RecordError(path_.string() + ": cannot be read; copy it again");
  for (std::size_t i = 0; i < count; ++i) {
    if (tick_record_crc(rows[i]) == rows[i].crc32c) continue;
    if (i > 0) return i;
    throw RecordError(path_.string() + ": row " + std::to_string(first) +
                      " has a wrong checksum; copy it again");
  }
  return count;
}

std::uint64_t TickLogReader::row_of(Tick tick) {
  std::uint64_t below = 0,
                end = rows_;  // rows before `below` are earlier, those from `end` are not
  while (below < end) {
    const std::uint64_t middle = below + (end - below) / 2;
    Tick there = 0;
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(kTickLogHeaderBytes + middle * sizeof(TickRecord) +
                                            offsetof(TickRecord, tick)));
    file_.read(reinterpret_cast<char*>(&there), sizeof there);
    if (!file_) throw RecordError(path_.string() + ": cannot be read; copy it again");
    (there < tick ? below : end) = there < tick ? middle + 1 : middle;
  }
  return below;
}

void TickLogReader::for_each(const std::function<void(const TickRecord&)>& visit, TickRange range) {
  std::vector<TickRecord> chunk(kChunkRows);
  for (std::uint64_t row = range.from == 0 ? 0 : row_of(range.from); row < rows_;) {
    const std::size_t count = read(row, chunk);
    for (const TickRecord& record : std::span(chunk).first(count)) {
      if (record.tick > range.until) return;
      visit(record);
      if (record.tick == range.until) return;
    }
    row += count;
  }
}

}  // namespace kerf
