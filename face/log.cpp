// SPDX-License-Identifier: Apache-2.0
#include "kerf/log.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <exception>
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
  SegmentSpec spec = segment_spec(loaded.scene, json, loaded.config_hash);
  spec.build_id = std::string("libkerf ") + KERF_VERSION;
  const SegmentWriter writer = SegmentWriter::create(spec, true);
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
      : info(info_of(scene.loaded())),
        folder(new_recording(where)),
        logs(folder, Beginning{}, info) {
    write_new_file(folder / kSceneName, info.scene_json);
    for (const SceneVolume& volume : scene.loaded().scene.volumes) {
      const VolumeImage& image = volume.image;
      write_starting_volume(folder, hex64(kerf::volume_hash(image.density, image.labels)),
                            image.grid, image.density, image.labels);
    }
    write_manifest(folder, info, {}, 0, kStillRunning);
  }
  ~Parts() {
    try {
      close();
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): `close` reports it
    }
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  void add(std::span<const TickRecord> arms) {
    const auto refuse = [&](const std::string& why) { throw Error(folder.string() + ": " + why); };
    if (closed) refuse("is closed; write another recording");
    if (arms.size() != info.arms) {
      refuse("a tick of " + std::to_string(arms.size()) + " arms, and the scene has " +
             std::to_string(info.arms) + "; add all of them");
    }
    const std::uint64_t next = logs.rows() + 1;
    if (arms.front().tick != next) {
      refuse("tick " + std::to_string(arms.front().tick) + ", and tick " + std::to_string(next) +
             " comes next; add each tick of one run once, from the first on");
    }
    if (arms.size() > 1) logs.append_second(arms[1]);
    logs.append(arms[0]);
  }

  void close() {
    if (closed) return;
    logs.flush();
    logs.sync();
    write_manifest(folder, info, {}, logs.rows(), kCleanEnd, logs.summaries({}, kCleanEnd));
    closed = true;
  }

  SegmentInfo info;
  std::filesystem::path folder;
  ArmLogs logs;
  bool closed = false;
};

LogWriter::LogWriter(const std::filesystem::path& folder, const Scene& scene)
    : parts_(or_error([&] { return std::make_unique<Parts>(folder, scene); })) {}
LogWriter::~LogWriter() = default;
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
  if (!visit) return;
  std::vector<TickRecord> rows(TickLogReader::kChunkRows);
  for (std::uint64_t row = 0; row < parts_->log(arm).rows();) {
    const std::size_t count = read(row, rows, arm);
    if (count == 0) return;
    for (const TickRecord& record : std::span(rows).first(count)) visit(record);
    row += count;
  }
}

ReplayOutcome Log::replay(const Settings& settings, const Visit& visit) const {
  std::exception_ptr of_visitor;
  const auto show = [&](const TickRecord& recorded, const TickRecord& replayed) {
    try {
      if (visit) visit(recorded, replayed);
    } catch (...) {
      of_visitor = std::current_exception();
    }
    return of_visitor == nullptr;
  };
  ReplayOutcome outcome = or_error([&] {
    RecordedTicks log(parts_->folder, parts_->manifest.arms);
    RecordedRun run = load_run(parts_->folder, {.settings = settings}, kernels_named({}));
    step_earlier_ticks(run, parts_->folder);
    std::optional<DifferentTick> first;
    const std::atomic<bool> stop{false};
    const ReplayResult result = replay_ticks(
        run, log, UINT64_MAX, stop, [&](const ArmRecords& recorded, const ArmRecords& replayed) {
          if (!show(recorded[0], replayed[0])) return false;
          if (!first) first = first_difference(recorded, replayed, run.servo->arms());
          return !first || !settings.empty();
        });
    ReplayOutcome found{.ticks = result.ticks,
                        .output_hash = result.output_hash[0],
                        .difference = {},
                        .cut_short = result.cut_short};
    if (first) {
      found.difference = {.tick = first->tick,
                          .arm = first->arm,
                          .stage = std::string(first->at.stage),
                          .field = first->at.field,
                          .recorded = first->at.recorded,
                          .replayed = first->at.replayed};
    }
    return found;
  });
  if (of_visitor) std::rethrow_exception(of_visitor);
  return outcome;
}

}  // namespace kerf
