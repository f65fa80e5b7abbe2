// SPDX-License-Identifier: Apache-2.0
#include "record/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "record/log_clock.hpp"
#include "record/losses_of_rows.hpp"
#include "record/recording.hpp"
#include "record/starting_volumes.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/tick_lead.hpp"
#include "shared/segment/connection.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {

Recorder::Recorder(const SegmentReader& reader, TickSink& sink) : reader_(reader), sink_(sink) {
  next_ = oldest();
  // The segment of a run on another machine may hold less than its ring.
  while (read_next() == ReadState::overrun) ++next_;
  losses_.missed_before_start = next_;
}

Recorder::Recorder(const SegmentReader& reader, TickSink& sink, std::uint64_t next,
                   RecordLosses losses)
    : reader_(reader), sink_(sink), next_(next), losses_(std::move(losses)) {}

std::uint64_t Recorder::oldest() const noexcept {
  const std::uint64_t head = reader_.state_head();
  return head - std::min<std::uint64_t>(head, reader_.info().state_slots);
}

ReadState Recorder::read_next() noexcept {
  const ReadState state = reader_.state_at(next_, first_);
  if (state != ReadState::ok || reader_.info().arms == 1) return state;
  return reader_.state_at(next_, second_, 1);
}

std::uint64_t Recorder::poll() {
  const std::uint64_t head = reader_.state_head();
  std::uint64_t appended = 0;
  largest_lag_ = std::max(largest_lag_, head - std::min(next_, head));
  while (next_ < head) {
    const ReadState state = read_next();
    if (state == ReadState::busy || state == ReadState::not_yet) break;
    if (state == ReadState::ok) {
      if (reader_.info().arms > 1) sink_.append_second(second_);
      sink_.append(first_);
      ++appended;
      ++next_;
    } else {
      // The oldest record may be overwritten meanwhile: then the next round skips further.
      skip_to(std::max(next_ + 1, oldest()));
    }
  }
  sink_.flush();
  return appended;
}

void Recorder::drain() {
  poll();
  for (const std::uint64_t head = reader_.state_head(); next_ < head; poll()) skip_to(next_ + 1);
}

void Recorder::skip_to(std::uint64_t index) {
  const std::uint64_t count = index - next_;
  losses_.lost += count;
  std::vector<RecordGap>& gaps = losses_.gaps;
  if (!gaps.empty() && gaps.back().first_index + gaps.back().count == next_) {
    gaps.back().count += count;
  } else if (gaps.size() < kMaxGaps) {
    gaps.push_back({next_, count});
  }
  next_ = index;
}

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSyncPeriod = std::chrono::milliseconds(200);
constexpr auto kConnectPeriod = std::chrono::milliseconds(50);

[[nodiscard]] bool is_final(Lifecycle lifecycle) noexcept {
  return lifecycle == Lifecycle::clean_end || lifecycle == Lifecycle::fault;
}

}  // namespace

