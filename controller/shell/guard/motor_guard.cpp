// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/guard/motor_guard.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <ctime>
#include <string_view>
#include <thread>

#include <unistd.h>

#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

std::atomic<DeviceDriver*> driven{nullptr};  // a signal handler can reach nothing but globals
static_assert(std::atomic<DeviceDriver*>::is_always_lock_free);

/// The way out may last for some ticks, and the force need not.
void on_stop() noexcept {
  if (DeviceDriver* device = driven.load()) device->stay_released();
}

void on_crash(int signal) {
  if (DeviceDriver* device = driven.load()) {
    static_cast<void>(device->release_for_good());  // one send(): signal-safe
    // A bus carries it in one of its next cycles, and takes it down with a process that is gone.
    const timespec cycles{0, 2'000'000};
    nanosleep(&cycles, nullptr);
  }
#ifdef KERF_SANITIZED
  // Undefined behaviour ends a sanitised program so, and the sanitizer's own handler is not there.
  constexpr std::string_view kTrapped = "Sanitizer: a check stopped the controller (SIGILL)\n";
  if (signal == SIGILL) {
    [[maybe_unused]] const auto told = write(STDERR_FILENO, kTrapped.data(), kTrapped.size());
  }
#endif
  std::raise(signal);  // the handler was reset on entry: this ends the program
}

void handle_crashes(void (*handler)(int)) noexcept {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK);
  for (const int signal : crash_signals()) sigaction(signal, &action, nullptr);
}

}  // namespace

MotorGuard::MotorGuard(DeviceDriver& device) noexcept : device_(device) {
  driven = &device;
  at_stop_signal(on_stop);
  handle_crashes(on_crash);
}

MotorGuard::~MotorGuard() {
  // The device may be slow to take packets; it gets 20 ms to hear this one.
  for (int tries = 0; !device_.release_for_good() && tries < 20; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  at_stop_signal(nullptr);
  handle_crashes(SIG_DFL);
  driven = nullptr;
}

HandlerStack::HandlerStack(std::byte* stack, std::size_t bytes) noexcept {
  stack_t own{};
  own.ss_sp = stack;
  own.ss_size = bytes;
  sigaltstack(&own, &before_);
}

HandlerStack::~HandlerStack() {
  sigaltstack(&before_, nullptr);
}

}  // namespace kerf
