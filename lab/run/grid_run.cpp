// SPDX-License-Identifier: Apache-2.0
#include "lab/run/grid_run.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf::grid {
namespace {

constexpr PartWords kSweepWords{
    .option = "--out",
    .busy = "another sweep is at work there",
    .not_opened = "",
    .not_written = "cannot be written; make room, then give the same command again"};

/// The part in a folder that is made for it. Throws `HilError` if the folder has a finished sweep.
std::filesystem::path part_in(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw HilError("--out " + folder.string() + ": " + error.message() + "; name another folder");
  }
  if (std::filesystem::exists(folder / kTableName)) {
    throw HilError("--out " + folder.string() + ": holds " + kTableName +
                   ", a sweep that is done; " + "name another folder");
  }
  return folder / kPartName;
}

}  // namespace

std::size_t threads_for(int asked) {
  return asked > 0 ? static_cast<std::size_t>(asked)
                   : std::max(1U, std::thread::hardware_concurrency());
}

void Run::all(std::size_t cells,
              const std::function<void(std::size_t cell, std::size_t thread)>& work,
              const std::function<void()>& meanwhile) {
  std::atomic<std::size_t> next{0};
  std::size_t working = std::min(threads_, cells);
  std::condition_variable ended;
  std::exception_ptr failure;
  const auto measure = [&](std::size_t thread) {
    const BlockStopSignals to_caller;
    std::exception_ptr thrown;
    try {
      for (std::size_t cell = next++; cell < cells && !stop_; cell = next++) work(cell, thread);
    } catch (const Interrupted&) {
    } catch (...) {
      thrown = std::current_exception();
      stop_ = true;
    }
    const std::scoped_lock hold(results_);
    if (!failure) failure = thrown;
    --working;
    ended.notify_one();
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0, count = working; i < count; ++i) threads.emplace_back(measure, i);
    std::unique_lock hold(results_);
    while (working > 0) {
      if (asked_ != nullptr && *asked_) stop_ = true;
      if (meanwhile) meanwhile();
      ended.wait_for(hold, std::chrono::milliseconds(50));
    }
  }
  if (failure) std::rethrow_exception(failure);
}

PartFile::PartFile(const PartWords& words, std::filesystem::path path)
    : words_(words), path_(std::move(path)) {
  fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (fd_ < 0) refuse(std::generic_category().message(errno) + words_.not_opened);
  struct stat held {};
  struct stat there {};
  // A run that has ended in between has removed the file that is locked, or put another in its
  // place.
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0 || fstat(fd_, &held) != 0 ||
      stat(path_.c_str(), &there) != 0 || held.st_ino != there.st_ino) {
    close(fd_);  // a constructor that throws has no destructor
    refuse(words_.busy);
  }
}

PartFile::~PartFile() {
  close(fd_);
}

std::string PartFile::text() const {
  return text_in(path_);
}

void PartFile::cut_to_whole_lines() {
  const auto size = static_cast<off_t>(text().rfind('\n') + 1);  // none: 0
  if (ftruncate(fd_, size) != 0) refuse(words_.not_written);
}

void PartFile::add(const std::string& line) {
  const std::string text = line + "\n";
  if (write(fd_, text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
      fdatasync(fd_) != 0) {
    refuse(words_.not_written);
  }
}

void PartFile::refuse(const std::string& why) const {
  throw HilError(std::string(words_.option) + " " + path_.string() + ": " + why);
}

Table::Table(const std::filesystem::path& folder, const std::string& plan)
    : part_(kSweepWords, part_in(folder)) {
  const std::string text = part_.text(), first = plan + "\n";
  if (text.size() >= first.size() ? !text.starts_with(first) : !first.starts_with(text)) {
    part_.refuse(
        "is a part of another sweep, or of other programs; finish that one, or name another "
        "folder");
  }
  part_.cut_to_whole_lines();
  if (text.size() < first.size()) part_.add(plan);  // new, or cut in its first line
  std::size_t at = first.size();
  for (std::size_t end = 0; (end = text.find('\n', at)) != text.npos; at = end + 1) {
    std::size_t cell = 0;
    const auto read = std::from_chars(text.data() + at, text.data() + end, cell);
    if (read.ec != std::errc{} || *read.ptr != ',') continue;
    rows_[cell] = std::string(read.ptr + 1, text.data() + end);
  }
}

std::size_t Table::failed() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(rows_, [](const auto& row) { return !row.second.ends_with(','); }));
}

void Table::add(std::size_t cell, const std::string& row) {
  part_.add(std::to_string(cell) + "," + row);
  rows_[cell] = row;
}

void Table::finish(const std::string& head) {
  std::string text = "run," + head + "\n";
  for (const auto& [cell, row] : rows_) text += std::to_string(cell) + "," + row + "\n";
  write_new_file(part_.path().parent_path() / kTableName, text);
  std::filesystem::remove(part_.path());
}

}  // namespace kerf::grid
