// SPDX-License-Identifier: Apache-2.0
#include "record/flight_recorder.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <future>
#include <iostream>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "record/earlier_inputs.hpp"
#include "record/log_clock.hpp"
#include "record/recording.hpp"
#include "record/starting_volumes.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/tick_lead.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/log_columns.hpp"

namespace kerf {
namespace {

std::string fault_word(std::uint32_t fault) {
  for (const LogCode& code : log_faults()) {
    if (code.value == fault) return std::string(code.name);
  }
  return "fault-" + std::to_string(fault);
}

}  // namespace

void TickWindow::look_for_fault(const TickRecord& record, std::size_t arm) {
  const std::uint32_t before = std::exchange(faults_[arm], record.fault);
  if (record.fault == 0 || record.fault == before) return;
  add_event((arm == 0 ? "" : "arm-2-") + fault_word(record.fault), record.tick);
}

void TickWindow::add_event(std::string reason, Tick tick) {
  if (events_.size() < kMostKept) events_.push_back({std::move(reason), tick});
}

void TickWindow::append_second(const TickRecord& record) {
  second_[end_ % second_.size()] = record;
  look_for_fault(record, 1);
}

void TickWindow::append(const TickRecord& record) {
  rows_[end_++ % rows_.size()] = record;
  look_for_fault(record, 0);
  if ((record.command & kCommandKind) == kCommandMark) add_event("mark", record.tick);
}

TickWindow::Event TickWindow::take_event() {
  if (events_.empty()) return {};
  Event event = std::move(events_.front());
  events_.pop_front();
  return event;
}

namespace {

constexpr const char* kSuffix = ".flight";
constexpr const char* kRunFolder = ".run-";

/// Where a flight recorder says that it runs, and into which folder it writes.
class FlightNotice {
 public:
  FlightNotice(const std::string& name, const std::filesystem::path& out)
      : lock_(name + kSuffix), path_(file_of(name)) {
    write_new_file(path_, std::filesystem::absolute(out).string());
  }
  ~FlightNotice() {
    std::error_code gone;
    std::filesystem::remove(path_, gone);
  }
  FlightNotice(const FlightNotice&) = delete;
  FlightNotice& operator=(const FlightNotice&) = delete;

  static std::filesystem::path file_of(const std::string& name) {
    return segment_folder() + "/" + name + kSuffix;
  }

 private:
  NameLock lock_;
  std::filesystem::path path_;
};

volatile std::sig_atomic_t g_asked = 0;

void catch_requests() noexcept {
  struct sigaction action {};
  action.sa_handler = [](int) { g_asked = 1; };
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
}

/// A folder that sorts by time: TICK-REASON.
std::string folder_name(const TickWindow::Event& event) {
  std::array<char, 24> tick{};
  std::snprintf(tick.data(), tick.size(), "%012llu", static_cast<unsigned long long>(event.tick));
  return std::string(tick.data()) + "-" + event.reason;
}

/// The start of the run, for recordings of its end: volumes and inputs, in a hidden folder that
/// lasts as long as the flight recorder.
class RunStart {
 public:
  RunStart(const std::string& name, const std::filesystem::path& out, std::size_t arms)
      : folder_(new_folder(out / (kRunFolder + name))), volumes_(name, folder_), inputs_(folder_) {
    if (arms > 1) second_inputs_.emplace(folder_, 1);
  }
  ~RunStart() {
    static_cast<void>(volumes_.finish());
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  RunStart(const RunStart&) = delete;
  RunStart& operator=(const RunStart&) = delete;

  void add_second(const TickRecord& record) { second_inputs_->add(record); }
  void add(const TickRecord& record) { inputs_.add(record); }

  /// Whether the volumes are on the disk, or will not be.
  [[nodiscard]] bool has_volumes() const noexcept { return volumes_.done(); }

  /// Puts the inputs up to tick `last` into the recording in `folder`. Returns why it cannot be
  /// replayed; empty: it can. Throws FileError.
  [[nodiscard]] std::string keep_inputs(const std::filesystem::path& folder, Tick last) {
    std::string problem = inputs_.keep(folder, last);
    if (problem.empty() && second_inputs_) problem = second_inputs_->keep(folder, last);
    return problem.empty() ? "" : "cannot be replayed: " + problem;
  }

  /// The same with the volumes, after `has_volumes`. Returns what a replay lacks.
  [[nodiscard]] std::string keep_volumes(const std::filesystem::path& folder) {
    std::error_code fault;
    const std::filesystem::path from = folder_ / kVolumesName;
    for (std::filesystem::directory_iterator file(from, fault), end; !fault && file != end;
         file.increment(fault)) {
      std::filesystem::create_directory(folder / kVolumesName, fault);
      link_file(file->path(), folder / kVolumesName / file->path().filename());
    }
    std::string lacks;
    for (const std::string& problem : volumes_.finish()) lacks += "; " + problem;
    return lacks.empty() ? "" : lacks.substr(2);
  }

 private:
  static std::filesystem::path new_folder(const std::filesystem::path& folder) {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);  // of one that was killed
    make_recording_folder(folder);
    return folder;
  }

