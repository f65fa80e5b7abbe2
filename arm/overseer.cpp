// SPDX-License-Identifier: Apache-2.0
#include "arm/overseer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string_view>

#include <unistd.h>

#include "arm/arm_error.hpp"
#include "arm/guard.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

// For the signal handler.
std::atomic<ArmPageAdapter*> page_of_crash{nullptr};
const char* program_of_crash = "";
WatchWords words_of_crash;

/// A line of text that a signal handler may compose: it does not allocate.
class Line {
 public:
  Line& operator<<(std::string_view text) noexcept {
    const std::size_t size = std::min(text.size(), bytes_.size() - 1 - size_);
    std::copy_n(text.begin(), size, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += size;
    return *this;
  }
  Line& operator<<(int number) noexcept {
    std::array<char, 16> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    return *this << std::string_view(digits.data(), end);
  }
  [[nodiscard]] const char* text() const noexcept { return bytes_.data(); }

 private:
  std::array<char, 256> bytes_{};
  std::size_t size_ = 0;
};

void print(const char* program, const char* reason, const char* text) noexcept {
  const char* const parts[] = {program, ": ", reason, reason[0] != 0 ? "; " : "", text, "\n"};
  for (const char* const part : parts) {
    if (write(STDERR_FILENO, part, std::strlen(part)) < 0) return;
  }
}

[[noreturn]] void end_by_the_library(const Line& line) {
  if (ArmPageAdapter* page = page_of_crash) page->set_state(ArmState::failed, line.text());
  print(program_of_crash, "", line.text());
  end_is_told();
  _exit(2);
}

void on_crash(int number) {
  const char* const name = sigabbrev_np(number);
  Line line;
  line << words_of_crash.crashed << " has crashed (SIG" << (name ? name : "?") << ")"
       << words_of_crash.cure;
  end_by_the_library(line);
}

/// Only a library can cause this: kerf-arm itself ends by _exit().
void on_exit_of_library(int code, void*) {
  if (page_of_crash == nullptr) return;
  Line line;
  line << words_of_crash.watched << " has ended the program by exit(" << code << ")"
       << words_of_crash.cure;
  end_by_the_library(line);
}

void on_quick_exit_of_library() {
  if (page_of_crash == nullptr) return;
  Line line;
  line << words_of_crash.watched << " has ended the program by quick_exit()" << words_of_crash.cure;
  end_by_the_library(line);
}

/// Exit handlers run in reverse order. So this is called again after the library may have added its
/// own, to print the line before those run.
void catch_exits() noexcept {
  static_cast<void>(on_exit(on_exit_of_library, nullptr));
  static_cast<void>(std::at_quick_exit(on_quick_exit_of_library));
}

/// Handlers are of the whole process, so the library may have set its own.
void take_handlers(const sigset_t& ends) noexcept {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) {
    if (sigismember(&ends, number) == 1) ask_by(number);
  }
  struct sigaction action {};
  action.sa_handler = on_crash;
  action.sa_flags = SA_ONSTACK;
  for (const int number : crash_signals()) {
    if (number != SIGQUIT) sigaction(number, &action, nullptr);
  }
}

}  // namespace

Overseer::Overseer(const char* program, ArmPageAdapter& page, ArmExchange& exchange, Limits limits,
                   WatchWords words)
    : program_(program),
      words_(words),
      page_(page),
      exchange_(exchange),
      limits_(limits),
      ends_(ends_of_user()) {
  page_of_crash = &page;
  words_of_crash = words;
  program_of_crash = program;
  give_crash_stack();
  take_handlers(ends_);
  catch_exits();
  // Blocked in every thread that comes later, the library's too, they wait for `watch`.
  pthread_sigmask(SIG_BLOCK, &ends_, &before_);
  thread_ = std::thread([this] { watch(); });
}

Overseer::~Overseer() {
  stop_ = true;
  thread_.join();
  page_of_crash = nullptr;
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void Overseer::give_crash_stack() noexcept {
  constexpr std::size_t kStackBytes = 32768;  // a signal frame has up to 11 KiB of registers
  alignas(16) static std::array<std::array<std::byte, kStackBytes>, kMostCrashStacks> stacks;
  static std::atomic<int> taken{0};
  thread_local bool has_looked = false;
  if (has_looked) return;
  has_looked = true;
  stack_t before{};
  const bool has_one = sigaltstack(nullptr, &before) == 0 && (before.ss_flags & SS_DISABLE) == 0;
  if (has_one || taken.load() >= kMostCrashStacks) return;
  const int place = taken.fetch_add(1);
  if (place >= kMostCrashStacks) return;
  stack_t own{};
  own.ss_sp = stacks[static_cast<std::size_t>(place)].data();
  own.ss_size = kStackBytes;
  sigaltstack(&own, nullptr);
}

void Overseer::enter(Phase phase) noexcept {
  if (phase == Phase::frames || phase == Phase::closing) catch_exits();
  take_handlers(ends_);
  looks_ = 0;
  phase_ = phase;
}

void Overseer::set_reason(const std::string& reason) {
  reason_ = reason;
}

void Overseer::watch() {
  const BlockStopSignals to_the_main_thread;
  int asked_ms = 0;  // since a signal requested the end
  while (!stop_) {
    take_signals();
    take_handlers(ends_);
    const int ms = (looks_.fetch_add(1) + 1) * kLookMs;
    switch (phase_.load()) {
      case Phase::opening:
        asked_ms = stop_requested() ? asked_ms + kLookMs : 0;
        if (ms > limits_.opening_ms || asked_ms > kMostClosingMs) {
          end("opening");
        }
        break;
      case Phase::frames:
        look_at_frames();
        break;
      case Phase::closing:
        if (ms > kMostClosingMs) {
          end("closing");
        }
        break;
      case Phase::over:
        break;
    }
  }
}

/// For one period.
void Overseer::take_signals() noexcept {
  const std::int64_t until_ns = monotonic_ns() + kLookMs * std::int64_t{1'000'000};
  for (;;) {
    const std::int64_t left_ns = until_ns - monotonic_ns();
    if (left_ns <= 0) return;
    const timespec left{0, left_ns};
    if (sigtimedwait(&ends_, nullptr, &left) > 0) request_stop();
  }
}

void Overseer::look_at_frames() {
  const std::uint64_t frames = exchange_.heartbeat();
  still_looks_ = frames == last_frames_ ? still_looks_ + 1 : 0;
  last_frames_ = frames;
  // The main thread watches the time to the first frame.
  if (frames == 0 || exchange_.finished() || still_looks_ * kLookMs < limits_.stall_ms) return;
  exchange_.fail(ArmExchange::kStalled);
  Line line;
  line << words_.watched << " has stopped its frames";
  page_.set_state(ArmState::failed, line.text());
}

void Overseer::end(const char* what) {
  Line line;
  line << words_.watched << " does not return from " << what << " the device"
       << words_.opening_cure;
  page_.set_state(ArmState::failed, line.text());
  print(program_, phase_.load() == Phase::closing ? reason_.c_str() : "", line.text());
  end_is_told();
  _exit(2);
}

}  // namespace kerf
