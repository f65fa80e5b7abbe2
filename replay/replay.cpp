// SPDX-License-Identifier: Apache-2.0
#include "replay/replay.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "controller/loop/publisher.hpp"
#include "record/check/recording_check.hpp"
#include "record/earlier_inputs.hpp"
#include "record/log_clock.hpp"
#include "record/recording.hpp"
#include "record/starting_volumes.hpp"
#include "record/tick_log_writer.hpp"
#include "replay/compared_runs.hpp"
#include "replay/own_laws.hpp"
#include "replay/replayed_ticks.hpp"
#include "replay/watched_replay.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// The log of a replay, and beside it manifest and scene: a recording like any other.
class ReplayLog {
 public:
  /// Before the first tick: it keeps the volumes of `run` as they are now.
  ReplayLog(const std::filesystem::path& out, const std::filesystem::path& from,
            const RecordedRun& run)
      : out_(new_folder(out, from, run)), from_(from) {
    for (std::size_t arm = 0; arm < run.servo->arms(); ++arm) {
      logs_.push_back(std::make_unique<TickLogWriter>(out_ / tick_log_name(arm)));
      summaries_.emplace_back(run.manifest.tick_ns, voxel_mm3_of(run.scene));
    }
    for (std::size_t v = 0; v < run.scene.volumes.size(); ++v) {
      const std::vector<Label>& labels = run.scene.volumes[v].image.labels;
      const std::span<const Density> density = run.servo->density(v);
      const VoxelGrid& grid = run.servo->grid(v);
      write_starting_volume(out, hex64(volume_hash(density, labels)), grid, density, labels);
      volumes_.push_back({{"size_vox", std::array{grid.nx, grid.ny, grid.nz}},
                          {"spacing_mm", run.scene.volumes[v].image.spacing_mm},
                          {"initial_hash", hex64(density_hash(density))}});
    }
  }

  void append(const ArmRecords& records) {
    for (std::size_t arm = logs_.size(); arm-- > 0;) {
      logs_[arm]->append(records[arm]);
      summaries_[arm].add(records[arm]);
    }
  }

  void close(const RecordedRun& run, const ReplayResult& result) {
    for (std::size_t arm = logs_.size(); arm-- > 0;) logs_[arm]->sync();
    Json manifest = Json::parse(manifest_text(from_));
    manifest["replay_of"] = from_.string();
    manifest["config_hash"] = hex64(fnv1a(run.canonical));
    manifest["tick_ns"] = run.manifest.tick_ns;
    manifest["volumes"] = volumes_;
    const RecordLosses losses{.missed_before_start = run.earlier_ticks()};
    ArmSummaries figures;
    for (const SummaryBuilder& builder : summaries_) {
      figures.push_back(builder.result(losses, kReplayed));
    }
    write_new_file(out_ / kSceneName, run.scene_json);
    write_with_end(out_, std::move(manifest), losses, result.ticks, kReplayed, figures);
  }

 private:
  static std::filesystem::path new_folder(const std::filesystem::path& out,
                                          const std::filesystem::path& from,
                                          const RecordedRun& run) {
    check_new_folder(out);
    make_recording_folder(out);
    copy_inputs(from, out, run.earlier_ticks());
    if (run.manifest.has_clock) write_clock(out, read_clock(from, true).pairs());
    return out;
  }

  static constexpr std::string_view kReplayed = "replayed";

  std::filesystem::path out_, from_;
  Json volumes_ = Json::List{};                       ///< as the manifest has them
  std::vector<std::unique_ptr<TickLogWriter>> logs_;  ///< by arm
  std::vector<SummaryBuilder> summaries_;             ///< by arm
};

std::uint64_t volume_hash_of(const RecordedRun& run) {
  return hash_of_volumes(*run.servo, run.scene.volumes.size());
}

void print_end(const ReplayResult& result, const RecordedRun& run, Tick from, bool changed,
               double wall_s) {
  const double run_s =
      static_cast<double>(run.earlier_ticks() + result.ticks) * run.manifest.tick_ns * 1e-9;
  if (run.earlier_ticks() > 0) {
    std::printf("%s before the log, by their inputs\n", ticks_text(run.earlier_ticks()).c_str());
  }
  if (!result.difference && !changed) {
    const Tick first = std::max<Tick>(from, run.earlier_ticks() + 1);
    const std::uint64_t compared = result.last_tick + 1 - std::min(first, result.last_tick + 1);
    std::printf("%s, %s to the last bit\n", ticks_text(compared).c_str(),
                compared == 1 ? "equal" : "each equal");
  }
  for (std::size_t arm = 0; arm < run.servo->arms(); ++arm) {
    std::printf("output hash  %s%s\n", hex64(result.output_hash[arm]).c_str(),
                arm == 0 ? "" : " of the second arm");
  }
  std::printf("volume hash  %s\n%.1f s of the run in %.2f s\n", hex64(volume_hash_of(run)).c_str(),
              run_s, wall_s);
}

