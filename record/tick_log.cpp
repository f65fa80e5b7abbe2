// SPDX-License-Identifier: Apache-2.0
#include "record/tick_log.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

#include "record/npy_header.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/segment/tick_table.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// NumPy's name of a type text: "<f8", "|u1".
[[nodiscard]] std::string numpy_type(std::string_view type) {
  const std::uint32_t bytes = type_bytes(type);
  return std::string(bytes == 1 ? "|" : "<") + type.front() + std::to_string(bytes);
}

}  // namespace

std::string tick_log_header(std::uint64_t rows) {
  std::string columns;
  for (const auto& [field, unit, made, meaning, valid] : kTickFields) {
    columns += "('" + std::string(field.name) + "', '" + numpy_type(field.type) + "'";
    if (field.count > 1) columns += ", (" + std::to_string(field.count) + ",)";
    columns += "), ";
  }
  return npy_header("[" + columns + "]", std::to_string(rows) + ",", kTickLogHeaderBytes);
}

namespace {

/// The row count of `header`; throws if it is not `tick_log_header` of that count.
[[nodiscard]] std::uint64_t rows_of(const std::string& header, const std::string& path) {
  constexpr std::string_view kShape = "'shape': (";
  const std::size_t at = header.find(kShape);
  if (header.size() < kTickLogHeaderBytes) {
    const std::string_view fixed = std::string_view(header).substr(0, at);
    if (tick_log_header(0).starts_with(fixed)) {
      throw DamagedRecording(path + ": " + std::to_string(header.size()) +
                             " bytes, cut before its first tick; record it again");
    }
  }
  std::uint64_t rows = 0;
  if (at != std::string::npos) {
    const char* const digits = header.data() + at + kShape.size();
    std::from_chars(digits, header.data() + header.size(), rows);
  }
  if (header.size() < kTickLogHeaderBytes || header != tick_log_header(rows)) {
    throw DamagedRecording(path + ": not a tick log of this version; record it again");
  }
  return rows;
}

}  // namespace

std::size_t files_of_log(const std::filesystem::path& path) {
  std::size_t files = 1;
  std::error_code fault;
  while (std::filesystem::is_regular_file(part_of_log(path, files + 1), fault)) ++files;
  return files;
}

bool is_recording(const std::filesystem::path& folder) {
  std::error_code fault;
  return std::filesystem::is_regular_file(folder / "ticks.npy", fault);
}

std::string way_to_recording(const std::filesystem::path& folder) {
  std::error_code fault;
  if (is_recording(folder) || std::filesystem::exists(folder / "manifest.json", fault)) {
    return "copy the recording again";
  }
  const std::filesystem::path below = folder / "log";
  return "give " + (is_recording(below) ? below.string() : "the folder of a recording");
}

void refuse_recording(const std::filesystem::path& folder, const std::string& line) {
  if (is_recording(folder)) throw DamagedRecording(line);
  throw RecordError(line);
}

std::ifstream open_recorded(const std::filesystem::path& path, const std::string& way,
                            std::uintmax_t most_bytes) {
  if (const std::string why = access_error(path); !why.empty()) {
    throw RecordError(path.string() + why);
  }
  const auto refuse = [&](const std::string& why) {
    refuse_recording(path.parent_path(), path.string() + ": " + why);
  };
  std::error_code fault;
  if (!std::filesystem::exists(path, fault)) refuse("cannot be read; " + way);
  if (!std::filesystem::is_regular_file(path, fault)) {  // opening a pipe would wait for its writer
    refuse("no regular file; copy the recording again");
  }
  if (std::filesystem::file_size(path, fault) > most_bytes) {
    refuse("larger than that of any recording; copy the recording again");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) {
    const int error = errno;
    throw RecordError(path.string() + ": cannot be read (" +
                      std::generic_category().message(error) + "); " +
                      remedy_for(error, "check its rights"));
  }
  return file;
}

