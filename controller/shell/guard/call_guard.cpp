// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/guard/call_guard.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <system_error>

#include <linux/futex.h>
#include <seccomp.h>
#include <ucontext.h>

namespace kerf {
namespace {

// A signal handler can reach nothing but globals.
std::atomic<DeviceDriver*> guarded{nullptr};
std::atomic<std::atomic<bool>*> stop_of_loop{nullptr};
std::atomic<bool> in_loop{false};
std::atomic<int> first_unexpected{-1};
static_assert(std::atomic<int>::is_always_lock_free);

/// What the trapped call returns to its caller.
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
  if (DeviceDriver* device = guarded) static_cast<void>(device->release_for_good());
  if (std::atomic<bool>* stop = stop_of_loop) *stop = true;
  return_from_call(context, -EPERM);
}

// The clock and the statistics; a handler's way back; the ways on which a thread or a program ends.
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
// Behind a mailbox, where only a handler waits until the last packet has left.
constexpr std::initializer_list<int> kMailbox{SCMP_SYS(poll), SCMP_SYS(ppoll)};

std::initializer_list<int> calls_of(std::string_view port) {
  if (port.starts_with("fw")) return kFireWire;
  return port.starts_with("usb") || port.starts_with("hid") ? kMailbox : kSocket;
}

}  // namespace

CallGuard::CallGuard(DeviceDriver& device, std::atomic<bool>& stop) noexcept {
  guarded = &device;
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

void CallGuard::enter(std::string_view port) {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(seccomp_init(SCMP_ACT_TRAP),
                                                                 seccomp_release);
  int error = filter ? 0 : -ENOMEM;
  for (const auto& calls : {kEverywhere, calls_of(port)}) {
    for (const int call : calls) {
      if (error == 0) error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0);
    }
  }
  // Waking an I/O thread takes no time; waiting for a lock does.
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
