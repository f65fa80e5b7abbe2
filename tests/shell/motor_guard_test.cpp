// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/motor_guard.hpp"

#include <array>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/device/driver/omni_driver.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/wire/omni_packet.hpp"

namespace {

/// A port over a socket pair, so that a dying child can still be heard.
class PairPort final : public kerf::PacketPort {
 public:
  explicit PairPort(int fd) : fd_(fd) {}
  std::size_t receive(std::span<std::uint8_t>) noexcept override { return 0; }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    return ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL) > 0;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }

 private:
  int fd_;
};

/// Runs `way_out` in a child that commands torque, and returns the last command it sent.
template <class WayOut>
kerf::OmniCommand last_command_of(WayOut way_out) {
  std::array<int, 2> ends{};
  REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends.data()) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    close(ends[0]);
    PairPort port(ends[1]);
    kerf::OmniDriver driver(port);
    std::atomic<bool>& stop = kerf::catch_stop_and_pause_signals();
    try {
      kerf::MotorGuard guard(driver);
      guard.guard_stack();
      kerf::ServoOutput output;
      output.motor_counts = {500, 500, 500};
      output.motors_on = true;
      driver.command(output);
      way_out(stop);
    } catch (const std::exception&) {
      _exit(2);
    }
    _exit(0);
  }
  close(ends[1]);
  kerf::OmniCommand last;
  std::array<std::uint8_t, 64> packet{};
  int packets = 0;
  for (ssize_t size = 0; (size = recv(ends[0], packet.data(), packet.size(), 0)) > 0; ++packets) {
    const auto command =
        kerf::decode_command(std::span(packet).first(static_cast<std::size_t>(size)));
    REQUIRE(command);
    last = *command;
  }
  CHECK(packets >= 2);
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return last;
}

}  // namespace

TEST_CASE("motors are off after return, exception, signal and crash") {
  const kerf::OmniCommand neutral{};
  CHECK(last_command_of([](auto&) {}) == neutral);
  CHECK(last_command_of([](auto&) { throw std::runtime_error("edge"); }) == neutral);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGTSTP}) {
    CHECK(last_command_of([signal](std::atomic<bool>& stop) {
            std::raise(signal);
            if (!stop) _exit(3);  // without the guard's packet the check fails
          }) == neutral);
  }
#ifndef KERF_SANITIZED  // sanitizers take these signals for themselves
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGUSR1, SIGSYS}) {
    CHECK(last_command_of([signal](auto&) { std::raise(signal); }) == neutral);
  }
#endif
}
