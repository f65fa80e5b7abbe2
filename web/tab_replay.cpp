// SPDX-License-Identifier: Apache-2.0
#include "web/tab_replay.hpp"

#include <cstdint>
#include <optional>
#include <utility>

#include "controller/loop/publisher.hpp"
#include "record/manifest.hpp"
#include "record/tick_log.hpp"
#include "replay/recorded_run.hpp"
#include "replay/replayed_ticks.hpp"
#include "replay/watched_run.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "web/absent/parser_line.hpp"

namespace kerf::web {
namespace {

/// A tab has less memory than a machine: with fewer snapshots it steps more ticks on a way back.
constexpr std::size_t kTabSnapshotBytes = std::size_t{128} << 20;

Manifest manifest_in(const std::filesystem::path& folder) {
  const ParserLine line(not_a_manifest(folder));
  return read_manifest(folder);
}

RecordedRun run_in(const std::filesystem::path& folder) {
  const ParserLine line(scene_without_source(folder));
  return load_run(folder, {}, kernels_named(""), true);
}

RecordedTicks log_in(const std::filesystem::path& folder, std::size_t arms) {
  RecordedTicks log(folder, arms);
  if (log.rows() == 0) {
    throw RecordError((folder / kTickLogName).string() + ": 0 rows; nothing to replay");
  }
  std::vector<ArmRecords> rows;
  log.read(0, rows);  // at least the first one is sound
  return log;
}

}  // namespace

struct TabReplay::State {
  explicit State(const std::filesystem::path& folder)
      : log(log_in(folder, manifest_in(folder).arms)),
        run(run_in(folder)),
        viewer(*run.segment),
        earlier(std::in_place, run, folder) {
    run.segment->set_lifecycle(Lifecycle::run);
  }

  void begin_ticks() {
    earlier.reset();
    shown.emplace(run, log,
                  WatchedRun::Options{
                      .until = UINT64_MAX, .compares = true, .snapshot_bytes = kTabSnapshotBytes});
    shown->begin_go(shown->first_tick());
    goal = shown->first_tick();
  }

  RecordedTicks log;
  RecordedRun run;
  TabViewer viewer;
  std::optional<EarlierTicks> earlier;  ///< until they are stepped
  std::optional<WatchedRun> shown;      ///< from then on
  Tick goal = 0;                        ///< the tick that `prepare` goes to; 0: none
  bool stopped = false;
};

TabReplay::TabReplay(const std::filesystem::path& folder)
    : state_(std::make_unique<State>(folder)) {}
TabReplay::~TabReplay() = default;

bool TabReplay::prepare(int ticks) {
  State& s = *state_;
  for (int i = 0; s.earlier && i < ticks; ++i) {
    if (!s.earlier->step()) s.begin_ticks();
  }
  if (s.earlier) return false;
  const bool had_difference = s.shown->difference().has_value();
  if (s.goal != 0 && s.shown->go_on(ticks)) s.goal = 0;
  s.stopped = s.shown->difference().has_value() != had_difference;
  return s.goal == 0;
}

int TabReplay::step(int ticks) {
  WatchedRun& shown = *state_->shown;
  const bool had_difference = shown.difference().has_value();
  int made = 0;
  bool differs = false;
  while (made < ticks && !differs && shown.step()) {
    ++made;
    differs = shown.difference().has_value() != had_difference;
  }
  state_->stopped = differs || made < ticks;
  return made;
}

bool TabReplay::stopped() const noexcept {
  return state_->stopped;
}

void TabReplay::go(Tick tick) {
  State& s = *state_;
  if (!s.shown) return;
  s.shown->begin_go(tick);
  s.goal = tick;
}

TabViewer& TabReplay::viewer() noexcept {
  return state_->viewer;
}
void TabReplay::slot(bool ended) {
  if (state_->shown) state_->shown->rest();
  state_->viewer.slot(ended);
}

int TabReplay::rate_hz() const noexcept {
  return static_cast<int>(kNsPerSecond / state_->run.manifest.tick_ns);
}

std::string TabReplay::facts() const {
  const State& s = *state_;
  const Tick before = s.run.earlier_ticks();
  Json facts = {{"tick_ns", s.run.manifest.tick_ns},
                {"rate_hz", rate_hz()},
                {"first_tick", before + 1},
                {"earlier_tick", s.earlier ? s.earlier->done() : before},
                {"goal", s.goal}};
  if (!s.shown) return facts.canonical();
  const WatchedRun& shown = *s.shown;
  facts["tick"] = shown.tick();
  facts["last_tick"] = shown.last_tick();
  facts["compared"] = shown.compared();
  facts["difference"] = nullptr;
  if (shown.difference()) {
    facts["difference"] = text_of(*shown.difference(), s.run.manifest.tick_ns);
    facts["difference_tick"] = shown.difference()->tick;
  }
  facts["cut_short"] = shown.cut_short();
  facts["output_hash"] = hex64(shown.outputs()[0].output_hash);
  if (s.run.servo->arms() > 1) {
    facts["second_output_hash"] = hex64(shown.outputs()[1].output_hash);
  }
  return facts.canonical();
}

std::string TabReplay::volume_hash() const {
  return hex64(hash_of_volumes(*state_->run.servo, state_->run.scene.volumes.size()));
}

}  // namespace kerf::web
