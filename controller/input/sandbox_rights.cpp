// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <linux/futex.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "controller/input/sandbox.hpp"

namespace kerf {
namespace {

[[noreturn]] void fail(const char* what, int error) {
  throw std::runtime_error("no sandbox: " + std::string(what) + " (" +
                           std::generic_category().message(error) +
                           "); it needs a kernel with CONFIG_SECCOMP_FILTER, /proc and /dev/null");
}

void limit(__rlimit_resource resource, rlim_t soft, rlim_t hard) {
  rlimit now{};
  getrlimit(resource, &now);
  now = {std::min(soft, now.rlim_max), std::min(hard, now.rlim_max)};
  if (setrlimit(resource, &now) != 0) fail("setrlimit", errno);
}

// Reading what is open or can be opened for reading, memory, the ways on which a process ends.
constexpr std::initializer_list<int> kHarmless{
    SCMP_SYS(read),           SCMP_SYS(pread64),       SCMP_SYS(readv),
    SCMP_SYS(lseek),          SCMP_SYS(fstat),         SCMP_SYS(newfstatat),
    SCMP_SYS(statx),          SCMP_SYS(access),        SCMP_SYS(faccessat),
    SCMP_SYS(faccessat2),     SCMP_SYS(readlink),      SCMP_SYS(readlinkat),
    SCMP_SYS(getcwd),         SCMP_SYS(close),         SCMP_SYS(munmap),
    SCMP_SYS(mremap),         SCMP_SYS(brk),           SCMP_SYS(madvise),
    SCMP_SYS(getrandom),      SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday),
    SCMP_SYS(uname),          SCMP_SYS(getpid),        SCMP_SYS(gettid),
    SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn),  SCMP_SYS(rt_sigaction),
    SCMP_SYS(exit),           SCMP_SYS(exit_group)};

#ifdef KERF_SANITIZED
// The sanitizers of our own code test addresses with a pipe and report on stderr.
constexpr std::initializer_list<int> kOfChecks{SCMP_SYS(pipe), SCMP_SYS(pipe2),
                                               SCMP_SYS(sigaltstack), SCMP_SYS(sched_yield)};
#else
constexpr std::initializer_list<int> kOfChecks{};
#endif

/// A call that is allowed only if one argument, masked, has one value.
struct Conditional {
  int call;
  scmp_arg_cmp when;
};

/// Calls that are harmless with some arguments only.
auto conditional_calls() {
  constexpr scmp_datum_t kWrites = O_ACCMODE | O_CREAT | O_TRUNC;
  constexpr auto kOperation = static_cast<std::uint32_t>(~FUTEX_PRIVATE_FLAG);
  const auto masked = [](unsigned argument, scmp_datum_t mask, scmp_datum_t value) {
    return scmp_arg_cmp{argument, SCMP_CMP_MASKED_EQ, mask, value};
  };
  const auto equal = [](unsigned argument, int value) {
    return scmp_arg_cmp{argument, SCMP_CMP_EQ, static_cast<scmp_datum_t>(value), 0};
  };
  return std::array{Conditional{SCMP_SYS(openat), masked(2, kWrites, O_RDONLY)},
                    Conditional{SCMP_SYS(mmap), masked(2, PROT_EXEC, 0)},
                    Conditional{SCMP_SYS(mprotect), masked(2, PROT_EXEC, 0)},
                    Conditional{SCMP_SYS(futex), masked(1, kOperation, FUTEX_WAKE)},
                    Conditional{SCMP_SYS(tgkill), equal(0, getpid())},  // abort() calls it
#ifdef KERF_SANITIZED
                    Conditional{SCMP_SYS(write), equal(0, STDERR_FILENO)},
                    Conditional{SCMP_SYS(write), {0, SCMP_CMP_GT, kSandboxMemory, 0}},
#endif
                    Conditional{SCMP_SYS(write), equal(0, kSandboxChannel)}};
}

void filter_calls() {
  const std::unique_ptr<void, decltype(&seccomp_release)> filter(
      seccomp_init(SCMP_ACT_ERRNO(EPERM)), seccomp_release);
  int error = filter ? 0 : -ENOMEM;
  for (const auto& calls : {kHarmless, kOfChecks}) {
    for (const int call : calls) {
      if (error == 0) error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0);
    }
  }
  for (const Conditional& c : conditional_calls()) {
    if (error == 0) error = seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, c.call, 1, c.when);
  }
  if (error == 0) error = seccomp_load(filter.get());
  if (error != 0) fail("seccomp", -error);
}

}  // namespace

void drop_inheritance(pid_t parent, int channel, int memory) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) ::_exit(1);  // it ended before that
  for (int signal = 1; signal < NSIG; ++signal) std::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGPIPE}) {
    std::signal(signal, SIG_IGN);  // the parent's to answer
  }
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, nullptr);

  const int null = ::open("/dev/null", O_RDWR);
  if (null < 0 && errno != EMFILE) fail("/dev/null", errno);
  constexpr int kAbove = 16;  // out of the way of the numbers that they get
  const int far_channel = ::fcntl(channel, F_DUPFD, kAbove);
  const int far_memory = ::fcntl(memory, F_DUPFD, kAbove);
  if (null < 0 || far_channel < 0 || far_memory < 0) {
    throw std::runtime_error("too few files may be open to read it; raise `ulimit -n` to 64");
  }
  ::dup2(null, STDIN_FILENO);
  ::dup2(null, STDOUT_FILENO);
#ifndef KERF_SANITIZED
  ::dup2(null, STDERR_FILENO);
#endif
  if (::dup2(far_channel, kSandboxChannel) < 0 || ::dup2(far_memory, kSandboxMemory) < 0 ||
      ::close_range(kSandboxMemory + 1, ~0U, 0) != 0) {
    ::_exit(1);
  }
}

void drop_rights(std::uint64_t memory_bytes, int cpu_s) {
  std::uint64_t all = 0, resident = 0, shared = 0, text = 0, library = 0, data = 0;
  std::ifstream("/proc/self/statm") >> all >> resident >> shared >> text >> library >> data;
  if (data == 0) fail("/proc/self/statm", ENOENT);
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  // Both count from what is there now, which under address checks is most of the address space.
  limit(RLIMIT_AS, all * page + memory_bytes, RLIM_INFINITY);
  limit(RLIMIT_DATA, data * page + memory_bytes, RLIM_INFINITY);
  const auto cpu = static_cast<rlim_t>(cpu_s);
  limit(RLIMIT_CPU, cpu, cpu + 1);
  limit(RLIMIT_FSIZE, 0, 0);
  limit(RLIMIT_CORE, 0, 0);
  constexpr rlim_t kOpenFiles = 16;  // a reader opens one or two
  limit(RLIMIT_NOFILE, kOpenFiles, kOpenFiles);
  filter_calls();
}

void raise_memory(pid_t child, std::uint64_t bytes) noexcept {
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit now{};
    if (prlimit(child, resource, nullptr, &now) != 0) continue;  // it ended
    now.rlim_cur = std::min(now.rlim_cur + bytes, now.rlim_max);
    prlimit(child, resource, &now, nullptr);
  }
}

}  // namespace kerf
