// SPDX-License-Identifier: Apache-2.0
// The real servo loop on the socket port, beside an emulator: no allocation, no page fault, no
// system call beyond clock and port. Each proof also meets the fault that it must catch.
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include <doctest/doctest.h>
#include <linux/futex.h>
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/port/socket_port.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/motor_guard.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/plan/compile.hpp"
#include "controller/run/run_start.hpp"
#include "shared/segment/segment.hpp"
#include "tests/support/process.hpp"

#ifndef KERF_SANITIZED  // sanitizers allocate and call for themselves

namespace kerf::clean_loop_test {
namespace {

using kerf::test::Process;
using kerf::test::TemporaryFolder;

/// Number of the kernel's tracepoint raw_syscalls:sys_enter; 0 if it cannot be read. If no
/// tracefs is mounted, one is for a moment.
std::uint64_t tracepoint_of_calls() {
  const auto read = [](const std::filesystem::path& root) {
    std::uint64_t id = 0;
    std::ifstream(root / "events/raw_syscalls/sys_enter/id") >> id;
    return id;
  };
  for (const char* root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
    if (const auto id = read(root)) return id;
  }
  const TemporaryFolder folder;
  if (mount("none", folder.path().c_str(), "tracefs", MS_RDONLY, nullptr) != 0) return 0;
  const auto id = read(folder.path());
  umount(folder.path().c_str());
  return id;
}

/// Counts the system calls of the thread that makes one of these, exactly.
class SystemCallCount {
 public:
  SystemCallCount() {
    perf_event_attr event{};
    event.size = sizeof event;
    event.type = PERF_TYPE_TRACEPOINT;
    event.config = tracepoint_of_calls();
    event.disabled = 1;
    if (event.config == 0) {
      why_not_ = "no tracefs";
      return;
    }
    fd_ = static_cast<int>(syscall(SYS_perf_event_open, &event, 0, -1, -1, 0));
    if (fd_ < 0) why_not_ = std::generic_category().message(errno);
  }
  ~SystemCallCount() {
    if (fd_ >= 0) close(fd_);
  }
  SystemCallCount(const SystemCallCount&) = delete;
  SystemCallCount& operator=(const SystemCallCount&) = delete;

  /// Empty if it counts.
  [[nodiscard]] const std::string& why_not() const { return why_not_; }
  void start() const { ioctl(fd_, PERF_EVENT_IOC_ENABLE, 0); }
  /// The calls since `start`, the one that stops it included.
  [[nodiscard]] std::uint64_t stop() const {
    ioctl(fd_, PERF_EVENT_IOC_DISABLE, 0);
    std::uint64_t count = 0;
    return ::read(fd_, &count, sizeof count) == sizeof count ? count : 0;
  }

 private:
  int fd_ = -1;
  std::string why_not_;
};

enum class Seed { none, allocation, page, call, wake, lock };

/// The socket port; while it takes a packet it breaks a rule of a clean loop, `kSeeds` times.
class SeededPort final : public kerf::PacketPort {
 public:
  static constexpr std::size_t kSeeds = 20;

  SeededPort(kerf::PacketPort& port, Seed seed, const kerf::LoopSignals& signals)
      : port_(port),
        seed_(seed),
        signals_(signals),
        sink_(open("/dev/null", O_WRONLY | O_CLOEXEC)) {}
  ~SeededPort() override {
    close(sink_);
    if (pages_ != nullptr) munmap(const_cast<char*>(pages_), kSeeds * page_);
  }

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    if (++receives > kWarmUp && planted < kSeeds) plant();
    return port_.receive(out);
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    ++sends;
    return port_.send(packet);
  }
  bool closed() const noexcept override { return port_.closed(); }
  bool wait(int milliseconds) noexcept override { return port_.wait(milliseconds); }

