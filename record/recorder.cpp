// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <system_error>
#include <thread>

#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/segment/connection.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"

namespace kerf {

Recorder::Recorder(const SegmentReader& reader, TickLogWriter& log) : reader_(reader), log_(log) {
  next_ = oldest();
  // The segment of a run on another machine may hold less than its ring.
  TickRecord record;
  while (reader.state_at(next_, record) == ReadState::overrun) ++next_;
  missed_before_start_ = next_;
}

std::uint64_t Recorder::oldest() const noexcept {
  const std::uint64_t head = reader_.state_head();
  return head - std::min<std::uint64_t>(head, reader_.info().state_slots);
}

std::uint64_t Recorder::poll() {
  const std::uint64_t head = reader_.state_head();
  const std::uint64_t before = log_.rows();
  largest_lag_ = std::max(largest_lag_, head - std::min(next_, head));
  TickRecord record;
  while (next_ < head) {
    const ReadState state = reader_.state_at(next_, record);
    if (state == ReadState::busy || state == ReadState::not_yet) break;
    if (state == ReadState::ok) {
      log_.append(record);
      ++next_;
    } else {
      // The oldest record may be overwritten meanwhile: then the next round skips further.
      skip_to(std::max(next_ + 1, oldest()));
    }
  }
  log_.flush();
  return log_.rows() - before;
}

void Recorder::drain() {
  poll();
  for (const std::uint64_t head = reader_.state_head(); next_ < head; poll()) skip_to(next_ + 1);
}

void Recorder::skip_to(std::uint64_t index) {
  const std::uint64_t count = index - next_;
  lost_ += count;
  if (!gaps_.empty() && gaps_.back().first_index + gaps_.back().count == next_) {
    gaps_.back().count += count;
  } else if (gaps_.size() < kMaxGaps) {
    gaps_.push_back({next_, count});
  }
  next_ = index;
}

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPollPeriod = std::chrono::milliseconds(5);
constexpr auto kSyncPeriod = std::chrono::milliseconds(200);
constexpr auto kConnectPeriod = std::chrono::milliseconds(50);

[[nodiscard]] SegmentConnection connect_within(const RecorderOptions& options,
                                               const std::atomic<bool>& stop) {
  static_cast<void>(segment_socket(options.name));  // refuses an impossible name without a wait
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
  if (lifecycle == Lifecycle::fault) return kFault;
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
  const double bytes_per_s = 1e9 / static_cast<double>(reader.info().tick_ns) * sizeof(TickRecord);
  std::cout << options.out.string() << " grows by " << std::lround(60 * bytes_per_s / 1e6)
            << " MB a minute" << std::endl;
  write_manifest(options.out, reader.info(), recorder, 0, kStillRunning);

  const auto record_all = [&] {
    std::uint64_t reported_lost = 0;
    auto next_sync = Clock::now() + kSyncPeriod;
    bool ended = false;
    while (!ended) {
      // Checked before the poll, which records all that was published until then.
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
  };
  try {
    record_all();
  } catch (const RecordError&) {
    // The rows so far stay readable. The manifest of a full disk may stay that of the beginning.
    try {
      write_manifest(options.out, reader.info(), recorder, log.rows(), kNoRoom);
    } catch (const FileError&) {  // NOLINT(bugprone-empty-catch): the first failure is reported
    }
    throw;
  }
  const std::string_view end_reason = reason(reader.lifecycle(), stop);
  write_manifest(options.out, reader.info(), recorder, log.rows(), end_reason);
  if (!options.report.empty()) write_report(options, recorder, log.rows(), end_reason);
  std::cout << "recorded " << log.rows() << " ticks, lost " << recorder.lost() << " (" << end_reason
            << ")\n";
  return options.strict && recorder.lost() != 0 ? 1 : 0;
}

}  // namespace kerf
