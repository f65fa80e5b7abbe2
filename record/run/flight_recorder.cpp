// SPDX-License-Identifier: Apache-2.0
#include "record/run/flight_recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <future>
#include <iostream>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "record/log_clock.hpp"
#include "record/recorder.hpp"
#include "record/recording.hpp"
#include "record/run/flight_notice.hpp"
#include "record/run/run_start.hpp"
#include "record/run/tick_window.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/tick_lead.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {
namespace {

volatile std::sig_atomic_t g_asked = 0;

void catch_requests() noexcept {
  struct sigaction action {};
  action.sa_handler = [](int) { g_asked = 1; };
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
}

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
        start_(options.name, options.out / run_folder(options.name), reader().info().arms),
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
    const std::filesystem::path folder = out_ / flight_folder(event);
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
  const SegmentConnection connection = connect_within(options.name, options.wait_s, stop);
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

}  // namespace kerf
