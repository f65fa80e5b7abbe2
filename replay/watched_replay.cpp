// SPDX-License-Identifier: Apache-2.0
#include "replay/watched_replay.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <thread>
#include <utility>

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include "replay/own_laws.hpp"
#include "replay/watched_run.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/server.hpp"

namespace kerf {
namespace {

/// What a key or a reader's command asks for.
struct Request {
  enum class Kind { none, pause, step, faster, slower, forward, back, go, quit };
  Kind kind = Kind::none;
  Tick tick = 0;  ///< of `go`
};

/// Single keys of standard input; a terminal is without echo and lines as long as this lives.
class Keys {
 public:
  Keys() {
    if (tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios now = before_;
    now.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    is_terminal_ = tcsetattr(STDIN_FILENO, TCSANOW, &now) == 0;
  }
  ~Keys() {
    if (is_terminal_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;

  /// The next request; never waits.
  [[nodiscard]] Request next() {
    for (char key = 0; read_key(key);) {
      if (key >= '0' && key <= '9') {
        constexpr Tick kMost = std::numeric_limits<Tick>::max() / 20;
        number_ = std::min(number_, kMost) * 10 + static_cast<Tick>(key - '0');
        continue;
      }
      const Tick number = std::exchange(number_, 0);
      using enum Request::Kind;
      if (key == ' ') return {pause};
      if (key == '.') return {step};
      if (key == '+') return {faster};
      if (key == '-') return {slower};
      if (key == 'f') return {forward};
      if (key == 'b') return {back};
      if (key == 'g') return {go, number};
      if (key == 'q') return {quit};
    }
    return {};
  }

 private:
  [[nodiscard]] bool read_key(char& key) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (is_closed_ || poll(&input, 1, 0) <= 0) return false;
    const ssize_t got = read(STDIN_FILENO, &key, 1);
    is_closed_ = got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN);
    return got == 1;
  }

  termios before_{};
  bool is_terminal_ = false, is_closed_ = false;
  Tick number_ = 0;
};

Request request_of(const SegmentCommand& command, bool is_paused) {
  using enum Request::Kind;
  switch (command.kind) {
    case CommandKind::hold:
      return {(command.argument != 0) == is_paused ? none : pause};
    case CommandKind::reset:
      return {go, 1};
    case CommandKind::undo:
      return {back};
    case CommandKind::redo:
      return {forward};
    case CommandKind::select_tool:  // of the recording
    case CommandKind::mark:
      return {};
  }
  return {};
}

/// The clock of the replay: how many ticks are due.
class Pace {
 public:
  explicit Pace(std::uint32_t tick_ns) : tick_ns_(tick_ns) {}

  void start(std::int64_t now_ns) {
    began_ns_ = now_ns;
    stepped_ = 0;
  }
  void change(double factor, std::int64_t now_ns) {
    constexpr double kMost = 64;
    speed_ = std::clamp(speed_ * factor, 1 / kMost, kMost);
    start(now_ns);
  }
  [[nodiscard]] std::uint64_t due(std::int64_t now_ns) {
    const double ticks = static_cast<double>(now_ns - began_ns_) * speed_ / tick_ns_;
    const auto all = static_cast<std::uint64_t>(std::max(ticks, 0.0));
    return all - std::min(std::exchange(stepped_, std::max(all, stepped_)), all);
  }
  [[nodiscard]] double speed() const noexcept { return speed_; }

 private:
  std::uint32_t tick_ns_;
  double speed_ = 1;
  std::int64_t began_ns_ = 0;
  std::uint64_t stepped_ = 0;
};

class Watch {
 public:
  Watch(WatchedRun& run, SegmentWriter& segment, std::uint32_t tick_ns)
      : run_(run), segment_(segment), tick_ns_(tick_ns), pace_(tick_ns) {}

  /// Goes to `from` first, if that is not 0. `turns` grows while it waits, too.
  void run(SegmentServer& server, Tick from, const std::atomic<bool>& stop,
           std::atomic<std::uint64_t>& turns) {
    Keys keys;
    pace_.start(monotonic_ns());
    if (from != 0) go(from);
    print_state();
    for (; !stop; ++turns) {
      Request request = keys.next();
      if (const auto command = server.take_command();
          command && request.kind == Request::Kind::none) {
        request = request_of(*command, is_paused_);
      }
      if (request.kind == Request::Kind::quit) return;
      if (request.kind != Request::Kind::none) answer(request);
      if (goal_ != 0) {
        go_on();
        continue;
      }
      if (!is_paused_) step_due(stop);
      std::this_thread::sleep_for(std::chrono::milliseconds(is_paused_ ? 10 : 1));
    }
  }

