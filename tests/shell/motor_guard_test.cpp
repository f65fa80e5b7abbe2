// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/motor_guard.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/wire/omni.hpp"
#include "tests/support/child.hpp"

namespace kerf::motor_guard_test {
namespace {

using kerf::test::end_in_child;
using kerf::test::end_of;
using kerf::test::kKilledBySignal;
using kerf::test::start_child;

/// A port over a socket pair, so that packets of a child that ends still come.
class PairPort final : public kerf::PacketPort {
 public:
  explicit PairPort(int fd) : fd_(fd) {}
  std::size_t receive(std::span<std::uint8_t>) noexcept override { return 0; }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::decode_command(packet);
    lets_go = command && !command->motors_on;
    return ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL) > 0;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }

  std::atomic<bool> lets_go = false;  ///< the last packet does

 private:
  int fd_;
};

/// How a child ended that commanded torque.
struct Ending {
  kerf::OmniCommand last;  ///< command that it sent
  double off_ms = -1;      ///< from the begin of its way out to the packet that let go for good
  int code = -1;           ///< of `end_of`
};

/// When something happened, on a page that parent and child share.
class SharedTime {
 public:
  SharedTime()
      : ns_(static_cast<std::int64_t*>(mmap(nullptr, sizeof(std::int64_t), PROT_READ | PROT_WRITE,
                                            MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    REQUIRE(ns_ != MAP_FAILED);
  }
  SharedTime(const SharedTime&) = delete;
  SharedTime& operator=(const SharedTime&) = delete;
  ~SharedTime() { munmap(ns_, sizeof(std::int64_t)); }
  void set() noexcept { *ns_ = kerf::monotonic_ns(); }
  [[nodiscard]] std::int64_t get() const noexcept { return *ns_; }

 private:
  std::int64_t* ns_;
};

kerf::ServoOutput pushing() {
  kerf::ServoOutput output;
  output.dac_counts = {500, 500, 500};
  output.motors_on = true;
  return output;
}

/// Runs `way_out(stop, port)` in a child that commands torque.
template <class WayOut>
Ending ending_by(WayOut way_out) {
  std::array<int, 2> ends{};
  REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) == 0);
  SharedTime began;
  const pid_t child = start_child([&] {
    close(ends[0]);
    PairPort port(ends[1]);
    kerf::OmniDriver driver(port);
    std::atomic<bool>& stop = kerf::catch_stop_and_pause_signals();
    kerf::MotorGuard guard(driver);
    const kerf::HandlerStack handlers = guard.guard_stack();
    driver.command(pushing());
    began.set();
    way_out(stop, port);
  });
  close(ends[1]);
  Ending ending;
  std::array<std::uint8_t, 64> packet{};
  std::int64_t off_ns = 0;
  int packets = 0;
  for (ssize_t size = 0; (size = recv(ends[0], packet.data(), packet.size(), 0)) > 0; ++packets) {
    const auto command =
        kerf::decode_command(std::span(packet).first(static_cast<std::size_t>(size)));
    REQUIRE(command);
    if (*command != ending.last) off_ns = kerf::monotonic_ns();
    ending.last = *command;
  }
  CHECK(packets >= 2);
  close(ends[0]);
  ending.code = end_of(child);
  ending.off_ms = static_cast<double>(off_ns - began.get()) / 1e6;
  return ending;
}

/// Returns true if the kernel ends a process by this signal unless it is caught: tried by a child.
bool ends_by_default(int signal) {
  const pid_t child = start_child([signal] {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  });
  int status = 0;
  waitpid(child, &status, WUNTRACED);
  if (WIFSTOPPED(status)) {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  return WIFSIGNALED(status);
}

bool is_crash(int signal) {
  return std::ranges::count(kerf::crash_signals(), signal) > 0;
}

/// Signals 32 and 33 belong to the C library.
std::vector<int> signals_that_can_be_caught() {
  std::vector<int> signals;
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    if (signal >= 32 && signal < SIGRTMIN) continue;
    if (signal != SIGKILL && ends_by_default(signal)) signals.push_back(signal);
  }
  return signals;
}