  std::filesystem::path folder_;
  StartingVolumes volumes_;
  EarlierInputs inputs_;
  std::optional<EarlierInputs> second_inputs_;
};

class FlightRecorder final : TickSink {
 public:
  FlightRecorder(const RecorderOptions& options, const SegmentConnection& connection)
      : name_(options.name),
        out_(options.out),
        connection_(connection),
        capacity_(static_cast<std::uint64_t>(
            std::ceil(options.flight_s * 1e9 / reader().info().tick_ns))),
        window_(capacity_ + reader().info().state_slots, reader().info().arms),
        watch_(reader().info().start_ns == 0),
        start_(options.name, options.out, reader().info().arms),
        recorder_(reader(), *this) {
    if (!options.lead.empty()) lead_.emplace(options.lead);
  }

  void run(const std::atomic<bool>& stop) {
    bool ended = false;
    while (!ended) {
      ended = stop || has_ended(connection_);
      const std::uint64_t got = follow();
      // One that comes before the first tick waits for it.
      if (window_.end() > 0 && std::exchange(g_asked, 0) != 0) keep({"signal", newest()});
      keep_next();
      if (!ended && got < reader().info().state_slots / 8) std::this_thread::sleep_for(kPollPeriod);
    }
    recorder_.drain();
    while (keep_next()) {
    }
    const std::string_view reason = end_reason(reader(), stop);
    if (reason == kFault) keep({"end", newest()});
    if (reason == "controller gone") keep({"gone", newest()});
  }

  [[nodiscard]] int kept() const noexcept { return kept_; }
  /// Why a recording was not kept, the last one; empty: all were.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }

 private:
  void append_second(const TickRecord& record) override {
    window_.append_second(record);
    start_.add_second(record);
  }
  void append(const TickRecord& record) override {
    window_.append(record);
    start_.add(record);
  }

  [[nodiscard]] const SegmentReader& reader() const noexcept { return connection_.reader(); }
  [[nodiscard]] Tick newest() const noexcept {
    return window_.end() == 0 ? 0 : window_[window_.end() - 1].tick;
  }

  /// Takes what is new into the window, and lets a controller in lock-step go on. Returns the
  /// ticks.
  std::uint64_t follow() {
    if (lead_ && start_.has_volumes()) {
      lead_->allow(recorder_.next() + reader().info().state_slots / 2);
    }
    if (const auto pair = watch_.take(read_clocks())) keep_pair(*pair);
    return recorder_.poll();
  }

  /// Keeps the pairs from the last one before the window on.
  void keep_pair(const ClockPair& pair) {
    const auto window_ns = static_cast<std::int64_t>(window_.capacity()) * reader().info().tick_ns;
    pairs_.push_back(pair);
    while (pairs_.size() > 1 && pairs_[1].monotonic_ns < pair.monotonic_ns - window_ns) {
      pairs_.erase(pairs_.begin());
    }
  }

  /// Follows the run while `slow`, which waits for the disk, has a thread of its own.
  template <class Slow>
  void follow_during(const Slow& slow) {
    std::future<void> done = std::async(std::launch::async, slow);
    while (done.wait_for(kPollPeriod) != std::future_status::ready) follow();
    done.get();
  }

