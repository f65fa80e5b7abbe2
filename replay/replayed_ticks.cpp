// SPDX-License-Identifier: Apache-2.0
#include "replay/replayed_ticks.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include "record/manifest.hpp"

namespace kerf {

std::optional<DifferentTick> first_difference(const ArmRecords& recorded,
                                              const ArmRecords& replayed, std::size_t arms) {
  for (std::size_t arm = 0; arm < arms; ++arm) {
    if (const auto at = first_difference(recorded[arm], replayed[arm])) {
      return DifferentTick{recorded[arm].tick, arm, *at};
    }
  }
  return std::nullopt;
}

std::string text_of(const DifferentTick& found, std::uint32_t tick_ns) {
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.3f", static_cast<double>(found.tick) * tick_ns * 1e-9);
  return "tick " + std::to_string(found.tick) + " (" + seconds + " s), " +
         (found.arm == 0 ? "" : "arm 2, ") + std::string(found.at.stage) + ": " + found.at.field +
         " was " + found.at.recorded + ", is " + found.at.replayed;
}

std::string gap_text(Tick last, Tick next) {
  const std::string ticks = next == last + 2 ? "tick " + std::to_string(last + 1) + " was"
                                             : "ticks " + std::to_string(last + 1) + " to " +
                                                   std::to_string(next - 1) + " were";
  return ticks + " not recorded; what the servo was given there is unknown";
}

RecordedTicks::RecordedTicks(const std::filesystem::path& folder, std::size_t arms)
    : logs_(open_logs(folder, arms)) {
  for (std::size_t arm = 0; arm < arms; ++arm) {
    if (logs_[arm].rows() >= rows()) continue;
    throw DamagedRecording((folder / tick_log_name(arm)).string() + ": " +
                           std::to_string(logs_[arm].rows()) + " rows, and " +
                           std::string(kTickLogName) + " has " + std::to_string(rows()) +
                           "; copy the recording again");
  }
}

std::string RecordedTicks::try_read(std::uint64_t first, std::vector<ArmRecords>& rows) {
  rows.resize(TickLogReader::kChunkRows);
  chunk_.resize(TickLogReader::kChunkRows);
  std::size_t count = rows.size();
  std::string problem;
  for (std::size_t arm = 0; arm < logs_.size() && problem.empty(); ++arm) {
    count = std::min(count, logs_[arm].read(first, chunk_, problem));
    for (std::size_t i = 0; i < count; ++i) rows[i][arm] = chunk_[i];
  }
  rows.resize(problem.empty() ? count : 0);
  if (logs_.size() == 1) return problem;
  const auto apart =
      std::ranges::find_if(rows, [](const ArmRecords& row) { return row[0].tick != row[1].tick; });
  if (apart == rows.end()) return problem;
  problem = "tick " + std::to_string((*apart)[0].tick) + " of the first arm and tick " +
            std::to_string((*apart)[1].tick) +
            " of the second are in one row; copy the recording again";
  rows.clear();
  return problem;
}

void RecordedTicks::read(std::uint64_t first, std::vector<ArmRecords>& rows) {
  const std::string problem = try_read(first, rows);
  if (!problem.empty()) throw DamagedRecording(problem);
}

std::string RecordedTicks::cut_at_end() const {
  if (rows() >= counted()) return {};
  return "the log is cut after " + std::to_string(rows()) + " of " + std::to_string(counted()) +
         " rows";
}

ReplayResult replay_ticks(RecordedRun& run, RecordedTicks& log, Tick until,
                          const std::atomic<bool>& stop, const TickVisitor& visit) {
  ReplayResult result;
  result.last_tick = run.earlier_ticks();
  ReplayStep step(*run.servo, run.volume_chain);
  std::vector<ArmRecords> rows;
  for (std::uint64_t row = 0; row < log.rows();) {
    result.cut_short = log.try_read(row, rows);
    if (row == 0 && rows.empty()) throw DamagedRecording(result.cut_short);
    if (rows.empty()) return result;
    for (const ArmRecords& recorded : rows) {
      const Tick tick = recorded[0].tick;
      if (tick > until) return result;
      if (stop) {
        result.cut_short = "a signal stopped it";
        return result;
      }
      if (tick != result.last_tick + 1) {
        result.cut_short = gap_text(result.last_tick, tick);
        return result;
      }
      const ArmRecords replayed = step(recorded);
      ++*run.steps;
      ++result.ticks;
      result.last_tick = tick;
      for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
        result.output_hash[arm] = replayed[arm].output_hash;
      }
      if (!visit(recorded, replayed)) return result;
    }
    row += rows.size();
  }
  result.cut_short = log.cut_at_end();
  return result;
}

}  // namespace kerf
