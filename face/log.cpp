// SPDX-License-Identifier: Apache-2.0
#include "kerf/log.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include "controller/loop/publisher.hpp"
#include "face/loaded.hpp"
#include "record/check/recording_check.hpp"
#include "record/manifest.hpp"
#include "record/recording.hpp"
#include "record/run/arm_logs.hpp"
#include "record/scene_facts.hpp"
#include "record/starting_volumes.hpp"
#include "record/tick_log.hpp"
#include "replay/replayed_ticks.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

/// What a recorder knows of a run: the constant part of its segment.
SegmentInfo info_of(const Scene::Loaded& loaded) {
  const std::string json = json_with_source(Json::parse(loaded.json), loaded.scene, loaded.source);
  const SegmentWriter writer =
      SegmentWriter::create(segment_spec(loaded.scene, json, loaded.config_hash), true);
  return SegmentReader::map(writer.fd()).info();
}

std::filesystem::path new_recording(const std::filesystem::path& folder) {
  check_new_folder(folder);
  make_recording_folder(folder);
  return folder;
}

}  // namespace

struct LogWriter::Parts {
  Parts(const std::filesystem::path& where, const Scene& scene)
      : folder(new_recording(where)),
        info(info_of(scene.loaded())),
        logs(folder, Beginning{}, info) {
    write_new_file(folder / kSceneName, info.scene_json);
    for (const SceneVolume& volume : scene.loaded().scene.volumes) {
      const VolumeImage& image = volume.image;
      write_starting_volume(folder, hex64(kerf::volume_hash(image.density, image.labels)),
                            image.grid, image.density, image.labels);
    }
    write_manifest(folder, info, {}, 0, kStillRunning);
  }

  void add(std::span<const TickRecord> arms) {
    if (arms.size() != info.arms) {
      throw Error(folder.string() + ": a tick of " + std::to_string(arms.size()) +
                  " arms, and the scene has " + std::to_string(info.arms) + "; add all of them");
    }
    const std::uint64_t next = logs.rows() + 1;
    if (arms.front().tick != next) {
      throw Error(folder.string() + ": tick " + std::to_string(arms.front().tick) + ", and tick " +
                  std::to_string(next) +
                  " comes next; begin before the first step, add each tick once");
    }
    if (arms.size() > 1) logs.append_second(arms[1]);
    logs.append(arms[0]);
  }

  void close() {
    if (std::exchange(closed, true)) return;
    constexpr std::string_view kEnd = "clean end";
    logs.flush();
    logs.sync();
    write_manifest(folder, info, {}, logs.rows(), kEnd, logs.summaries({}, kEnd));
  }

  std::filesystem::path folder;
  SegmentInfo info;
  ArmLogs logs;
  bool closed = false;
};

LogWriter::LogWriter(const std::filesystem::path& folder, const Scene& scene)
    : parts_(or_error([&] { return std::make_unique<Parts>(folder, scene); })) {}

LogWriter::~LogWriter() {
  if (!parts_) return;
  try {
    parts_->close();
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): who wants to know calls close
  }
}
LogWriter::LogWriter(LogWriter&&) noexcept = default;
LogWriter& LogWriter::operator=(LogWriter&&) noexcept = default;

void LogWriter::add(const TickRecord& tick) {
  add(std::span(&tick, 1));
}

void LogWriter::add(std::span<const TickRecord> arms) {
  or_error([&] { parts_->add(arms); });
}

void LogWriter::close() {
  or_error([&] { parts_->close(); });
}

struct Log::Parts {
  explicit Parts(const std::filesystem::path& where)
      : folder(where), manifest(read_facts(where)), logs(open_logs(where, manifest.arms)) {}

  [[nodiscard]] TickLogReader& log(std::size_t arm) {
    if (arm < logs.size()) return logs[arm];
    throw Error(folder.string() + ": arm " + std::to_string(arm) + ": the recording has " +
                std::to_string(logs.size()) + "; they count from 0");
  }

  std::filesystem::path folder;
  Manifest manifest;
  std::vector<TickLogReader> logs;
};

Log::Log(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}
Log::~Log() = default;
Log::Log(Log&&) noexcept = default;
Log& Log::operator=(Log&&) noexcept = default;

Log Log::open(const std::filesystem::path& folder) {
  return or_error([&] { return Log(std::make_unique<Parts>(folder)); });
}

std::uint64_t Log::rows() const noexcept {
  return parts_->logs.front().rows();
}

std::size_t Log::arms() const noexcept {
  return parts_->logs.size();
}

double Log::period_s() const noexcept {
  return 1e-9 * parts_->manifest.tick_ns;
}

std::vector<std::string> Log::check() const {
  return or_error([&] { return check_recording(parts_->folder, {}, CheckDepth::files).problems; });
}

std::size_t Log::read(std::uint64_t first, std::span<TickRecord> rows, std::size_t arm) {
  return or_error([&] { return parts_->log(arm).read(first, rows); });
}

void Log::for_each(const std::function<void(const TickRecord&)>& visit, std::size_t arm) {
  or_error([&] { parts_->log(arm).for_each(visit); });
}

ReplayOutcome Log::replay(const Settings& settings, const Visit& visit) const {
  return or_error([&] {
    RecordedTicks log(parts_->folder, parts_->manifest.arms);
    RecordedRun run = load_run(parts_->folder, {.settings = settings}, kernels_named({}));
    step_earlier_ticks(run, parts_->folder);
    std::optional<DifferentTick> first;
    const std::atomic<bool> stop{false};
    const ReplayResult result = replay_ticks(
        run, log, UINT64_MAX, stop, [&](const ArmRecords& recorded, const ArmRecords& replayed) {
          if (visit) visit(recorded[0], replayed[0]);
          if (!first) first = first_difference(recorded, replayed, run.servo->arms());
          return !first || !settings.empty();
        });
    ReplayOutcome outcome{.ticks = result.ticks,
                          .output_hash = result.output_hash[0],
                          .difference = {},
                          .cut_short = result.cut_short};
    if (first) {
      outcome.difference = {.tick = first->tick,
                            .arm = first->arm,
                            .stage = std::string(first->at.stage),
                            .field = first->at.field,
                            .recorded = first->at.recorded,
                            .replayed = first->at.replayed};
    }
    return outcome;
  });
}

}  // namespace kerf
