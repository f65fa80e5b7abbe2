// SPDX-License-Identifier: Apache-2.0
#include "lab/sweep/table.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/text/file_text.hpp"

namespace kerf::sweep {

Table::Table(std::filesystem::path folder, const std::string& plan)
    : folder_(std::move(folder)), part_(folder_ / kPartName) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) {
    throw HilError("--out " + folder_.string() + ": " + error.message() + "; name another folder");
  }
  if (std::filesystem::exists(folder_ / kTableName)) {
    throw HilError("--out " + folder_.string() + ": holds " + kTableName +
                   ", a sweep that is done; " + "name another folder");
  }
  fd_ = open(part_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (fd_ < 0) fail(std::generic_category().message(errno).c_str());
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) fail("another sweep is at work there");

  const std::string text = text_in(part_);
  const std::string first = plan + "\n";
  if (text.size() < first.size() && first.starts_with(text)) {  // new, or cut in its first line
    if (ftruncate(fd_, 0) != 0 || write(fd_, first.data(), first.size()) != ssize_t(first.size())) {
      fail("cannot be written");
    }
    return;
  }
  if (!text.starts_with(first)) {
    fail(
        "is a part of another sweep, or of other programs; finish that one, or name another "
        "folder");
  }
  std::size_t at = first.size();
  for (std::size_t end = 0; (end = text.find('\n', at)) != text.npos; at = end + 1) {
    std::size_t run = 0;
    const auto read = std::from_chars(text.data() + at, text.data() + end, run);
    if (read.ec == std::errc{} && *read.ptr == ',') {
      rows_[run] = text.substr(static_cast<std::size_t>(read.ptr - text.data()) + 1,
                               end - static_cast<std::size_t>(read.ptr - text.data()) - 1);
    }
  }
  if (at < text.size() && ftruncate(fd_, static_cast<off_t>(at)) != 0) fail("cannot be written");
}

Table::~Table() {
  if (fd_ >= 0) close(fd_);
}

void Table::fail(const char* what) {
  if (fd_ >= 0) close(fd_);  // and its lock, in a constructor too
  fd_ = -1;
  throw HilError("--out " + part_.string() + ": " + what);
}

std::size_t Table::failed() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(rows_, [](const auto& row) { return !row.second.ends_with(','); }));
}

void Table::add(std::size_t run, const std::string& row) {
  const std::string line = std::to_string(run) + "," + row + "\n";
  if (write(fd_, line.data(), line.size()) != static_cast<ssize_t>(line.size()) ||
      fdatasync(fd_) != 0) {
    fail("cannot be written; make room, then give the same command again");
  }
  rows_[run] = row;
}

void Table::finish(const std::string& head) {
  std::string text = "run," + head + "\n";
  for (const auto& [run, row] : rows_) text += std::to_string(run) + "," + row + "\n";
  write_new_file(folder_ / kTableName, text);
  std::filesystem::remove(part_);
}

}  // namespace kerf::sweep