constexpr kerf::OmniCommand kNeutral{};

}  // namespace

TEST_CASE("motors are off after return and exception") {
  CHECK(ending_by([](auto&, auto&) {}).last == kNeutral);
  const Ending thrown = ending_by([](auto&, auto&) { throw std::runtime_error("edge"); });
  CHECK(thrown.last == kNeutral);
  CHECK(thrown.code == kerf::test::kThrown);
}

TEST_CASE("every signal that ends a process by default switches the motors off first") {
  const std::vector<int> signals = signals_that_can_be_caught();
  CHECK(signals.size() == 22 + static_cast<std::size_t>(SIGRTMAX - SIGRTMIN + 1));
  double slowest_ms = 0;
  int slowest = 0;
  for (const int signal : signals) {
    CAPTURE(signal);
    if (signal == SIGPIPE || signal == SIGXFSZ) continue;  // errors of a write, below
#ifdef KERF_SANITIZED                                      // they take these for themselves
    if (is_crash(signal)) continue;
#endif
    const Ending ending = ending_by([signal](std::atomic<bool>& stop, const PairPort& port) {
      std::raise(signal);
      if (!stop) _exit(3);
      if (!port.lets_go) _exit(4);  // the way out may last: the motors are off by now
      // A servo may still be in its tick, and computes one more force.
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    });
    CHECK(ending.last == kNeutral);
    CHECK((is_crash(signal) ? ending.code == kKilledBySignal + signal : ending.code == 0));
    if (ending.off_ms > slowest_ms) {
      slowest_ms = ending.off_ms;
      slowest = signal;
    }
  }
  MESSAGE("motors off " << slowest_ms << " ms after the signal at most, by signal " << slowest);
}

TEST_CASE("commands of a tick after the signal are neutral") {
  std::array<int, 2> ends{};
  REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) == 0);
  PairPort port(ends[0]);
  kerf::OmniDriver driver(port);
  CHECK(driver.stay_released());
  driver.command(pushing());
  std::array<std::uint8_t, 64> packet{};
  for (ssize_t size = 0; (size = recv(ends[1], packet.data(), packet.size(), MSG_DONTWAIT)) > 0;) {
    const auto command =
        kerf::decode_command(std::span(packet).first(static_cast<std::size_t>(size)));
    REQUIRE(command);
    CHECK_FALSE(command->motors_on);
    CHECK(command->motor == kNeutral.motor);
  }
  close(ends[0]);
  close(ends[1]);
}

TEST_CASE("signals of a write end nothing, and those that pause a program end it") {
  for (const int signal : {SIGPIPE, SIGXFSZ, SIGTSTP, SIGTTIN, SIGTTOU}) {
    CAPTURE(signal);
    const bool pauses = signal != SIGPIPE && signal != SIGXFSZ;
    const Ending ending = ending_by([=](std::atomic<bool>& stop, const PairPort&) {
      std::raise(signal);
      if (stop != pauses) _exit(3);
    });
    CHECK(ending.code == 0);
    CHECK(ending.last == kNeutral);
  }
}

TEST_CASE("a signal that is blocked from the start stops too, an ignored one only as INT or TERM") {
  for (const int signal : {SIGHUP, SIGUSR1, SIGALRM, SIGRTMIN, SIGINT, SIGTERM}) {
    CAPTURE(signal);
    const auto is_caught = [signal] {
      const std::atomic<bool>& stop = kerf::catch_stop_signals();
      std::raise(signal);
      return stop ? 1 : 0;
    };
    CHECK(end_in_child([&] {
            const kerf::BlockStopSignals blocked;
            return is_caught();
          }) == 1);
    CHECK(end_in_child([&] {
            std::signal(signal, SIG_IGN);
            return is_caught();
          }) == (signal == SIGINT || signal == SIGTERM ? 1 : 0));
  }
}

}  // namespace kerf::motor_guard_test