 private:
  /// In parts of a batch: keys, commands and a signal are heard in between.
  void go(Tick tick) {
    goal_ = std::max(std::min(tick, run_.last_tick()), run_.first_tick());
    run_.begin_go(goal_);
  }
  void go_on() {
    constexpr int kBatch = 256;
    if (!run_.go_on(kBatch)) return;
    goal_ = 0;
    pace_.start(monotonic_ns());
    print_state();
  }

  /// For `kBusyNs` at most. A machine that is behind then does not make up for it: else each batch
  /// would be longer than the one before.
  void step_due(const std::atomic<bool>& stop) {
    constexpr std::int64_t kBusyNs = 10'000'000;
    const std::int64_t began = monotonic_ns();
    for (std::uint64_t due = pace_.due(began); due > 0 && !is_paused_ && !stop; --due) {
      if (!run_.step()) pause(true);
      if (monotonic_ns() - began > kBusyNs) return pace_.start(monotonic_ns());
    }
  }

  void answer(const Request& request) {
    const auto second = static_cast<Tick>(1e9 / tick_ns_);
    const Tick now = goal_ != 0 ? goal_ : run_.tick();
    switch (request.kind) {
      case Request::Kind::pause:
        pause(!is_paused_);
        return;
      case Request::Kind::step:
        pause(true, false);
        if (goal_ != 0) return go(now + 1);
        run_.step();
        break;
      case Request::Kind::faster:
        pace_.change(2, monotonic_ns());
        break;
      case Request::Kind::slower:
        pace_.change(0.5, monotonic_ns());
        break;
      case Request::Kind::forward:
        return go(now + second);
      case Request::Kind::back:
        return go(now > second ? now - second : 1);
      case Request::Kind::go:
        return go(request.tick);
      case Request::Kind::none:
      case Request::Kind::quit:
        return;
    }
    pace_.start(monotonic_ns());
    print_state();
  }

  void pause(bool pauses, bool prints = true) {
    is_paused_ = pauses;
    segment_.set_lifecycle(pauses ? Lifecycle::hold : Lifecycle::run);
    pace_.start(monotonic_ns());
    if (prints) print_state();
  }

  /// On the way to a tick it prints nothing: there it will.
  void print_state() const {
    if (goal_ != 0) return;
    std::printf("tick %llu of %llu (%.3f s), speed %g%s\n",
                static_cast<unsigned long long>(run_.tick()),
                static_cast<unsigned long long>(run_.last_tick()),
                static_cast<double>(run_.tick()) * tick_ns_ * 1e-9, pace_.speed(),
                is_paused_ ? ", paused" : "");
    std::fflush(stdout);
  }

  WatchedRun& run_;
  SegmentWriter& segment_;
  std::uint32_t tick_ns_;
  Pace pace_;
  Tick goal_ = 0;  ///< the tick that `go_on` goes to; 0: none
  bool is_paused_ = false;
};

}  // namespace

int watch_replay(const ReplayOptions& options, RecordedTicks& log, const std::atomic<bool>& stop) {
  RecordedRun run = load_tried_run(options, true);
  const StepGuard guard(run);
  step_earlier_ticks(run, options.folder);
  WatchedRun watched(run, log,
                     {.until = options.until, .compares = false, .snapshot_bytes = kSnapshotBytes});
  const std::uint64_t rows = watched.last_tick();
  SegmentServer server(options.watch, *run.segment,
                       {.tools = static_cast<std::uint32_t>(run.scene.tools.size()),
                        .arms = static_cast<std::uint32_t>(run.servo->arms())});
  run.segment->set_lifecycle(Lifecycle::run);
  std::printf(
      "kerf visualizer --name %s shows it; space pauses, . steps, + and - change the speed, "
      "f and b go a second on and back, 1600g goes to tick 1600, q quits\n",
      options.watch.c_str());
  const Tick from = std::max(options.from, watched.first_tick());
  Watch(watched, *run.segment, run.manifest.tick_ns)
      .run(server, from > 1 ? from : 0, stop, *run.steps);
  run.segment->set_lifecycle(Lifecycle::clean_end);
  if (watched.last_tick() == rows) return 0;
  const unsigned long long next = watched.last_tick() + 1;
  std::printf("tick %llu is not in the recording; it was shown until there\n", next);
  return 1;
}

}  // namespace kerf
