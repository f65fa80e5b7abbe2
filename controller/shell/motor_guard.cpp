// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/motor_guard.hpp"

#include <csignal>

namespace kerf {
namespace {

// A signal handler can reach nothing but globals.
std::atomic<const OmniDriver*> guarded{nullptr};
std::atomic<std::atomic<bool>*> stop_flag{nullptr};
static_assert(std::atomic<const OmniDriver*>::is_always_lock_free);

constexpr int kOrderly[] = {SIGINT, SIGTERM, SIGHUP};
constexpr int kCrashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT};

void on_orderly(int) {
  if (auto* stop = stop_flag.load()) stop->store(true);
}

void on_crash(int signal) {
  if (const OmniDriver* device = guarded.load()) device->release();  // one send(): signal-safe
  std::raise(signal);  // the handler was reset on entry: this ends the program
}

void handle(int signal, void (*handler)(int), int flags) noexcept {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigaction(signal, &action, nullptr);
}

}  // namespace

MotorGuard::MotorGuard(const OmniDriver& device, std::atomic<bool>& stop) noexcept
    : device_(device) {
  guarded = &device;
  stop_flag = &stop;
  for (const int signal : kOrderly) handle(signal, on_orderly, SA_RESTART);
  for (const int signal : kCrashes) handle(signal, on_crash, static_cast<int>(SA_RESETHAND));
}

MotorGuard::~MotorGuard() {
  device_.release();
  for (const int signal : kOrderly) handle(signal, SIG_DFL, 0);
  for (const int signal : kCrashes) handle(signal, SIG_DFL, 0);
  guarded = nullptr;
  stop_flag = nullptr;
}

}  // namespace kerf