  /// After memory was locked: pages that are not there yet.
  void take_pages() {
    void* const at =
        mmap(nullptr, kSeeds * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(at != MAP_FAILED);
    pages_ = static_cast<volatile char*>(at);
    munlock(at, kSeeds * page_);
    madvise(at, kSeeds * page_, MADV_DONTNEED);
  }

  std::uint64_t receives = 0, sends = 0;
  std::size_t planted = 0;
  std::uint64_t first_tick = 0, last_tick = 0;  ///< in which something was planted

 private:
  void plant() noexcept {
    last_tick = signals_.heartbeat + 1;
    if (planted == 0) first_tick = last_tick;
    if (seed_ == Seed::allocation) {
      ::operator delete(::operator new(1));  // unlike an expression of new, never left out
    } else if (seed_ == Seed::page) {
      pages_[planted * page_] = 1;
    } else if (seed_ == Seed::call) {
      static_cast<void>(!write(sink_, "", 1));
    } else if (seed_ == Seed::wake) {
      syscall(SYS_futex, &word_, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
    } else if (seed_ == Seed::lock) {  // returns at once: the word is another one
      syscall(SYS_futex, &word_, FUTEX_WAIT_PRIVATE, 1, nullptr, nullptr, 0);
    }
    ++planted;
  }

  static constexpr std::uint64_t kWarmUp = 1000;  // well after arming
  kerf::PacketPort& port_;
  Seed seed_;
  const kerf::LoopSignals& signals_;
  int sink_;
  int word_ = 0;
  std::size_t page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  volatile char* pages_ = nullptr;
};

struct Outcome {
  kerf::EndReason end = kerf::EndReason::never_armed;
  kerf::RunRecord record;
  bool locked = false;
  std::string guarded_call;
  bool stopped = false;
  std::uint64_t planted = 0, first_tick = 0, last_tick = 0;  ///< of the port
  std::string uncounted;                                     ///< why the calls were not
  std::uint64_t calls = 0, expected_calls = 0;
};

/// Half a second of the loop as controller_run.cpp wires it, with `seed` planted.
Outcome run_loop(Seed seed, bool guarded = false) {
  const TemporaryFolder folder;
  const std::string socket = (folder / "port").string();
  const Process emulator({KERF_TEST_BIN "/kerf-emulator", "--socket", socket, "--hand",
                          KERF_TEST_SCENES "/hands/touch.toml"},
                         folder / "emulator.log");
  kerf::LoadedScene scene = kerf::load_scene(KERF_TEST_SCENES "/touch.toml",
                                             {.phantom_size = kerf::VoxelGrid{64, 64, 41}});
  const auto servo = kerf::plan_scene(scene);
  const std::string json = kerf::canonical_json(scene);
  auto segment = kerf::SegmentWriter::create(kerf::segment_spec(scene, json, 0));
  kerf::SegmentServer server("clean-" + std::to_string(getpid()), segment, {.tools = 1});
  servo->take(scene);
  std::atomic<bool> stop{false};
  kerf::SocketPort socket_port(socket, 5000, stop);
  kerf::LoopSignals signals{stop};
  SeededPort port(socket_port, seed, signals);
  kerf::OmniDriver device(port);

  Outcome outcome;
  outcome.locked = kerf::lock_memory().empty();
  port.take_pages();
  {
    kerf::MotorGuard motors(device);
    std::optional<kerf::CallGuard> calls;
    if (guarded) calls.emplace(device, stop);
    std::thread([&] {
      const kerf::HandlerStack handlers = motors.guard_stack();
      static_cast<void>(kerf::become_real_time({}));
      kerf::Publisher eyes(segment, *servo);
      kerf::RealTimeTicks clock(1'000'000, 0);
      const SystemCallCount counter;
      outcome.uncounted = counter.why_not();
      const std::uint64_t before = port.receives + port.sends;
      if (calls)
        calls->enter(std::array<std::string, 1>{"socket:"});
      else
        counter.start();
      outcome.end = kerf::run_servo(clock, device, *servo, eyes, server, {.armed_ticks = 1500},
                                    signals, outcome.record);
      if (calls)
        calls->leave();
      else
        outcome.calls = counter.stop();
      // A sleep and a read of the port per tick; three reads of the page faults, and the stop.
      const std::uint64_t ticks = signals.heartbeat;
      outcome.expected_calls = ticks + port.receives + port.sends - before + 3 + 1;
    }).join();
    if (calls) outcome.guarded_call = calls->unexpected();
  }
  kerf::unlock_memory();
  outcome.planted = port.planted;
  outcome.first_tick = port.first_tick;
  outcome.last_tick = port.last_tick;
  outcome.stopped = stop;
  return outcome;
}

}  // namespace

TEST_CASE("the loop is clean: no allocation, no page fault, one call per sleep and packet") {
  const Outcome clean = run_loop(Seed::none);
  CHECK(clean.end == kerf::EndReason::ticks_done);
  CHECK(clean.record.allocations == 0);
  if (clean.locked) {
    CHECK(clean.record.faults_of_pages.minor == 0);
    CHECK(clean.record.faults_of_pages.major == 0);
  } else {
    MESSAGE("skipped: page faults of the loop: no right to lock memory");
  }
  if (clean.uncounted.empty()) {
    CHECK(clean.calls == clean.expected_calls);
  } else {
    MESSAGE("skipped: system calls of the loop: " << clean.uncounted);
  }
}

TEST_CASE("an allocation, a page fault and a system call in the loop are counted") {
  CHECK(run_loop(Seed::allocation).record.allocations == SeededPort::kSeeds);
  const Outcome paged = run_loop(Seed::page);
  CHECK(paged.record.faults_of_pages.minor >= static_cast<std::int64_t>(SeededPort::kSeeds));
  const Outcome called = run_loop(Seed::call);
  if (called.uncounted.empty()) CHECK(called.calls == called.expected_calls + SeededPort::kSeeds);
}

TEST_CASE("the guard lets a clean loop pass, and ends one that makes another call") {
  const Outcome clean = run_loop(Seed::none, true);
  CHECK(clean.end == kerf::EndReason::ticks_done);
  CHECK(clean.guarded_call == "");
  const Outcome called = run_loop(Seed::call, true);
  CHECK(called.guarded_call == "write");
  CHECK(called.stopped);
  CHECK(called.end == kerf::EndReason::stopped);
  CHECK(called.planted > 0);
  CHECK(called.last_tick ==
        called.first_tick);  // a tick may drain a queue of packets; then it ends
  CHECK(called.record.ticks < 1500);
  CHECK(run_loop(Seed::lock, true).guarded_call == "futex");
  CHECK(run_loop(Seed::wake, true).guarded_call == "");
}

}  // namespace kerf::clean_loop_test

#endif
