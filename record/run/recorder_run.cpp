// SPDX-License-Identifier: Apache-2.0
#include "record/run/recorder_run.hpp"

#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "record/log_clock.hpp"
#include "record/manifest_seal.hpp"
#include "record/recorder.hpp"
#include "record/recording.hpp"
#include "record/run/arm_logs.hpp"
#include "record/starting_volumes.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/tick_lead.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSyncPeriod = std::chrono::milliseconds(200);

/// One recording, from the first poll to the manifest of its end.
class Recording {
 public:
  Recording(const RecorderOptions& options, const SegmentConnection& connection,
            const Beginning& begin)
      : out_(options.out),
        connection_(connection),
        logs_(out_, begin, reader().info()),
        clock_(out_, reader().info().start_ns == 0),
        recorder_(begin.next ? Recorder(reader(), logs_, *begin.next, begin.losses)
                             : Recorder(reader(), logs_)),
        whole_(logs_.rows() == 0),
        volumes_(options.name, options.out) {
    if (!options.lead.empty()) lead_.emplace(options.lead);
    write_new_file(out_ / kSceneName, reader().info().scene_json);
    manifest(kStillRunning);
  }

  void run(const std::atomic<bool>& stop) {
    auto next_sync = Clock::now() + kSyncPeriod;
    bool ended = false;
    while (!ended) {
      // Checked before the poll, which records all that was published until then.
      ended = stop || has_ended(connection_);
      // Half of the ring: the controller goes on while this reads, and overwrites nothing unread.
      if (lead_ && volumes_.copied())
        lead_->allow(recorder_.next() + reader().info().state_slots / 2);
      const std::uint64_t lost = recorder_.losses().lost;
      const std::uint64_t got = recorder_.poll();
      const std::uint64_t more = recorder_.losses().lost - lost;
      if (more > 0) {
        std::cerr << "kerf-recorder: GAP: " << ticks_text(more)
                  << " overwritten before they were read\n";
      }
      if (const bool is_dated = clock_.follow(); is_dated || more > 0 || has_new_files()) {
        manifest(kStillRunning);
      }
      if (Clock::now() >= next_sync) {
        logs_.sync();
        next_sync = Clock::now() + kSyncPeriod;
      }
      // A ring that fills fast (virtual time) is read again at once.
      if (!ended && got < reader().info().state_slots / 8) std::this_thread::sleep_for(kPollPeriod);
    }
    recorder_.drain();
    logs_.sync();
    for (const std::string& problem : volumes_.finish()) {
      if (recorder_.losses().missed_before_start > 0) continue;  // cannot be replayed anyhow
      std::cerr << "kerf-recorder: " << problem << '\n';
    }
  }

  void manifest(std::string_view reason) const {
    if (!is_of_whole_log(reason)) {
      const Json files = files_so_far();
      const std::uint64_t rows = reason == kStillRunning ? logs_.synced() : logs_.rows();
      write_manifest(out_, reader().info(), recorder_.losses(), rows, reason, {}, &files);
      return;
    }
    ArmSummaries summaries;
    // On a full disk, rows were summed up that are not in the log.
    if (whole_) summaries = logs_.summaries(recorder_.losses(), reason);
    write_manifest(out_, reader().info(), recorder_.losses(), logs_.rows(), reason, summaries);
  }
  [[nodiscard]] std::uint64_t rows() const noexcept { return logs_.rows(); }
  [[nodiscard]] const Recorder& recorder() const noexcept { return recorder_; }

 private:
  /// Whether the manifest lacks files, or first rows, that have begun since it was written.
  [[nodiscard]] bool has_new_files() {
    const bool has_volumes = volumes_.done();
    const std::size_t parts = logs_.parts();
    const bool has_rows = logs_.synced() > 0;
    return std::exchange(lists_volumes_, has_volumes) != has_volumes ||
           std::exchange(lists_rows_, has_rows) != has_rows ||
           std::exchange(listed_parts_, parts) != parts;
  }

  /// The checksums of the files that are whole. That of clock.npy is of its rows until now.
  [[nodiscard]] Json files_so_far() const {
    Json files = Json::Members{};
    for (const std::string_view name : {kClockName, kSceneName}) {
      files[name] = crc32_of_file(out_ / name);
    }
    if (!volumes_.done()) return files;
    for (const auto& [name, checksum] : volumes_.checksums().members()) files[name] = checksum;
    return files;
  }

  [[nodiscard]] const SegmentReader& reader() const noexcept { return connection_.reader(); }

  std::filesystem::path out_;
  const SegmentConnection& connection_;
  ArmLogs logs_;
  ClockWriter clock_;
  Recorder recorder_;
  bool whole_;  ///< all rows went through `logs_`
  std::optional<TickLead> lead_;
  StartingVolumes volumes_;
  bool lists_volumes_ = false, lists_rows_ = false;  ///< in the manifest
  std::size_t listed_parts_ = 1;
};

void write_report(const std::filesystem::path& path, const Recorder& recorder, std::uint64_t rows,
                  std::string_view reason) {
  const RecordLosses& losses = recorder.losses();
  const Json report = {{"rows", rows},
                       {"lost_ticks", losses.lost},
                       {"gaps", losses.gaps.size()},
                       {"missed_before_start", losses.missed_before_start},
                       {"largest_lag_ticks", recorder.largest_lag()},
                       {"end_reason", reason}};
  write_new_file(path, report.document());
}

}  // namespace

int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop) {
  check_new_folder(options.out);
  check_outputs(recording_files(options.out), {{"--report", options.report, ".json"}});
  const SegmentConnection connection = connect_within(options.name, options.wait_s, stop);
  const SegmentReader& reader = connection.reader();
  make_recording_folder(options.out);
  const Beginning begin = beginning_in(options, reader);
  Recording recording(options, connection, begin);
  const double bytes_per_s = 1e9 / static_cast<double>(reader.info().tick_ns) *
                             static_cast<double>(reader.info().arms * sizeof(TickRecord));
  std::cout << options.out.string() << (begin.next ? " goes on, and" : "") << " grows by "
            << std::lround(60 * bytes_per_s / 1e6) << " MB a minute"
            << (options.split.empty() ? "" : ", in a new file each " + options.split) << std::endl;
  try {
    recording.run(stop);
  } catch (const std::runtime_error&) {  // RecordError or FileError
    // The rows so far stay readable. The manifest of a full disk may stay that of the beginning.
    try {
      recording.manifest(kNoRoom);
    } catch (const FileError&) {  // NOLINT(bugprone-empty-catch): the first failure is reported
    }
    throw;
  }
  const std::string_view reason = end_reason(reader, stop);
  recording.manifest(reason);
  const Recorder& recorder = recording.recorder();
  if (!options.report.empty()) write_report(options.report, recorder, recording.rows(), reason);
  std::cout << "recorded " << ticks_text(recording.rows()) << ", lost " << recorder.losses().lost
            << " (" << reason << ")\n";
  return options.strict && recorder.losses().lost != 0 ? 1 : 0;
}

}  // namespace kerf
