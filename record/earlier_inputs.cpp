// SPDX-License-Identifier: Apache-2.0
#include "record/earlier_inputs.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <span>
#include <system_error>
#include <utility>

#include "record/packed_npy.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

fs::path file_of(const fs::path& folder, std::size_t arm, Tick first) {
  char name[32];
  std::snprintf(name, sizeof name, "%012llu.npy.gz", static_cast<unsigned long long>(first));
  return folder / inputs_name(arm) / name;
}

std::string header_of(std::size_t rows) {
  constexpr std::size_t kBytes = 256;
  return npy_header(
      "[('raw', '<i4', (11,)), ('stale', '<u4'), ('command', '<u4'), ('command_argument', '<u4'), "
      "('last_command', '<u4')]",
      std::to_string(rows) + ",", kBytes);
}

/// The columns that both have.
template <class To, class From>
void copy_columns(const From& from, To& to) {
  std::ranges::copy(from.raw, to.raw);
  to.stale = from.stale;
  to.command = from.command;
  to.command_argument = from.command_argument;
  to.last_command = from.last_command;
}

TickInputs inputs_of(const TickRecord& record) {
  TickInputs out{};
  copy_columns(record, out);
  return out;
}

TickRecord record_of(const TickInputs& inputs, Tick tick) {
  TickRecord out{};
  out.seq = 2 * tick;
  out.tick = tick;
  copy_columns(inputs, out);
  return out;
}

void write_inputs(const fs::path& path, std::span<const TickInputs> rows) {
  AtomicFile file(path);
  write_packed_npy(file, header_of(rows.size()), std::as_bytes(rows));
  file.commit();
}

/// Makes the folder for inputs in `recording`. Throws FileError if there is one, or a link.
void make_inputs_folder(const fs::path& recording, std::size_t arm) {
  std::error_code fault;
  if (fs::create_directory(recording / inputs_name(arm), fault)) return;
  throw FileError((recording / inputs_name(arm)).string() + ": " +
                  (fault ? fault.message() : "there is one") + "; choose another --out");
}

/// Reads a file of exactly that many rows.
bool read_inputs(const fs::path& path, std::size_t count, std::vector<TickInputs>& rows) {
  rows.resize(count);
  PackedNpyReader file(path, header_of(count));
  return file.read(std::as_writable_bytes(std::span(rows))) && file.at_end();
}

}  // namespace

EarlierInputs::EarlierInputs(fs::path folder, std::size_t arm)
    : folder_(std::move(folder)), arm_(arm) {
  make_inputs_folder(folder_, arm_);
  rows_.reserve(kTicksAFile);
}

void EarlierInputs::finish_writing() {
  if (!writing_.valid()) return;
  try {
    writing_.get();
  } catch (const std::exception& error) {
    problem_ = error.what();
  }
}

void EarlierInputs::add(const TickRecord& record) {
  if (!problem_.empty()) return;
  const Tick next = first_ + rows_.size();
  if (record.tick != next) {
    problem_ = "tick " + std::to_string(next) + " was not seen";
    if (next == 1) problem_ += "; start the flight recorder before the controller";
    return;
  }
  if (rows_.size() == kTicksAFile) {
    finish_writing();
    writing_ = std::async(std::launch::async, [path = file_of(folder_, arm_, first_),
                                               rows = rows_] { write_inputs(path, rows); });
    first_ = next;
    rows_.clear();
  }
  rows_.push_back(inputs_of(record));
}

std::string EarlierInputs::keep(const fs::path& folder, Tick last) {
  finish_writing();
  if (!problem_.empty() || last == 0) return problem_;
  make_inputs_folder(folder, arm_);
  for (Tick first = 1; first < first_ && first <= last; first += kTicksAFile) {
    link_file(file_of(folder_, arm_, first), file_of(folder, arm_, first));
  }
  if (first_ <= last) {
    write_inputs(file_of(folder, arm_, first_), std::span(rows_).first(last - first_ + 1));
  }
  return {};
}

void for_each_input(const fs::path& folder, Tick last, std::size_t arms,
                    const std::function<void(std::span<const TickRecord>)>& visit) {
  std::array<std::vector<TickInputs>, kMaxArms> rows;
  std::array<TickRecord, kMaxArms> tick;
  for (Tick first = 1; first <= last; first += EarlierInputs::kTicksAFile) {
    const std::size_t wanted = std::min<Tick>(last - first + 1, EarlierInputs::kTicksAFile);
    for (std::size_t arm = 0; arm < arms; ++arm) {
      const fs::path path = file_of(folder, arm, first);
      if (read_inputs(path, EarlierInputs::kTicksAFile, rows[arm]) ||
          read_inputs(path, wanted, rows[arm])) {
        continue;
      }
      throw RecordError(path.string() + ": the inputs from tick " + std::to_string(first) +
                        " on are missing or damaged; copy the recording again");
    }
    for (std::size_t i = 0; i < wanted; ++i) {
      for (std::size_t arm = 0; arm < arms; ++arm) tick[arm] = record_of(rows[arm][i], first + i);
      visit(std::span(tick).first(arms));
    }
  }
}

void copy_inputs(const fs::path& from, const fs::path& to, Tick last) {
  if (last == 0) return;
  std::error_code fault, ignored;
  for (std::size_t arm = 0; arm < kMaxArms && !fault; ++arm) {
    if (arm != 0 && !fs::exists(from / inputs_name(arm), ignored)) continue;
    make_inputs_folder(to, arm);
    for (Tick first = 1; first <= last && !fault; first += EarlierInputs::kTicksAFile) {
      fs::copy_file(file_of(from, arm, first), file_of(to, arm, first), fault);
    }
  }
  if (!fault) return;
  for (std::size_t arm = 0; arm < kMaxArms; ++arm) fs::remove_all(to / inputs_name(arm), ignored);
  throw FileError((to / inputs_name(0)).string() + ": " + fault.message() +
                  "; choose another --out");
}

void link_file(const fs::path& from, const fs::path& to) {
  std::error_code fault;
  fs::create_hard_link(from, to, fault);
  if (fault) fs::copy_file(from, to, fault);
  if (fault) throw FileError(to.string() + ": " + fault.message() + "; choose another --out");
}

}  // namespace kerf
