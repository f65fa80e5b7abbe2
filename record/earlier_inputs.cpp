// SPDX-License-Identifier: Apache-2.0
#include "record/earlier_inputs.hpp"

#include <algorithm>
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

TickInputs inputs_of(const TickRecord& record) {
  TickInputs out{};
  std::ranges::copy(record.raw, out.raw);
  out.stale = record.stale;
  out.command = record.command;
  out.command_argument = record.command_argument;
  out.last_command = record.last_command;
  return out;
}

void write_inputs(const fs::path& path, std::span<const TickInputs> rows) {
  AtomicFile file(path);
  write_packed_npy(file, inputs_header(rows.size()), std::as_bytes(rows));
  file.commit();
}

/// Makes the folder for inputs in `recording`. Throws FileError if there is one, or a link.
void make_inputs_folder(const fs::path& recording, std::size_t arm) {
  std::error_code fault;
  if (fs::create_directory(recording / inputs_name(arm), fault)) return;
  throw FileError((recording / inputs_name(arm)).string() + ": " +
                  (fault ? fault.message() : "there is one") + "; choose another --out");
}

}  // namespace

EarlierInputs::EarlierInputs(fs::path folder, std::size_t arm)
    : folder_(std::move(folder)), arm_(arm) {
  make_inputs_folder(folder_, arm_);
  rows_.reserve(kInputsAFile);
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
  if (rows_.size() == kInputsAFile) {
    finish_writing();
    writing_ = std::async(std::launch::async, [path = inputs_file(folder_, arm_, first_),
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
  for (Tick first = 1; first < first_ && first <= last; first += kInputsAFile) {
    link_file(inputs_file(folder_, arm_, first), inputs_file(folder, arm_, first));
  }
  if (first_ <= last) {
    write_inputs(inputs_file(folder, arm_, first_), std::span(rows_).first(last - first_ + 1));
  }
  return {};
}

void copy_inputs(const fs::path& from, const fs::path& to, Tick last) {
  if (last == 0) return;
  std::error_code fault, ignored;
  for (std::size_t arm = 0; arm < kMaxArms && !fault; ++arm) {
    if (arm != 0 && !fs::exists(from / inputs_name(arm), ignored)) continue;
    make_inputs_folder(to, arm);
    for (Tick first = 1; first <= last && !fault; first += kInputsAFile) {
      fs::copy_file(inputs_file(from, arm, first), inputs_file(to, arm, first), fault);
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
