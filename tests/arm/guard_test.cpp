// SPDX-License-Identifier: Apache-2.0
// The guard of kerf-arm, and the signals that its overseer takes, in processes of the test's own.
#include "arm/guard.hpp"

#include <array>
#include <csignal>
#include <cstdio>
#include <functional>
#include <string>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "arm/overseer.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "tests/arm/mock_library.hpp"

namespace kerf::guard_test {
namespace {

using kerf::test::Link;

struct End {
  int code = 0;
  std::string said;
};

/// Runs `work` under a guard, in a child of the test, whose handlers it does not have.
End guarded(const std::function<int()>& work) {
  const int file = memfd_create("said", MFD_CLOEXEC);
  const pid_t child = fork();
  if (child == 0) {
    for (const int number : kerf::crash_signals()) std::signal(number, SIG_DFL);
    dup2(file, STDERR_FILENO);
    _exit(kerf::run_guarded("guard", work));
  }
  int status = 0;
  waitpid(child, &status, 0);
  std::array<char, 4096> text{};
  const ssize_t size = pread(file, text.data(), text.size(), 0);
  close(file);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          std::string(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0)};
}

bool soon(const std::function<bool()>& is_so) {
  const std::int64_t until_ns = kerf::monotonic_ns() + 5'000'000'000;
  while (!is_so()) {
    if (kerf::monotonic_ns() > until_ns) return false;
    kerf::sleep_until_ns(kerf::monotonic_ns() + 1'000'000);
  }
  return true;
}

}  // namespace

TEST_CASE("guard: every end of a guarded child has one line, or its own exit code") {
  CHECK(guarded([] { return 0; }).code == 0);
  const End own = guarded([] { return 5; });
  CHECK(own.code == 5);
  CHECK(own.said.empty());
  const End left = guarded([]() -> int { _exit(0); });
  CHECK(left.code == 2);
  CHECK(left.said.starts_with("guard: the vendor's library has ended the program by _exit(0); "));
  for (const int number : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) {
    const End crashed = guarded([number]() -> int { return raise(number); });
    CHECK(crashed.code == 2);
    CHECK(crashed.said.find(std::string("has crashed (SIG") + sigabbrev_np(number)) !=
          std::string::npos);
  }
  const End killed = guarded([]() -> int { return raise(SIGKILL); });
  CHECK(killed.code == 2);
  CHECK(killed.said.starts_with("guard: killed, so the device was not closed"));
}

TEST_CASE(
    "guard: the newest last word leaves once the child is killed, and none that was taken back") {
  std::array<int, 2> ends{};
  REQUIRE(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()) == 0);
  const auto heard = [&] {
    std::array<char, 64> bytes{};
    const ssize_t size = recv(ends[1], bytes.data(), bytes.size(), 0);
    return std::string(bytes.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  };
  const End killed = guarded([&]() -> int {
    kerf::leave_last_word(ends[0], "an older one");
    kerf::leave_last_word(ends[0], "zero force");
    return raise(SIGKILL);
  });
  CHECK(killed.said.starts_with("guard: killed; the device's service was given zero force"));
  CHECK(heard() == "zero force");
  const End without = guarded([&]() -> int {
    kerf::leave_last_word(ends[0], "zero force");
    kerf::leave_last_word(-1, "");
    return raise(SIGKILL);
  });
  CHECK(without.said.starts_with("guard: killed, so the device was not closed"));
  CHECK(heard().empty());
  for (const int end : ends) close(end);
}

TEST_CASE("guard: signals are passed on, and a guard that is killed ends its child in order") {
  for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGUSR1, SIGKILL}) {
    CAPTURE(number);
    std::array<int, 2> told{};
    REQUIRE(pipe(told.data()) == 0);
    const pid_t guard = fork();
    if (guard == 0) {
      _exit(kerf::run_guarded("guard", [&] {
        kerf::catch_stop_signals();
        kerf::ask_by(SIGQUIT);
        const sigset_t ends = kerf::ends_of_user();
        pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
        char byte = 'r';
        if (write(told[1], &byte, 1) != 1) return 3;
        if (!soon([] { return kerf::stop_requested(); })) return 4;
        byte = 'e';
        return write(told[1], &byte, 1) == 1 ? 7 : 3;
      }));
    }
    close(told[1]);
    char byte = 0;
    CHECK(read(told[0], &byte, 1) == 1);
    CHECK(byte == 'r');
    kill(guard, number);
    CHECK(read(told[0], &byte, 1) == 1);
    CHECK(byte == 'e');
    int status = 0;
    waitpid(guard, &status, 0);
    CHECK((number == SIGKILL ? WIFSIGNALED(status) : WEXITSTATUS(status) == 7));
    close(told[0]);
  }
}

TEST_CASE("overseer: the signals of the user are taken, whatever was done with them") {
  const auto taken = [](int number, const std::function<void(const sigset_t&)>& library) {
    return guarded([&] {
             kerf::catch_stop_and_pause_signals();
             Link link(kerf::Personality::touch);
             kerf::Overseer overseer("guard", link.page, link.exchange, {});
             sigset_t one;
             sigemptyset(&one);
             sigaddset(&one, number);
             library(one);
             // Within a period, in which the library's word counts for a thread that unblocks them.
             kerf::sleep_until_ns(kerf::monotonic_ns() + 100'000'000);
             kill(getpid(), number);
             const bool is_taken = soon([] { return kerf::stop_requested(); });
             overseer.enter(kerf::Overseer::Phase::over);
             return is_taken ? 0 : 1;
           })
        .code;
  };
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) {
    CAPTURE(number);
    CHECK(taken(number, [](const sigset_t&) {}) == 0);
    CHECK(taken(number, [&](const sigset_t&) { std::signal(number, SIG_IGN); }) == 0);
    CHECK(taken(number, [&](const sigset_t&) { std::signal(number, [](int) {}); }) == 0);
    CHECK(taken(number, [](const sigset_t& one) { pthread_sigmask(SIG_BLOCK, &one, nullptr); }) ==
          0);
    CHECK(taken(number, [&](const sigset_t& one) {
            std::signal(number, [](int) {});
            pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
          }) == 0);
    CHECK(taken(number, [&](const sigset_t& one) {
            std::signal(number, SIG_IGN);
            pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
          }) == 0);
  }
}

}  // namespace kerf::guard_test
