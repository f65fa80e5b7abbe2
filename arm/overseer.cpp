// SPDX-License-Identifier: Apache-2.0
#include "arm/overseer.hpp"

#include <csignal>
#include <cstring>

#include <unistd.h>

#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

// For the handler.
std::atomic<ArmPageAdapter*> page_of_crash{nullptr};
const char* program_of_crash = "";

constexpr const char* kCrashed =
    "the vendor's library, or kerf-arm in it, has crashed; unplug the device, plug it in again, "
    "and "
    "see whether the vendor's own program runs";

void print(const char* program, const char* reason, const char* text) noexcept {
  const char* const parts[] = {program, ": ", reason, reason[0] != 0 ? "; " : "", text, "\n"};
  for (const char* const part : parts) {
    if (write(STDERR_FILENO, part, std::strlen(part)) < 0) return;
  }
}

/// The device keeps its last force, unless its own watchdog ends that: no call of a library that
/// has crashed is safe.
void on_crash(int) {
  if (ArmPageAdapter* page = page_of_crash) page->set_state(ArmState::failed, kCrashed);
  print(program_of_crash, "", kCrashed);
  _exit(2);
}

}  // namespace

Overseer::Overseer(const char* program, ArmPageAdapter& page, ArmExchange& exchange, Limits limits)
    : program_(program), page_(page), exchange_(exchange), limits_(limits) {
  page_of_crash = &page;
  program_of_crash = program;
  for (const int number : crash_signals()) {
    if (number != SIGQUIT) std::signal(number, on_crash);
  }
  thread_ = std::thread([this] { watch(); });
}

Overseer::~Overseer() {
  stop_ = true;
  thread_.join();
  page_of_crash = nullptr;
}

void Overseer::enter(Phase phase) noexcept {
  looks_ = 0;
  phase_ = phase;
}

void Overseer::set_reason(const std::string& reason) {
  reason_ = reason;
}

void Overseer::watch() {
  const BlockStopSignals to_the_main_thread;
  int asked_ms = 0;  // since a signal has asked for the end
  while (!stop_) {
    sleep_until_ns(monotonic_ns() + kLookMs * std::int64_t{1'000'000});
    const int ms = (looks_.fetch_add(1) + 1) * kLookMs;
    switch (phase_.load()) {
      case Phase::opening:
        asked_ms = stop_requested() ? asked_ms + kLookMs : 0;
        if (ms > limits_.opening_ms || asked_ms > kMostClosingMs) {
          end("the vendor's library does not return from opening the device; unplug it and plug it "
              "in again");
        }
        break;
      case Phase::frames:
        look_at_frames();
        break;
      case Phase::closing:
        if (ms > kMostClosingMs) {
          end("the vendor's library does not return from closing the device; unplug it and plug it "
              "in again");
        }
        break;
      case Phase::over:
        break;
    }
  }
}

void Overseer::look_at_frames() {
  const std::uint64_t frames = exchange_.frames();
  still_looks_ = frames == last_frames_ ? still_looks_ + 1 : 0;
  last_frames_ = frames;
  // Before the first frame the main thread waits.
  if (frames == 0 || exchange_.finished() || still_looks_ * kLookMs < limits_.stall_ms) return;
  exchange_.fail(ArmExchange::kStalled);
  page_.set_state(ArmState::failed, "the vendor's library has stopped its frames");
}

void Overseer::end(const char* text) {
  page_.set_state(ArmState::failed, text);
  print(program_, phase_.load() == Phase::closing ? reason_.c_str() : "", text);
  _exit(2);
}

}  // namespace kerf