std::filesystem::path part_of_log(const std::filesystem::path& path, std::size_t part) {
  if (part == 1) return path;
  std::string number = std::to_string(part);
  constexpr std::size_t kDigits = 4;
  number.insert(0, kDigits - std::min(kDigits, number.size()), '0');
  return path.string() + "." + number;
}

std::string why_unsound(const TickRecord& row) {
  if (tick_record_crc(row) != row.crc32c) return "has a wrong checksum";
  if (row.seq >= 2 && row.seq % 2 == 0 && row.seq / 2 <= row.tick) return {};
  return "has seq " + std::to_string(row.seq) + ", which is not of tick " +
         std::to_string(row.tick);
}

std::string why_out_of_order(const TickRecord& before, const TickRecord& row) {
  const std::uint64_t rests_before = before.tick - before.seq / 2;
  const std::uint64_t rests = row.tick - row.seq / 2;
  if (row.seq > before.seq && rests >= rests_before) return {};  // so is its tick
  return "(tick " + std::to_string(row.tick) + ", seq " + std::to_string(row.seq) +
         ") cannot follow tick " + std::to_string(before.tick) + ", seq " +
         std::to_string(before.seq);
}

namespace {

/// The name of a file of this log behind that of number `part`; empty if there is none.
std::string part_behind(const std::filesystem::path& path, std::size_t part) {
  const std::string begin = path.filename().string() + ".";
  std::error_code fault;
  std::size_t next = 0;  // the first of them
  for (std::filesystem::directory_iterator at(path.parent_path() / ".", fault), end;
       !fault && at != end; at.increment(fault)) {
    const std::string name = at->path().filename().string();
    if (!name.starts_with(begin)) continue;
    std::size_t number = 0;
    std::from_chars(name.data() + begin.size(), name.data() + name.size(), number);
    if (number <= part || part_of_log(path, number).filename() != name) continue;
    next = next == 0 ? number : std::min(next, number);
  }
  return next == 0 ? std::string() : part_of_log(path, next).filename().string();
}

}  // namespace

TickLogReader::TickLogReader(std::filesystem::path path) : path_(std::move(path)) {
  static_cast<void>(add_part(path_));
  const auto is_there = [&](std::size_t part) {  // a folder, a pipe or a dangling link, too
    std::error_code fault;
    return std::filesystem::symlink_status(part_of_log(path_, part), fault).type() !=
           std::filesystem::file_type::not_found;
  };
  // The last one has no header yet if its recorder was killed as it began it.
  std::size_t part = 2;
  while (is_there(part) && add_part(part_of_log(path_, part))) ++part;
  const std::string later = part_behind(path_, part);
  if (!later.empty()) {
    throw DamagedRecording(part_of_log(path_, part).string() +
                           ": missing, or cut in its header, and " + later +
                           " is there; copy the recording again");
  }
  leave_out_torn_rows();
}

bool TickLogReader::add_part(const std::filesystem::path& path) {
  std::ifstream file = open_recorded(path, way_to_recording(path.parent_path()));
  std::string header(kTickLogHeaderBytes, '\0');
  file.read(header.data(), static_cast<std::streamsize>(header.size()));
  header.resize(static_cast<std::size_t>(file.gcount()));
  // Zeros: of a power cut before the header was on the disk, which is before any row.
  const bool has_header =
      header.size() == kTickLogHeaderBytes && header.find_first_not_of('\0') != std::string::npos;
  if (!parts_.empty() && !has_header) return false;
  const std::uint64_t counted = rows_of(header, path.string());
  file.clear();
  file.seekg(0, std::ios::end);
  const auto bytes = static_cast<std::uint64_t>(file.tellg());
  const std::uint64_t behind = bytes - std::min<std::uint64_t>(bytes, kTickLogHeaderBytes);
  const std::uint64_t rows = behind / sizeof(TickRecord);
  parts_.push_back({path, rows_, rows, counted, behind % sizeof(TickRecord)});
  rows_ += rows;
  counted_ += counted;
  file_ = std::move(file);
  open_ = parts_.size() - 1;
  return true;
}

