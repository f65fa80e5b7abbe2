// SPDX-License-Identifier: Apache-2.0
#include "record/input_rows.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "record/packed_npy.hpp"
#include "record/tick_log.hpp"

namespace kerf {
namespace {

TickRecord record_of(const TickInputs& inputs, Tick tick) {
  TickRecord out{};
  out.seq = 2 * tick;
  out.tick = tick;
  std::ranges::copy(inputs.raw, out.raw);
  out.stale = inputs.stale;
  out.command = inputs.command;
  out.command_argument = inputs.command_argument;
  out.last_command = inputs.last_command;
  return out;
}

/// Reads a file of exactly that many rows.
bool read_inputs(const std::filesystem::path& path, std::size_t count,
                 std::vector<TickInputs>& rows) {
  rows.resize(count);
  PackedNpyReader file(path, inputs_header(count));
  return file.read(std::as_writable_bytes(std::span(rows))) && file.at_end();
}

}  // namespace

std::filesystem::path inputs_file(const std::filesystem::path& folder, std::size_t arm,
                                  Tick first) {
  char name[32];
  std::snprintf(name, sizeof name, "%012llu.npy.gz", static_cast<unsigned long long>(first));
  return folder / inputs_name(arm) / name;
}

std::string inputs_header(std::size_t rows) {
  constexpr std::size_t kBytes = 256;
  return npy_header(
      "[('raw', '<i4', (11,)), ('stale', '<u4'), ('command', '<u4'), ('command_argument', '<u4'), "
      "('last_command', '<u4')]",
      std::to_string(rows) + ",", kBytes);
}

InputReader::InputReader(std::filesystem::path folder, Tick last, std::size_t arms)
    : folder_(std::move(folder)), last_(last), arms_(arms) {}

std::span<const TickRecord> InputReader::next() {
  if (next_ > last_) return {};
  const auto row = static_cast<std::size_t>((next_ - 1) % kInputsAFile);
  if (row == 0) read_file();
  for (std::size_t arm = 0; arm < arms_; ++arm) tick_[arm] = record_of(rows_[arm][row], next_);
  ++next_;
  return std::span(tick_).first(arms_);
}

void InputReader::read_file() {
  const auto wanted = static_cast<std::size_t>(std::min<Tick>(last_ - next_ + 1, kInputsAFile));
  for (std::size_t arm = 0; arm < arms_; ++arm) {
    const std::filesystem::path path = inputs_file(folder_, arm, next_);
    if (read_inputs(path, kInputsAFile, rows_[arm]) || read_inputs(path, wanted, rows_[arm])) {
      continue;
    }
    throw DamagedRecording(path.string() + ": the inputs from tick " + std::to_string(next_) +
                           " on are missing or damaged; copy the recording again");
  }
}

}  // namespace kerf
