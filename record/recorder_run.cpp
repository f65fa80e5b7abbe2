// SPDX-License-Identifier: Apache-2.0
#include "record/recorder_run.hpp"

#include <chrono>
#include <iostream>
#include <system_error>
#include <thread>

#include "record/manifest.hpp"
#include "record/record_error.hpp"
#include "record/recorder.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPollPeriod = std::chrono::milliseconds(5);
constexpr auto kSyncPeriod = std::chrono::milliseconds(200);
constexpr auto kConnectPeriod = std::chrono::milliseconds(50);

[[nodiscard]] SegmentConnection connect_within(const RecorderOptions& options,
                                               const std::atomic<bool>& stop) {
  static_cast<void>(segment_socket(options.name));  // a name that cannot be is not worth a wait
  const auto deadline = Clock::now() + std::chrono::duration<double>(options.wait_s);
  for (;;) {
    try {
      return connect_segment(options.name);
    } catch (const SegmentAbsent&) {
      if (stop || Clock::now() >= deadline) throw;
    }
    std::this_thread::sleep_for(kConnectPeriod);
  }
}

[[nodiscard]] bool is_final(Lifecycle lifecycle) noexcept {
  return lifecycle == Lifecycle::clean_end || lifecycle == Lifecycle::fault;
}

[[nodiscard]] std::string_view reason(Lifecycle lifecycle, bool stopped) noexcept {
  if (lifecycle == Lifecycle::clean_end) return "clean end";
  if (lifecycle == Lifecycle::fault) return "fault";
  return stopped ? "stopped" : "controller gone";
}

void write_report(const RecorderOptions& options, const Recorder& recorder, std::uint64_t rows,
                  std::string_view end_reason) {
  const Json report = {{"rows", rows},
                       {"lost_ticks", recorder.lost()},
                       {"gaps", recorder.gaps().size()},
                       {"missed_before_start", recorder.missed_before_start()},
                       {"largest_lag_ticks", recorder.largest_lag()},
                       {"end_reason", end_reason}};
  write_new_file(options.report, report.document());
}

}  // namespace

bool parse_options(int argc, char** argv, RecorderOptions& options) {
  CommandLine app("Logs every tick of a running kerf-controller into a folder.", "kerf-recorder",
                  KERF_VERSION);
  app.option("--name", options.name, "name of the controller").shows_default();
  app.option("--out", options.out, "folder for ticks.npy, scene.json, manifest.json").required();
  app.option("--wait", options.wait_s, "seconds to wait for the controller")
      .within(0, 86400)
      .shows_default();
  app.flag("--strict", options.strict, "exit 1 where ticks were lost");
  app.option("--report", options.report, "write the figures as JSON");
  return app.parse(argc, argv, std::cout);
}

int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop) {
  check_new_folder(options.out);
  check_outputs(recording_files(options.out), {{"--report", options.report, ".json"}});
  const SegmentConnection connection = connect_within(options, stop);
  const SegmentReader& reader = connection.reader();
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) {
    throw RecordError(options.out.string() + ": " + error.message() + "; choose another --out");
  }
  TickLogWriter log(options.out / kTickLogName);
  write_new_file(options.out / kSceneName, reader.info().scene_json);
  Recorder recorder(reader, log);
  write_manifest(options.out, reader.info(), recorder, 0, kStillRunning);

  std::uint64_t reported_lost = 0;
  auto next_sync = Clock::now() + kSyncPeriod;
  bool ended = false;
  while (!ended) {
    // Asked before the poll: what was published until then is recorded by it.
    ended = stop || is_final(reader.lifecycle()) || !connection.alive();
    const std::uint64_t got = recorder.poll();
    if (recorder.lost() != reported_lost) {
      std::cerr << "kerf-recorder: GAP: " << recorder.lost() - reported_lost
                << " ticks overwritten before they were read\n";
      reported_lost = recorder.lost();
    }
    if (Clock::now() >= next_sync) {
      log.sync();
      next_sync = Clock::now() + kSyncPeriod;
    }
    // A ring that fills fast (virtual time) is read again at once.
    if (!ended && got < reader.info().state_slots / 8) std::this_thread::sleep_for(kPollPeriod);
  }
  recorder.drain();
  log.sync();
  const std::string_view end_reason = reason(reader.lifecycle(), stop);
  write_manifest(options.out, reader.info(), recorder, log.rows(), end_reason);
  if (!options.report.empty()) write_report(options, recorder, log.rows(), end_reason);
  std::cout << "recorded " << log.rows() << " ticks, lost " << recorder.lost() << " (" << end_reason
            << ")\n";
  return options.strict && recorder.lost() != 0 ? 1 : 0;
}

}  // namespace kerf
