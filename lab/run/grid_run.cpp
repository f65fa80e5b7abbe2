// SPDX-License-Identifier: Apache-2.0
#include "lab/run/grid_run.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>
#include <optional>
#include <set>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "controller/scene/scene_file.hpp"
#include "hil/hil_error.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/text.hpp"
#include "shared/text/toml.hpp"

namespace kerf::grid {
namespace {

[[noreturn]] void refuse_axis(std::string_view text, const char* why) {
  throw HilError("--set " + std::string(text) + ": " + why);
}

/// The values of LO:HI:N; empty if the text is no range.
std::optional<std::vector<std::string>> range_of(std::string_view text, std::string_view values) {
  const std::vector<std::string> parts = split(values, ':');
  if (parts.size() == 2 && number_in(parts[0]) && number_in(parts[1])) {
    refuse_axis(text, "a range without its count; write LO:HI:N, such as 0.2:3:16");
  }
  const std::optional<Range> range = range_in(values);
  if (!range) return std::nullopt;
  const auto [lo, hi, count] = *range;
  if (!(count >= 1 && count <= kMostCells) || count != std::floor(count)) {
    refuse_axis(text, "not 1 to 1000000 values; write LO:HI:N, such as 0.2:3:16");
  }
  if (count == 1 && lo != hi) refuse_axis(text, "one value cannot be both ends; take 2 or more");
  std::vector<std::string> list;
  const auto last = static_cast<int>(count) - 1;
  for (int i = 0; i <= last; ++i) {
    // Twelve digits: a step of a tenth reads as one. The ends are as they were written.
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.12g", lo + (hi - lo) * i / std::max(last, 1));
    list.push_back(i == 0 ? number_text(lo) : i == last ? number_text(hi) : digits);
  }
  return list;
}

std::string meaning_of(const TomlNode& node) {
  if (const auto number = node.number()) return number_text(*number == 0 ? 0 : *number);  // no -0
  if (node.form == TomlNode::Form::value) return written(node.value);
  std::vector<std::string> parts;
  for (const TomlNode& entry : node.entries) parts.push_back(entry.key + "=" + meaning_of(entry));
  if (node.form == TomlNode::Form::table) std::ranges::sort(parts);
  std::string meaning = "[";
  for (const std::string& part : parts) meaning += part + ",";
  return meaning;
}

/// Equal for values that are the same in TOML: 1000 and +1e3, "a" and a, [0,1] and [0, 1]. As for
/// the scene, what TOML cannot read is a text.
std::string meaning_of(const std::string& value) {
  try {
    return meaning_of(parse_toml("v = " + value).entries.at(0));
  } catch (const TomlError&) {
    return written(value);
  }
}

void refuse_twins(std::string_view text, const std::vector<std::string>& values) {
  std::set<std::string> seen;
  for (const std::string& value : values) {
    if (seen.insert(meaning_of(value)).second) continue;
    refuse_axis(text, (value + " is given twice; name each value once").c_str());
  }
}

/// Refuses options of the emulator that the sweep itself sets.
void refuse_own_option(std::string_view text, std::string option) {
  option.erase(0, option.find('.') + 1);
  std::ranges::replace(option, '-', '_');
  constexpr std::string_view kOwn[] = {"personality", "front",    "socket",  "udp",  "hand",
                                       "hand_socket", "lockstep", "rate",    "stay", "seconds",
                                       "unit_mm",     "report",   "describe"};
  if (std::ranges::find(kOwn, option) == std::end(kOwn)) return;
  refuse_axis(text,
              "the sweep sets it itself; name a key of the scene, such as hand.script, or "
              "another option");
}

}  // namespace

std::vector<std::string> split(std::string_view text, char separator) {
  // Quotes and brackets are those of TOML where a value of TOML begins: a bare text may hold both.
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = 0, before = separator;  // the last character that is no space
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      parts.back() += before = c;
      if (c == '\\' && quote == '"' && i + 1 < text.size()) {
        parts.back() += text[++i];
      } else if (c == quote) {
        quote = 0;
      }
      continue;
    }
    if (c == separator && depth == 0) {
      parts.emplace_back();
      before = separator;
      continue;
    }
    const bool begins = before == separator || (depth > 0 && std::strchr("[{=,", before));
    if (begins && (c == '"' || c == '\'')) quote = c;
    if ((c == '[' || c == '{') && (begins || depth > 0)) ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    parts.back() += c;
    if (c != ' ' && c != '\t') before = c;
  }
  return parts;
}

std::optional<Range> range_in(std::string_view text) {
  const std::vector<std::string> parts = split(text, ':');
  if (parts.size() != 3) return std::nullopt;
  const auto lo = number_in(parts[0]), hi = number_in(parts[1]), count = number_in(parts[2]);
  if (!lo || !hi || !count) return std::nullopt;
  return Range{*lo, *hi, *count};
}

Axis parse_axis(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == text.npos || equals == 0) {
    refuse_axis(text, "not KEY=VALUES; write such as force.stiffness_n_per_mm=0.2:3:16");
  }
  Axis axis{std::string(text.substr(0, equals)), {}};
  const std::string_view values = text.substr(equals + 1);
  if (const auto range = range_of(text, values)) {
    axis.values = *range;
  } else {
    axis.values = split(values, ',');
  }
  if (axis.of_emulator()) refuse_own_option(text, axis.key);
  if (std::ranges::any_of(axis.values, &std::string::empty)) {
    refuse_axis(text, "a value is empty; write LO:HI:N or A,B,C");
  }
  refuse_twins(text, axis.values);
  if (!axis.of_emulator()) {
    for (const std::string& value : axis.values) {
      static_cast<void>(parse_setting(axis.key + "=" + value));
    }
  }
  return axis;
}

std::vector<Axis> parse_axes(std::span<const std::string> texts) {
  std::vector<Axis> axes;
  double runs = 1;
  for (const std::string& text : texts) {
    Axis axis = parse_axis(text);
    if (std::ranges::find(axes, axis.key, &Axis::key) != axes.end()) {
      throw HilError("--set " + text + ": the key stands there already; write one list");
    }
    runs *= static_cast<double>(axis.values.size());
    axes.push_back(std::move(axis));
  }
  if (runs > kMostCells) {
    throw HilError("--set: " + number_text(runs) + " runs; at most 1000000 go into one sweep");
  }
  return axes;
}

std::size_t cells_of(std::span<const Axis> axes) {
  std::size_t cells = 1;
  for (const Axis& axis : axes) cells *= axis.values.size();
  return cells;
}

std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t cell) {
  std::vector<std::string> values(axes.size());
  for (std::size_t i = axes.size(); i-- > 0;) {
    values[i] = axes[i].values[cell % axes[i].values.size()];
    cell /= axes[i].values.size();
  }
  return values;
}

namespace {

constexpr PartWords kSweepWords{
    .option = "--out",
    .busy = "another sweep is at work there",
    .not_opened = "",
    .not_written = "cannot be written; make room, then give the same command again"};

/// Path of the partial results in `folder`, which is created. Throws `HilError` if that fails, or
/// if the folder holds a finished sweep.
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
