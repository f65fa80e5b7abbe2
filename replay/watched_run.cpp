// SPDX-License-Identifier: Apache-2.0
#include "replay/watched_run.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

WatchedRun::WatchedRun(RecordedRun& run, RecordedTicks& log, const Options& options)
    : run_(run),
      log_(log),
      publisher_(*run.segment, *run.servo),
      records_(*run.servo, run.volume_chain),
      compares_(options.compares) {
  tick_ = compared_ = before_log_ = run.earlier_ticks();
  last_tick_ = std::min<Tick>(before_log_ + log.rows(), options.until);  // if the log has no gap
  const auto& first = snapshots_[before_log_] = run.servo->keep();
  const auto fit =
      std::clamp<std::size_t>(options.snapshot_bytes / first->bytes(), 1, kMostSnapshots);
  ticks_a_snapshot_ = last_tick_ / fit + 1;
}

bool WatchedRun::step() {
  const ArmRecords* const recorded = next_row();
  if (recorded == nullptr) return false;
  step_servo(*recorded);
  auto outputs = outputs_;
  for (ServoOutput& output : outputs) {
    output.undoable = output.redoable = true;  // the keys of both go through the recording
  }
  const std::int64_t now = monotonic_ns();
  published_ = std::max(published_ + 1, tick_);
  const auto reports = reports_of(*recorded, *run_.servo);
  publisher_.publish(
      published_, of_arms(reports, *run_.servo), commands_of(of_arms(*recorded, *run_.servo)),
      of_arms(std::as_const(outputs), *run_.servo), {.start_ns = now, .heartbeat_ns = now});
  return true;
}

void WatchedRun::rest() {
  run_.segment->begin_tick(++published_);
  run_.segment->end_tick(static_cast<std::uint64_t>(monotonic_ns()));
}

void WatchedRun::begin_go(Tick tick) {
  goal_ = std::clamp<Tick>(tick, before_log_ + 1, std::max(last_tick_, before_log_ + 1));
  const auto& [at, kept] = *std::prev(snapshots_.upper_bound(goal_ - 1));
  if (goal_ > tick_ && at <= tick_) return;
  run_.servo->restore(*kept);
  tick_ = at;
}

bool WatchedRun::go_on(int ticks) {
  for (int i = 0; tick_ + 1 < goal_; ++i) {
    if (i == ticks) return false;
    const ArmRecords* const recorded = next_row();
    if (recorded == nullptr) break;
    step_servo(*recorded);
  }
  show_volumes();
  step();
  return true;
}

const ArmRecords* WatchedRun::next_row() {
  const std::uint64_t at = tick_ - before_log_;
  if (at == log_.rows()) cut_short_ = log_.cut_at_end();
  if (tick_ >= last_tick_) return nullptr;
  if (at < first_row_ || at >= first_row_ + rows_.size()) {
    first_row_ = at;
    if (std::string problem = log_.try_read(first_row_, rows_); rows_.empty()) {
      end_here(std::move(problem));
      return nullptr;
    }
  }
  const ArmRecords& row = rows_[static_cast<std::size_t>(at - first_row_)];
  if (row[0].tick == tick_ + 1) return &row;
  end_here(gap_text(tick_, row[0].tick));
  return nullptr;
}

void WatchedRun::end_here(std::string why) {
  last_tick_ = tick_;
  cut_short_ = std::move(why);
}

void WatchedRun::step_servo(const ArmRecords& recorded) {
  if (tick_ % ticks_a_snapshot_ == 0 && !snapshots_.contains(tick_)) {
    snapshots_[tick_] = run_.servo->keep();
  }
  outputs_ = give(*run_.servo, recorded);
  ++*run_.steps;
  ++tick_;
  if (!compares_ || difference_ || tick_ != compared_ + 1) return;
  difference_ = first_difference(recorded, records_.of(recorded, outputs_), run_.servo->arms());
  compared_ = tick_;
}

void WatchedRun::show_volumes() {
  SegmentWriter& segment = *run_.segment;
  segment.begin_tick(++published_);
  for (std::size_t v = 0; v < run_.scene.volumes.size(); ++v) {
    const VoxelGrid& grid = run_.servo->grid(v);
    const VoxelBox all{{0, 0, 0}, {grid.nx, grid.ny, grid.nz}};
    if (run_.servo->first_density(v).empty()) continue;  // nothing cuts it
    segment.publish_box(v, run_.servo->density(v), all, 0, DirtyCause::load);
  }
  segment.end_tick(static_cast<std::uint64_t>(monotonic_ns()));
  while (segment.waiting_bricks() > 0) rest();
}

}  // namespace kerf
