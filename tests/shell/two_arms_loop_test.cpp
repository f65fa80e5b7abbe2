// SPDX-License-Identifier: Apache-2.0
// The loop around two devices: whatever happens to either, the run with both exchanged is the same.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/devices.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/loop/tick_source.hpp"
#include "controller/plan/compile.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/server.hpp"
#include "shared/wire/cartesian.hpp"
#include "tests/servo/two_arms_support.hpp"

namespace kerf::two_arms_loop_test {

using namespace kerf::test;

namespace {

constexpr std::uint64_t kGoneTicks = 300, kMostTicks = 1800;

/// Docks, takes the tool, and cuts a groove.
Hand works(int tick) {
  if (tick < 100) return {.parked = true};
  return stroke(tick - 250);
}
Hand silent_within(int tick, int from, int to) {
  Hand hand = works(tick);
  hand.silent = tick >= from && tick < to;
  return hand;
}

struct Course {
  const char* name;
  Hand (*at)(int tick);
};
const std::array kCourses{
    Course{"works", works},
    Course{"never reports", [](int) { return Hand{.silent = true}; }},
    Course{"stays parked", [](int) { return Hand{.parked = true}; }},
    Course{"has no power", [](int) { return Hand{.parked = true, .homed = false}; }},
    Course{"is not parked", [](int) { return Hand{}; }},
    Course{"comes late",
           [](int tick) { return tick < 1000 ? Hand{.silent = true} : works(tick - 1000); }},
    Course{"goes at work", [](int tick) { return silent_within(tick, 700, 100'000); }},
    Course{"goes early", [](int tick) { return silent_within(tick, 400, 100'000); }},
    Course{"goes and comes back", [](int tick) { return silent_within(tick, 500, 1100); }},
    Course{"misses some",
           [](int tick) { return silent_within(tick, tick / 50 * 50, tick / 50 * 50 + 4); }},
    Course{"jumps",
           [](int tick) {
             Hand hand = works(tick);
             if (tick == 600) hand.at[0] += 40;
             return hand;
           }},
};

/// An omega or a Touch that plays a course, one packet a tick; each 64th comes with one that is
/// none. Counts what it is sent.
class CoursePort final : public PacketPort {
 public:
  explicit CoursePort(const Course& course) : course_(course) {}
  std::size_t receive(std::span<std::uint8_t> packet) noexcept override {
    if (std::exchange(given_, false)) return 0;
    const Hand hand = course_.at(tick++);
    if (hand.silent) return 0;
    given_ = true;
    if (tick % 64 == 0) return 1;  // no report: the driver reads on, and finds no other
    CartesianReport report;
    report.number = static_cast<std::uint32_t>(tick);
    report.parked = hand.parked;
    for (std::size_t i = 0; i < 3; ++i) {
      report.position_um[i] = static_cast<std::int32_t>(hand.at[i] * 1000);
    }
    report.homed = true;
    report.powered = hand.homed;
    const auto bytes = encode(report);
    std::ranges::copy(bytes, packet.begin());
    return bytes.size();
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = decode_cartesian_command(packet);
    sent.push_back(command ? *command : CartesianCommand{});
    return true;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int milliseconds) noexcept override {
    waits.push_back(milliseconds);
    return !course_.at(tick).silent;
  }

  int tick = 0;
  std::vector<CartesianCommand> sent;
  std::vector<int> waits;

 private:
  const Course& course_;
  bool given_ = false;
};

/// Ticks that the clock skips before one tick.
struct Skip {
  std::uint64_t before = 0, ticks = 0;
};

/// Ticks as fast as they go, with stalls that the watchdog or the clock finds.
struct StallingClock final : TickSource {
  StallingClock(LoopSignals& of, const Skip& skipped) : signals(of), skip(skipped) {}
  std::int64_t wait_next() noexcept override {
    ++tick;
    if (tick == 520) signals.stalled = true;
    return 0;
  }
  [[nodiscard]] std::uint64_t overruns() const noexcept override {
    return tick >= skip.before ? skip.ticks : 0;
  }
  [[nodiscard]] std::int64_t start_ns(std::uint64_t of) const noexcept override {
    return static_cast<std::int64_t>(of) * 1'000'000;
  }
  [[nodiscard]] bool takes_time() const noexcept override { return false; }
  [[nodiscard]] bool stood_still() const noexcept override { return tick == 800; }

  LoopSignals& signals;
  Skip skip;
  std::uint64_t tick = 0;
};

/// A run of the loop, and all that it leaves.
struct LoopRun {
  LoopRun(LoadedScene scene, const Course& first, const Course& second,
          std::uint64_t armed_ticks = 1200, const Skip& skip = {})
      : ports{CoursePort(first), CoursePort(second)} {
    std::array drivers{make_driver(scene.device.personality, ports[0]),
                       make_driver(scene.second->device.personality, ports[1])};
    const auto servo = plan_scene(scene);
    const std::string json = canonical_json(scene);
    auto segment = SegmentWriter::create(segment_spec(scene, json, 0));
    SegmentServer server("loop-" + std::to_string(getpid()), segment, {.tools = 2, .arms = 2});
    servo->take(scene);
    Publisher eyes(segment, *servo);
    std::atomic<bool> stop{false};
    LoopSignals signals{stop};
    StallingClock clock(signals, skip);
    const LoopLimits limits{
        .armed_ticks = armed_ticks, .gone_ticks = kGoneTicks, .arming_ticks = kMostTicks};
    end = run_servo(clock, {*drivers[0], drivers[1].get()}, *servo, eyes, server, limits, signals,
                    record);
    ticks = signals.heartbeat;
    for (std::size_t arm = 0; arm < kMaxArms; ++arm) waiting[arm] = signals.waiting[arm];
    const SegmentReader reader = SegmentReader::map(segment.fd());
    for (std::uint64_t i = 0; i < reader.state_head(); ++i) {
      auto& records = published.emplace_back();
      for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
        REQUIRE(reader.state_at(i, records[arm], arm) == ReadState::ok);
        REQUIRE(records[arm].tick == i + 1);
        // Of both arms, in the order of the arms; and of the time.
        records[arm].volume_hash = 0;
        records[arm].crc32c = 0;
      }
    }
    VolumeSnapshot snapshot;
    reader.update(0, snapshot);
    const auto density = servo->density(0);
    is_published_whole = std::ranges::equal(snapshot.density, density);
    volume_hash = density_hash(density);
  }

  std::array<CoursePort, kMaxArms> ports;
  RunRecord record;
  EndReason end{};
  std::uint64_t ticks = 0, volume_hash = 0;
  std::array<Waiting, kMaxArms> waiting{};
  std::vector<std::array<TickRecord, kMaxArms>> published;
  bool is_published_whole = false;
};

std::multiset<std::string> texts(const EventList& events) {
  std::multiset<std::string> out;
  for (const auto& event : events.kept()) {
    out.insert(std::to_string(event.tick) + " " + event.name);
  }
  return out;
}

void check_same(const ArmRecord& a, const ArmRecord& b) {
  CHECK(a.in_use == b.in_use);
  CHECK(a.stale_ticks == b.stale_ticks);
  CHECK(a.contact_ticks == b.contact_ticks);
  CHECK(a.shaft_ticks == b.shaft_ticks);
  CHECK(a.peak_force_n == b.peak_force_n);
  CHECK(a.absorbed_mj == b.absorbed_mj);
  CHECK(a.port_minimum_mj == b.port_minimum_mj);
  CHECK(a.energy_mj == b.energy_mj);
  CHECK(a.output_hash == b.output_hash);
  CHECK(texts(a.faults) == texts(b.faults));
}

/// The end that two courses have, from the courses alone.
std::uint64_t last_tick(const Course& one, const Course& other) {
  std::uint64_t silent_one = 0, silent_other = 0;
  for (std::uint64_t tick = 1; tick <= kMostTicks; ++tick) {
    silent_one = one.at(static_cast<int>(tick) - 1).silent ? silent_one + 1 : 0;
    silent_other = other.at(static_cast<int>(tick) - 1).silent ? silent_other + 1 : 0;
    if (std::min(silent_one, silent_other) >= kGoneTicks) return tick;
  }
  return kMostTicks;
}

/// Ticks without a report since the tool was taken, but for those in `gone`, from the records.
std::uint64_t stale_ticks_of(const LoopRun& run, std::size_t arm,
                             const std::vector<std::array<std::uint64_t, 2>>& gone) {
  std::uint64_t count = 0;
  for (const auto& records : run.published) {
    const TickRecord& record = records[arm];
    const bool is_gone = std::ranges::any_of(gone, [&](const auto& from_to) {
      return record.tick > from_to[0] && record.tick <= from_to[1];
    });
    if ((record.flags & kFlagStarted) != 0 && !is_gone) count += record.stale;
  }
  return count;
}

LoadedScene cutting_scene() {
  LoadedScene scene = two_armed(kCutKinds[0], 1.5);
  scene.tools[0] = ball(8);
  scene.second->limits.slew_n_per_ms = 0.3;
  return scene;
}

}  // namespace

TEST_CASE("two devices that are exchanged make the same run, whatever happens to either") {
  const LoadedScene scene = cutting_scene();
  const auto compare = [&](const Course& one, const Course& other) {
    CAPTURE(std::string(one.name));
    CAPTURE(std::string(other.name));
    const LoopRun ahead(scene, one, other), behind(exchanged(scene), other, one);
    CHECK(ahead.end == behind.end);
    CHECK(ahead.ticks == behind.ticks);
    // A run ends when its time is up, or both devices are gone, never by one of them.
    if (ahead.end == EndReason::device_gone) CHECK(ahead.ticks == last_tick(one, other));
    if (ahead.end == EndReason::ticks_done) CHECK(ahead.ticks < last_tick(one, other));
    for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
      CAPTURE(arm);
      RunRecord a = ahead.record, b = behind.record;
      check_same(a.arm(arm), b.arm(1 - arm));
      CHECK(ahead.waiting[arm] == behind.waiting[1 - arm]);
      CHECK(ahead.ports[arm].sent == behind.ports[1 - arm].sent);
      REQUIRE(ahead.published.size() == behind.published.size());
      for (std::size_t i = 0; i < ahead.published.size(); ++i) {
        REQUIRE(std::memcmp(&ahead.published[i][arm], &behind.published[i][1 - arm],
                            sizeof(TickRecord)) == 0);
      }
    }
    CHECK(ahead.record.ticks == behind.record.ticks);
    CHECK(ahead.record.armed_at_tick == behind.record.armed_at_tick);
    CHECK(ahead.record.removed_steps == behind.record.removed_steps);
    CHECK(ahead.record.has_faults() == behind.record.has_faults());
    CHECK((ahead.record.first_force_ns > 0) == (behind.record.first_force_ns > 0));
    CHECK(texts(ahead.record.events) == texts(behind.record.events));
    CHECK(ahead.volume_hash == behind.volume_hash);
    CHECK(ahead.is_published_whole);
    CHECK(behind.is_published_whole);
  };
  for (std::size_t one = 0; one < kCourses.size(); ++one) {
    compare(kCourses[one], kCourses[0]);
    const std::size_t other = (4 * one + 7) % kCourses.size();
    if (other != 0) compare(kCourses[one], kCourses[other]);
  }
}

TEST_CASE("one device at work is a run, whichever it is") {
  const LoadedScene scene = cutting_scene();
  for (const std::size_t other : {1U, 2U, 3U, 4U}) {
    for (const bool is_second : {false, true}) {
      const Course& idle = kCourses[other];
      CAPTURE(std::string(idle.name));
      CAPTURE(is_second);
      const LoopRun run(scene, is_second ? idle : kCourses[0], is_second ? kCourses[0] : idle);
      CHECK(run.end == EndReason::ticks_done);
      CHECK(run.record.ticks == 1200);
      CHECK(run.record.armed_at_tick == 101);
      CHECK(run.record.first_force_ns > 0);
      RunRecord record = run.record;
      CHECK(record.arm(is_second ? 1 : 0).in_use);
      CHECK(record.arm(is_second ? 1 : 0).contact_ticks > 200);
      CHECK_FALSE(record.arm(is_second ? 0 : 1).in_use);
      CHECK(run.record.removed_steps[0] > 0);
      CHECK(run.waiting[is_second ? 1 : 0] == Waiting::nothing);
      CHECK(run.waiting[is_second ? 0 : 1] != Waiting::nothing);
    }
  }
}

TEST_CASE("ticks that the clock skips make no silence longer, and stand in the log of both arms") {
  const LoadedScene scene = cutting_scene();
  const Course& silent = kCourses[7];  // from its 401st tick on; stale after 20 ms
  struct Row {
    std::uint64_t skipped, stale_at;
  };
  for (const Row& row : {Row{0, 420}, Row{7, 413}, Row{100'000, 405}}) {
    for (const std::size_t arm : {0U, 1U}) {
      CAPTURE(row.skipped);
      CAPTURE(arm);
      const LoopRun run(scene, arm == 0 ? silent : kCourses[0], arm == 1 ? silent : kCourses[0],
                        600, {405, row.skipped});
      RunRecord record = run.record;
      REQUIRE(record.arm(arm).faults.count > 0);
      CHECK(record.arm(arm).faults.kept()[0].tick == row.stale_at);
      CHECK(record.arm(1 - arm).faults.count == 0);
      for (const auto& records : run.published) {
        const std::uint64_t missed =
            records[0].tick == 405 ? std::min<std::uint64_t>(row.skipped, kMostMissed) : 0;
        for (const TickRecord& one : records) {
          const std::uint32_t logged = one.command >> kCommandMissedShift;
          REQUIRE(logged == missed);
        }
      }
    }
  }
}

TEST_CASE("a device that goes twice is gone twice, and what it loses between is counted") {
  const LoadedScene scene = cutting_scene();
  const Course twice{"goes twice", [](int tick) {
                       Hand hand = works(tick);
                       const auto within = [&](int from, int ticks) {
                         return tick >= from && tick < from + ticks;
                       };
                       hand.silent = within(400, 400) || within(950, 4) || within(1000, 400) ||
                                     within(1500, 3);
                       if (within(820, 80) || within(1410, 80)) hand = {.parked = true};
                       return hand;
                     }};
  for (const std::size_t arm : {0U, 1U}) {
    CAPTURE(arm);
    const LoopRun run(scene, arm == 0 ? twice : kCourses[0], arm == 1 ? twice : kCourses[0], 1500);
    CHECK(run.end == EndReason::ticks_done);
    RunRecord record = run.record;
    std::string faults;
    for (const auto& event : record.arm(arm).faults.kept()) {
      faults += std::to_string(event.tick) + " " + event.name + " ";
    }
    CHECK(faults == "420 stale_input 700 device_gone 1020 stale_input 1300 device_gone ");
    // Each 64th packet is none, and two gaps have seven ticks. The first number after a long gap is
    // not believed: the device is not back before the next.
    CHECK(record.arm(arm).stale_ticks == stale_ticks_of(run, arm, {{400, 801}, {1000, 1401}}));
    CHECK(record.arm(1 - arm).stale_ticks == stale_ticks_of(run, 1 - arm, {}));
    CHECK(record.arm(1 - arm).faults.count == 0);
    CHECK(record.has_faults());
    CHECK(run.waiting[arm] == Waiting::nothing);
  }
}

TEST_CASE("a command is read back from the records of both arms, whichever got it") {
  using enum ServoCommand::Kind;
  for (const std::uint32_t arm : {0U, 1U}) {
    for (const auto kind : {none, select_tool, hold, reset, undo, redo, mark}) {
      for (const bool fade_in : {false, true}) {
        CAPTURE(static_cast<int>(kind));
        const std::uint32_t missed = fade_in ? kMostMissed : 3;
        const TickCommands given{
            {kind, kind == select_tool || kind == hold ? 1U : 0U, kind == select_tool ? arm : 0},
            fade_in,
            missed,
            7};
        std::array<TickRecord, kMaxArms> records{};
        for (std::size_t a = 0; a < kMaxArms; ++a) {
          records[a] = record_of({}, commands_for(a, given), {});
          // A tool of the other arm is none; all else, a stall too, is in both.
          const bool is_mine = kind != select_tool || a == arm;
          CHECK((records[a].command & kCommandKind) ==
                (is_mine ? static_cast<std::uint32_t>(kind) : 0U));
          CHECK(((records[a].command & kCommandFadeIn) != 0) == fade_in);
          CHECK(records[a].last_command == 7);
        }
        const TickCommands read = commands_of(records);
        CHECK(read.command.kind == given.command.kind);
        CHECK(read.command.argument == given.command.argument);
        CHECK(read.command.arm == given.command.arm);
        CHECK(read.fade_in == fade_in);
        CHECK(read.missed == missed);
        CHECK(read.last_index == 7);
      }
    }
  }
}

TEST_CASE("the loop stands still once for each stall, however many come") {
  StandstillWatch watch;
  std::int64_t now_ns = 1000;
  CHECK_FALSE(watch.stood_still(now_ns));
  for (int cycle = 0; cycle < 3; ++cycle) {
    for (int i = 0; i < 100; ++i) CHECK_FALSE(watch.stood_still(now_ns += kStandstillNs - 1));
    CHECK(watch.stood_still(now_ns += kStandstillNs));
    CHECK_FALSE(watch.stood_still(now_ns += 1'000'000));
  }
}

TEST_CASE("the watchdog measures each standstill from the last tick, not from the first") {
  std::array<CoursePort, kMaxArms> ports{CoursePort(kCourses[0]), CoursePort(kCourses[0])};
  const auto first = make_driver(Personality::omega, ports[0]);
  const auto second = make_driver(Personality::touch, ports[1]);
  std::atomic<bool> stop{false};
  LoopSignals signals{stop};
  Watchdog watchdog({*first, second.get()}, signals);
  std::int64_t now_ns = 0;
  std::size_t stalls = 0;
  for (int cycle = 0; cycle < 4; ++cycle) {
    for (int i = 0; i < 50; ++i) {
      ++signals.heartbeat;
      watchdog.look(now_ns += 15'000'000);
      watchdog.look(now_ns += 4'000'000);  // 19 ms after the tick is no standstill
      CHECK(watchdog.trips() == stalls);
    }
    ++signals.heartbeat;
    watchdog.look(now_ns += 5'000'000);
    for (int i = 0; i < 20; ++i) watchdog.look(now_ns += 5'000'000);
    CHECK(watchdog.trips() == ++stalls);
    for (const CoursePort& port : ports) CHECK(port.sent.size() == stalls);
    CHECK(signals.stalled.exchange(false));
  }
}

TEST_CASE("of a tick that stood still itself no device gets anything, of the next one each") {
  std::array<CoursePort, kMaxArms> ports{CoursePort(kCourses[0]), CoursePort(kCourses[0])};
  const auto first = make_driver(Personality::omega, ports[0]);
  const auto second = make_driver(Personality::touch, ports[1]);
  const Devices devices(*first, second.get());
  std::array<ServoOutput, kMaxArms> outputs;
  for (ServoOutput& out : outputs) {
    out.motors_on = true;
    out.dac_counts = {100, -200, 300};
  }
  outputs[1].dac_counts = {1, 2, 3};
  std::atomic<bool> stop{false};
  LoopSignals signals{stop};
  signals.stalled = true;
  send_tick(outputs, signals, devices);
  for (const CoursePort& port : ports) {
    REQUIRE(port.sent.size() == 1);
    CHECK_FALSE(port.sent[0].force_on);
  }
  signals.stalled = false;
  send_tick(outputs, signals, devices);
  for (std::size_t arm = 0; arm < kMaxArms; ++arm) {
    REQUIRE(ports[arm].sent.size() == 2);
    CHECK(ports[arm].sent[1].force_on);
    CHECK(ports[arm].sent[1].force_mn == outputs[arm].dac_counts);
  }
}

TEST_CASE("in lock-step each device is waited for, and a silent one alone no longer") {
  for (const std::size_t silent : {0U, 1U}) {
    CAPTURE(silent);
    std::array<CoursePort, kMaxArms> ports{CoursePort(kCourses[silent == 0 ? 1 : 0]),
                                           CoursePort(kCourses[silent == 1 ? 1 : 0])};
    const auto first = make_driver(Personality::omega, ports[0]);
    const auto second = make_driver(Personality::touch, ports[1]);
    LockStepTicks ticks({*first, second.get()}, 1'000'000);
    for (int tick = 0; tick < 4; ++tick) CHECK(ticks.wait_next() == 0);
    CHECK(ports[silent].waits == std::vector{2000, 0, 0, 0});
    CHECK(ports[1 - silent].waits == std::vector{2000, 2000, 2000, 2000});
  }
}

}  // namespace kerf::two_arms_loop_test