  /// Whether there was an event to keep.
  bool keep_next() {
    const TickWindow::Event event = window_.take_event();
    if (event.reason.empty()) return false;
    keep(event);
    return true;
  }

  void keep(const TickWindow::Event& event) {
    if (window_.end() == 0) return;
    const std::filesystem::path folder = out_ / folder_name(event);
    if (folder == last_kept_) return;  // asked for twice in one tick
    if (std::filesystem::exists(folder)) {
      fail(folder.string() +
           ": not kept, a recording of another run has that name; choose another --out");
      return;
    }
    if (kept_ >= kMostKept) {
      std::cerr << "kerf-recorder: " << folder.string() << ": not kept, " << kMostKept
                << " recordings are; start the flight recorder again\n";
      return;
    }
    // Beside its name until it is whole.
    const std::filesystem::path partial = out_ / ("." + name_ + "-" + folder.filename().string());
    std::error_code ignored;
    std::filesystem::remove_all(partial, ignored);
    try {
      const std::string lacks = write(partial, event);
      std::filesystem::rename(partial, folder);
      ++kept_;
      last_kept_ = folder;
      std::cout << folder.string() << ": kept" << (lacks.empty() ? "" : "; " + lacks) << std::endl;
    } catch (const std::runtime_error& error) {
      std::filesystem::remove_all(partial, ignored);
      fail(error.what());
    }
  }

  void fail(std::string line) {
    failure_ = std::move(line);
    std::cerr << "kerf-recorder: " << failure_ << '\n';
  }

  /// The ticks until now, with all that a replay needs. Goes on polling: the window has room for
  /// what comes while it is written. Returns what a replay lacks; empty: nothing.
  [[nodiscard]] std::string write(const std::filesystem::path& folder,
                                  const TickWindow::Event& event) {
    make_recording_folder(folder);
    const std::uint64_t end = window_.end();
    std::uint64_t row = end - std::min(end, capacity_);
    row = std::max(row, window_.first());
    const std::uint64_t missed = index_of(window_[row]);
    std::string lacks = start_.keep_inputs(folder, missed);
    SummaryBuilder summary(reader().info()), second_summary(reader().info());
    TickLogWriter log(folder / tick_log_name(0));
    std::optional<TickLogWriter> second;
    if (reader().info().arms > 1) second.emplace(folder / tick_log_name(1));
    constexpr std::uint64_t kRowsAPoll = 256;
    while (row < end) {
      row = std::max(row, window_.first());  // a disk that is slower than the run
      for (const std::uint64_t next = std::min(end, row + kRowsAPoll); row < next; ++row) {
        log.append(window_[row]);
        summary.add(window_[row]);
        if (!second) continue;
        second->append(window_.second(row));
        second_summary.add(window_.second(row));
      }
      log.flush();
      if (second) second->flush();
      follow();
    }
    while (!start_.has_volumes()) {  // in the first seconds of a run
      follow();
      std::this_thread::sleep_for(kPollPeriod);
    }
    if (lacks.empty()) lacks = start_.keep_volumes(folder);
    RecordLosses losses{.missed_before_start = missed};
    const std::string reason = "kept at tick " + std::to_string(event.tick) + ": " + event.reason;
    ArmSummaries figures{summary.result(losses, reason)};
    if (second) figures.push_back(second_summary.result(losses, reason));
    losses.lost = figures.front().lost_ticks;
    const std::vector<ClockPair> pairs = pairs_;  // `follow` adds to them meanwhile
    follow_during([&] {
      log.sync();
      if (second) second->sync();
      write_new_file(folder / kSceneName, reader().info().scene_json);
      write_clock(folder, pairs);
      write_manifest(folder, reader().info(), losses, log.rows(), reason, figures);
    });
    return lacks;
  }