void TickLogReader::leave_out_torn_rows() {
  Part& last = parts_.back();
  std::vector<TickRecord> chunk;
  std::uint64_t rows = last.rows;
  while (rows > last.counted) {
    chunk.resize(
        static_cast<std::size_t>(std::min<std::uint64_t>(kChunkRows, rows - last.counted)));
    if (!read_raw(last.first + rows - chunk.size(), chunk)) return;  // its reader says so
    const auto sound = std::find_if(chunk.rbegin(), chunk.rend(),
                                    [](const TickRecord& row) { return why_unsound(row).empty(); });
    rows -= static_cast<std::uint64_t>(sound - chunk.rbegin());
    if (sound != chunk.rend()) break;
  }
  last.bytes_left += (last.rows - rows) * sizeof(TickRecord);
  last.rows = rows;
  rows_ = last.first + rows;
}

void TickLogReader::end_at(std::uint64_t rows) {
  rows_ = std::min(rows_, rows);
}

bool TickLogReader::read_raw(std::uint64_t first, std::span<TickRecord> rows) {
  while (!rows.empty()) {
    const auto behind = std::ranges::upper_bound(parts_, first, {}, &Part::first);
    const auto& part = *std::prev(behind);
    const auto which = static_cast<std::size_t>(std::prev(behind) - parts_.begin());
    if (first - part.first >= part.rows) return false;
    if (which != std::exchange(open_, which)) {
      file_.close();
      file_.open(part.path, std::ios::binary);
    }
    const auto count = static_cast<std::size_t>(
        std::min<std::uint64_t>(rows.size(), part.first + part.rows - first));
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(kTickLogHeaderBytes +
                                            (first - part.first) * sizeof(TickRecord)));
    file_.read(reinterpret_cast<char*>(rows.data()),
               static_cast<std::streamsize>(count * sizeof(TickRecord)));
    if (!file_) return false;
    first += count;
    rows = rows.subspan(count);
  }
  return true;
}

std::size_t TickLogReader::read(std::uint64_t first, std::span<TickRecord> rows,
                                std::string& problem) {
  const std::uint64_t left = rows_ - std::min(first, rows_);
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(rows.size(), left));
  TickRecord before;
  bool has_before = first > 0 && count > 0;
  if ((has_before && !read_raw(first - 1, std::span(&before, 1))) ||
      !read_raw(first, rows.first(count))) {
    problem = path_.string() + ": cannot be read; copy it again";
    return 0;
  }
  // One that is damaged itself says nothing of the next.
  has_before = has_before && why_unsound(before).empty();
  std::string why;
  std::size_t good = 0;
  for (; good < count; ++good) {
    why = why_unsound(rows[good]);
    if (why.empty() && has_before) why = why_out_of_order(before, rows[good]);
    if (!why.empty()) break;
    before = rows[good];
    has_before = true;
  }
  if (good == 0 && count > 0) {
    problem = path_.string() + ": row " + std::to_string(first) + " " + why + "; copy it again";
  }
  return good;
}

std::size_t TickLogReader::read(std::uint64_t first, std::span<TickRecord> rows) {
  std::string problem;
  const std::size_t count = read(first, rows, problem);
  if (!problem.empty()) throw DamagedRecording(problem);
  return count;
}

std::uint64_t TickLogReader::row_of(Tick tick) {
  std::uint64_t below = 0,
                end = rows_;  // rows before `below` are earlier, those from `end` are not
  while (below < end) {
    const std::uint64_t middle = below + (end - below) / 2;
    TickRecord there;
    if (!read_raw(middle, std::span(&there, 1))) {
      throw DamagedRecording(path_.string() + ": cannot be read; copy it again");
    }
    (there.tick < tick ? below : end) = there.tick < tick ? middle + 1 : middle;
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