Json json_of(const ReplayResult& result, const RecordedRun& run) {
  Json report = {{"ticks", result.ticks},
                 {"last_tick", result.last_tick},
                 {"output_hash", hex64(result.output_hash[0])},
                 {"volume_hash", hex64(volume_hash_of(run))},
                 {"cut_short", result.cut_short}};
  if (run.servo->arms() > 1) report["second_output_hash"] = hex64(result.output_hash[1]);
  report["difference"] = nullptr;
  if (result.difference) {
    const auto& [tick, arm, at] = *result.difference;
    report["difference"] =
        Json{{"tick", tick},      {"arm", arm + 1},          {"stage", at.stage},
             {"field", at.field}, {"recorded", at.recorded}, {"replayed", at.replayed}};
  }
  return report;
}

/// Refuses a range in which nothing would be compared.
void check_range(const ReplayOptions& options, RecordedTicks& log) {
  if (options.from > options.until) {
    throw RecordError("--from " + std::to_string(options.from) + " lies behind --until " +
                      std::to_string(options.until) + "; no tick would be compared");
  }
  std::vector<ArmRecords> rows;
  log.read(0, rows);
  const Tick first = rows.front()[0].tick;
  if (options.until < first) {
    throw RecordError("--until " + std::to_string(options.until) +
                      ": the recording begins at tick " + std::to_string(first) +
                      "; give a later one");
  }
  if (!log.try_read(log.rows() - 1, rows).empty()) return;  // the replay stops before it
  const Tick last = rows.front()[0].tick;
  if (options.from > last) {
    throw RecordError("--from " + std::to_string(options.from) + ": the recording ends at tick " +
                      std::to_string(last) + "; give an earlier one");
  }
}

}  // namespace

namespace {

/// The replay of a recording that was checked. Returns the exit code, without what the check found.
int replay_checked(const ReplayOptions& options, const CheckedRecording& checked,
                   const std::atomic<bool>& stop) {
  RecordedTicks log(options.folder, checked.manifest.arms);
  if (log.rows() == 0) {
    throw RecordError((options.folder / kTickLogName).string() + ": 0 rows; nothing to replay");
  }
  check_range(options, log);
  if (!options.watch.empty()) return watch_replay(options, log, stop);
  RecordedRun run = load_tried_run(options);
  std::optional<ReplayLog> copy;
  if (!options.out.empty()) copy.emplace(options.out, options.folder, run);
  ComparedRuns compared(log.rows(), run.manifest, voxel_mm3_of(run.scene));
  const bool changed = !options.changes.none();

  std::optional<DifferentTick> difference;
  const auto began = std::chrono::steady_clock::now();
  std::optional<StepGuard> guard(run);
  step_earlier_ticks(run, options.folder);
  const auto visit = [&](const ArmRecords& recorded, const ArmRecords& replayed) {
    if (copy) copy->append(replayed);
    compared.add(recorded, replayed);
    if (difference || recorded[0].tick < options.from) return true;
    difference = first_difference(recorded, replayed, run.servo->arms());
    return changed || !difference;
  };
  ReplayResult result = replay_ticks(run, log, options.until, stop, visit);
  guard.reset();
  result.difference = difference;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - began;

  if (copy) copy->close(run, result);
  if (changed) std::fputs(compared.text().c_str(), stdout);
  if (difference) std::printf("%s\n", text_of(*difference, run.manifest.tick_ns).c_str());
  print_end(result, run, options.from, changed, wall.count());
  if (!result.cut_short.empty()) std::cout << "stopped: " << result.cut_short << '\n';
  if (!options.plot.empty()) compared.plot(options.plot);
  if (!options.report.empty()) write_new_file(options.report, json_of(result, run).document());
  return (difference && !changed) || !result.cut_short.empty() ? 1 : 0;
}

}  // namespace

int run_replay(const ReplayOptions& options, const std::atomic<bool>& stop) {
  check_outputs(recording_files(options.folder),
                {{"--report", options.report, ".json"}, {"--plot", options.plot, ".svg"}});
  const CheckedRecording checked = check_recording(options.folder, {.until = options.until});
  for (const std::string& note : checked.notes) std::cerr << "kerf-replay: " << note << '\n';
  if (checked.problems.empty()) return replay_checked(options, checked, stop);
  try {
    static_cast<void>(replay_checked(options, checked, stop));
  } catch (const std::exception& error) {  // of the scene's reader, too
    throw DamagedRecording(error.what());
  }
  // What contradicts itself in the recording is reported behind what the replay found.
  for (const std::string& problem : checked.problems) {
    std::cerr << "kerf-replay: " << problem << '\n';
  }
  return 1;
}

}  // namespace kerf
