// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/motor_guard.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <thread>

#include <linux/futex.h>
#include <seccomp.h>
#include <ucontext.h>
#include <unistd.h>

#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

std::atomic<const Devices*> driven{nullptr};  // for signal handlers, which can only reach globals
static_assert(std::atomic<const Devices*>::is_always_lock_free);

/// Motors off at once: the orderly end may take some ticks.
void on_stop() noexcept {
  if (const Devices* devices = driven.load()) devices->stay_released();
}

void on_crash(int signal) {
  if (const Devices* devices = driven.load()) {
    static_cast<void>(devices->release_for_good());  // one send() each: signal-safe
    // The bus carries it in one of its next cycles, unless the process ends first.
    const timespec cycles{0, 2'000'000};
    nanosleep(&cycles, nullptr);
  }
#ifdef KERF_SANITIZED
  // Undefined behaviour ends a sanitised program this way, and the handler of the sanitizer is
  // replaced.
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

MotorGuard::MotorGuard(const Devices& devices) noexcept : devices_(devices) {
  driven = &devices_;
  at_stop_signal(on_stop);
  handle_crashes(on_crash);
}

MotorGuard::~MotorGuard() {
  // The device may be slow to take packets; it gets 20 ms for this one.
  for (int tries = 0; !devices_.release_for_good() && tries < 20; ++tries) {
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

// The guard of system calls.

namespace {

// For signal handlers, which can only reach globals.
std::atomic<const Devices*> guarded{nullptr};
std::atomic<std::atomic<bool>*> stop_of_loop{nullptr};
std::atomic<bool> in_loop{false};
std::atomic<int> first_unexpected{-1};
static_assert(std::atomic<int>::is_always_lock_free);

/// Sets the result of the trapped call.
void return_from_call(void* context, int result) noexcept {
  auto& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  machine.gregs[REG_RAX] = result;
#elif defined(__aarch64__)
  machine.regs[0] = static_cast<unsigned long long>(result);
#else
#error "call_guard: which register holds the result of a system call here?"
#endif
}

void on_call(int, siginfo_t* info, void* context) {
  if (!in_loop) return return_from_call(context, -EAGAIN);
  int none = -1;
  first_unexpected.compare_exchange_strong(none, info->si_syscall);
  if (const Devices* devices = guarded) static_cast<void>(devices->release_for_good());
  if (std::atomic<bool>* stop = stop_of_loop) *stop = true;
  return_from_call(context, -EPERM);
}

// For the clock and the statistics; the return of a handler; the end of a thread or a program.
constexpr std::initializer_list<int> kEverywhere{
    SCMP_SYS(clock_nanosleep), SCMP_SYS(clock_gettime), SCMP_SYS(restart_syscall),
    SCMP_SYS(getrusage),       SCMP_SYS(rt_sigreturn),  SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(madvise),         SCMP_SYS(munmap),        SCMP_SYS(exit),
    SCMP_SYS(exit_group),      SCMP_SYS(getpid),        SCMP_SYS(gettid),
    SCMP_SYS(tgkill)};
constexpr std::initializer_list<int> kSocket{SCMP_SYS(recvfrom), SCMP_SYS(sendto), SCMP_SYS(poll),
                                             SCMP_SYS(ppoll)};
// A FireWire node is opened again when its channels were lost.
constexpr std::initializer_list<int> kFireWire{SCMP_SYS(ioctl), SCMP_SYS(read),   SCMP_SYS(poll),
                                               SCMP_SYS(ppoll), SCMP_SYS(openat), SCMP_SYS(dup3),
                                               SCMP_SYS(close)};
// For a port with a mailbox, whose handler alone waits until the last packet has left.
constexpr std::initializer_list<int> kMailbox{SCMP_SYS(poll), SCMP_SYS(ppoll)};

std::initializer_list<int> calls_of(std::string_view port) {
  if (port.starts_with("fw")) return kFireWire;
  if (port.starts_with("arm")) return {};  // a page of memory
  return port.starts_with("usb") || port.starts_with("hid") ? kMailbox : kSocket;
}

}  // namespace

CallGuard::CallGuard(const Devices& devices, std::atomic<bool>& stop) noexcept : devices_(devices) {
  guarded = &devices_;
  stop_of_loop = &stop;
  first_unexpected = -1;
  struct sigaction action {};
  action.sa_sigaction = on_call;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  sigaction(SIGSYS, &action, nullptr);
}

CallGuard::~CallGuard() {
  std::signal(SIGSYS, SIG_DFL);
  guarded = nullptr;
  stop_of_loop = nullptr;
}

void CallGuard::enter(std::span<const std::string> ports) {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(seccomp_init(SCMP_ACT_TRAP),
                                                                 seccomp_release);
  int error = filter ? 0 : -ENOMEM;
  const auto allow = [&](const std::initializer_list<int>& calls) {
    for (const int call : calls) {
      if (error == 0) error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0);
    }
  };
  allow(kEverywhere);
  for (const std::string& port : ports) allow(calls_of(port));
  // To wake an I/O thread is quick; to wait for a lock is not.
  constexpr std::uint32_t kOperation = ~std::uint32_t{FUTEX_PRIVATE_FLAG};
  const scmp_arg_cmp wakes{1, SCMP_CMP_MASKED_EQ, kOperation, FUTEX_WAKE};
  if (error == 0) {
    error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(futex), 1, wakes);
  }
  if (error == 0) error = seccomp_load(filter.get());
  if (error != 0) {
    throw std::runtime_error("--guard: no filter of system calls (" +
                             std::generic_category().message(-error) +
                             "); the kernel needs CONFIG_SECCOMP_FILTER, or leave --guard out");
  }
  in_loop = true;
}

void CallGuard::leave() noexcept {
  in_loop = false;
}

std::string CallGuard::unexpected() const {
  const int number = first_unexpected;
  if (number < 0) return "";
  const std::unique_ptr<char, decltype(&std::free)> name(
      seccomp_syscall_resolve_num_arch(SCMP_ARCH_NATIVE, number), std::free);
  return name ? name.get() : "number " + std::to_string(number);
}

}  // namespace kerf