  std::string name_;  ///< of the controller
  std::filesystem::path out_, last_kept_;
  const SegmentConnection& connection_;
  std::uint64_t capacity_;  ///< of a recording
  TickWindow window_;
  ClockWatch watch_;
  std::vector<ClockPair> pairs_;
  RunStart start_;
  Recorder recorder_;
  std::optional<TickLead> lead_;
  int kept_ = 0;
  std::string failure_;
};

}  // namespace

int run_flight_recorder(const RecorderOptions& options, const std::atomic<bool>& stop) {
  catch_requests();  // else one that comes too early stops the recorder
  check_new_folder(options.out);
  const SegmentConnection connection = connect_within(options, stop);
  make_recording_folder(options.out);
  const FlightNotice notice(options.name, options.out);
  FlightRecorder recorder(options, connection);
  const SegmentInfo& info = connection.reader().info();
  const double bytes =
      options.flight_s * 1e9 / info.tick_ns * static_cast<double>(info.arms * sizeof(TickRecord));
  std::cout << "the last " << options.flight_s << " s are in memory, " << std::lround(bytes / 1e6)
            << " MB" << std::endl;
  recorder.run(stop);
  std::cout << recorder.kept() << " recordings kept in " << options.out.string() << std::endl;
  if (recorder.failure().empty()) return 0;
  std::cerr << "kerf-recorder: " << recorder.failure() << '\n';  // again: it may be hours ago
  return 1;
}

namespace {

/// Bytes of the recordings in `out` that are not whole yet: their folders are hidden. They grow
/// while a flight recorder writes; those that a killed one has left do not.
std::uintmax_t unfinished_bytes(const std::filesystem::path& out) {
  std::uintmax_t bytes = 0;
  std::error_code fault;
  for (std::filesystem::directory_iterator folder(out, fault), end; !fault && folder != end;
       folder.increment(fault)) {
    const std::string name = folder->path().filename().string();
    if (!name.starts_with(".") || name.starts_with(kRunFolder)) continue;
    std::error_code gone;
    for (std::filesystem::directory_iterator file(folder->path(), gone); !gone && file != end;
         file.increment(gone)) {
      std::error_code unknown;
      const std::uintmax_t size = file->file_size(unknown);
      if (!unknown) bytes += size;
    }
  }
  return bytes;
}

}  // namespace

std::filesystem::path grab(const std::string& name) {
  SegmentConnection connection = connect_segment(name);
  std::ifstream notice(FlightNotice::file_of(name));
  std::string out;
  if (!std::getline(notice, out)) {
    throw SegmentError(
        "--name " + name +
        ": no flight recorder runs; start kerf-recorder --flight 60 --out DIR first");
  }
  const Reply reply = connection.send({.kind = CommandKind::mark});
  if (reply.status != ReplyStatus::accepted) {
    throw SegmentError("--name " + name + ": the controller took no mark; try again");
  }
  // The tick of the mark is in the record in which the command was applied.
  using Clock = std::chrono::steady_clock;
  constexpr auto kPatience = std::chrono::seconds(10);
  auto deadline = Clock::now() + kPatience;
  const SegmentReader& reader = connection.reader();
  std::uint64_t next = reader.state_head();
  next -= std::min<std::uint64_t>(next, reader.info().state_slots / 2);
  std::filesystem::path kept;
  std::uintmax_t written = unfinished_bytes(out);
  while (Clock::now() < deadline) {
    TickRecord record;
    for (; kept.empty() && reader.state_at(next, record) == ReadState::ok; ++next) {
      const bool marked = (record.command & kCommandKind) == kCommandMark;
      if (!marked || record.last_command != reply.index) continue;
      kept = std::filesystem::path(out) / folder_name({"mark", record.tick});
    }
    if (kept.empty() && reader.state_at(next, record) == ReadState::overrun) ++next;
    if (!kept.empty() && std::filesystem::exists(kept)) return kept;
    // It may still write the recording of an earlier mark.
    const std::uintmax_t before = std::exchange(written, unfinished_bytes(out));
    if (written != before) deadline = Clock::now() + kPatience;
    std::this_thread::sleep_for(kPollPeriod);
  }
  throw SegmentError(out + ": the flight recorder kept nothing within 10 s; see its messages");
}

}  // namespace kerf