SegmentConnection connect_within(const RecorderOptions& options, const std::atomic<bool>& stop) {
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

bool has_ended(const SegmentConnection& connection) noexcept {
  return is_final(connection.reader().lifecycle()) || !connection.alive();
}

std::string_view end_reason(const SegmentReader& reader, bool stopped) noexcept {
  const Lifecycle lifecycle = reader.lifecycle();
  if (lifecycle == Lifecycle::clean_end) return "clean end";
  if (lifecycle == Lifecycle::fault) return kFault;
  return stopped ? "stopped" : "controller gone";
}

namespace {

/// What a recorder begins with: nothing, or the logs of the one before.
struct Beginning {
  TickLogWriter::Begin file = TickLogWriter::Begin::new_file;
  std::optional<std::uint64_t> next{};  ///< none: what the ring has
  RecordLosses losses{};
  std::uint64_t rows = 0;  ///< that the logs of all arms have; further ones are read again
  bool may_go_on = false;  ///< --resume
  std::uint64_t rows_a_part = UINT64_MAX;  ///< of each file of the log
};

/// The log of one arm, summed up as it grows.
struct SummedLog {
  SummedLog(const std::filesystem::path& path, const Beginning& begin, const SegmentInfo& info)
      : file(path, begin.file, begin.rows, begin.rows_a_part), summary(info) {}
  void append(const TickRecord& record) {
    file.append(record);
    summary.add(record);
  }

  TickLogWriter file;
  SummaryBuilder summary;
};

/// The logs of a recorder. Of each tick the second arm's row is written first: whenever the
/// recorder is killed, each row of ticks.npy has its row in ticks-2.npy.
class ArmLogs final : public TickSink {
 public:
  ArmLogs(const std::filesystem::path& folder, const Beginning& begin, const SegmentInfo& info) {
    // Likewise the file: where there is ticks.npy, there is ticks-2.npy.
    if (info.arms > 1) second_.emplace(folder / tick_log_name(1), of_second(folder, begin), info);
    first_.emplace(folder / tick_log_name(0), begin, info);
  }
  void append_second(const TickRecord& record) override { second_->append(record); }
  void append(const TickRecord& record) override { first_->append(record); }
  void flush() override {
    if (second_) second_->file.flush();
    first_->file.flush();
  }
  void sync() {
    if (second_) second_->file.sync();
    first_->file.sync();
  }
  [[nodiscard]] std::uint64_t rows() const noexcept { return first_->file.rows(); }
  /// Of each arm.
  [[nodiscard]] ArmSummaries summaries(const RecordLosses& losses, std::string_view reason) const {
    ArmSummaries out{first_->summary.result(losses, reason)};
    if (second_) out.push_back(second_->summary.result(losses, reason));
    return out;
  }

 private:
  /// A recorder may have been killed between both files.
  static Beginning of_second(const std::filesystem::path& folder, Beginning begin) {
    const bool is_there = std::filesystem::exists(folder / tick_log_name(1));
    const bool goes_on = begin.file == TickLogWriter::Begin::after_last || begin.may_go_on;
    begin.file =
        is_there && goes_on ? TickLogWriter::Begin::after_last : TickLogWriter::Begin::new_file;
    return begin;
  }

  std::optional<SummedLog> first_, second_;
};

/// The losses before and between the first `rows` rows of a log.
[[nodiscard]] RecordLosses losses_in(TickLogReader& log, std::uint64_t rows, std::uint64_t first) {
  LossesOfRows losses(first);
  std::vector<TickRecord> chunk(TickLogReader::kChunkRows);
  while (losses.rows() < rows) {
    const std::uint64_t left = std::min<std::uint64_t>(rows - losses.rows(), chunk.size());
    const std::size_t count = log.read(losses.rows(), std::span(chunk).first(left));
    for (const TickRecord& record : std::span(chunk).first(count)) losses.add(record);
  }
  return losses.as_losses(Recorder::kMaxGaps);
}

[[nodiscard]] Beginning beginning_in(const RecorderOptions& options, const SegmentReader& reader) {
  Beginning begin{.may_go_on = options.resume};
  if (!options.split.empty()) {
    begin.rows_a_part = static_cast<std::uint64_t>(
        std::llround(split_s(options.split) * 1e9 / reader.info().tick_ns));
  }
  if (!options.resume || !std::filesystem::exists(options.out / kTickLogName)) return begin;
  begin.file = TickLogWriter::Begin::after_last;
  // Killed between the file's first byte and its manifest: without rows.
  constexpr std::uintmax_t kOneRow = kTickLogHeaderBytes + sizeof(TickRecord);
  std::error_code none;
  const bool is_empty = std::filesystem::file_size(options.out / kTickLogName, none) < kOneRow;
  if (is_empty && !std::filesystem::exists(options.out / kManifestName)) return begin;
  const Manifest manifest = read_manifest(options.out);
  const std::string session = hex64(reader.info().session_id);
  if (manifest.session_id != session) {
    throw RecordError((options.out / kManifestName).string() + ": is of run " +
                      one_line(manifest.session_id) + ", and run " + session +
                      " goes on; choose another --out");
  }
  TickLogReader log(options.out / kTickLogName);
  begin.losses = manifest.losses;
  begin.next = manifest.losses.missed_before_start;
  begin.rows = log.rows();
  if (reader.info().arms > 1) {
    begin.rows = std::min(begin.rows, TickLogReader(options.out / tick_log_name(1)).rows());
  }
  if (begin.rows > 0) {
    TickRecord last;
    static_cast<void>(log.read(begin.rows - 1, std::span(&last, 1)));
    begin.next = index_of(last) + 1;
    // Killed between rows behind a gap and the manifest with the gap; or it has gaps behind the
    // last row, which are read again.
    if (*begin.next - begin.rows != begin.losses.missed_before_start + begin.losses.lost) {
      begin.losses = losses_in(log, begin.rows, begin.losses.missed_before_start);
    }
  }
  return begin;
}

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
      if (const std::uint64_t more = recorder_.losses().lost - lost; more > 0) {
        std::cerr << "kerf-recorder: GAP: " << more << " ticks overwritten before they were read\n";
        manifest(kStillRunning);
      }
      clock_.follow();
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
    ArmSummaries summaries;
    // On a full disk, rows were summed up that are not in the log.
    if (whole_ && is_of_whole_log(reason)) summaries = logs_.summaries(recorder_.losses(), reason);
    write_manifest(out_, reader().info(), recorder_.losses(), logs_.rows(), reason, summaries);
  }
  [[nodiscard]] std::uint64_t rows() const noexcept { return logs_.rows(); }
  [[nodiscard]] const Recorder& recorder() const noexcept { return recorder_; }

 private:
  [[nodiscard]] const SegmentReader& reader() const noexcept { return connection_.reader(); }

  std::filesystem::path out_;
  const SegmentConnection& connection_;
  ArmLogs logs_;
  ClockWriter clock_;
  Recorder recorder_;
  bool whole_;  ///< all rows went through `logs_`
  std::optional<TickLead> lead_;
  StartingVolumes volumes_;
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
  const SegmentConnection connection = connect_within(options, stop);
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
  } catch (const RecordError&) {
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
  std::cout << "recorded " << recording.rows() << " ticks, lost " << recorder.losses().lost << " ("
            << reason << ")\n";
  return options.strict && recorder.losses().lost != 0 ? 1 : 0;
}

}  // namespace kerf
