// SPDX-License-Identifier: Apache-2.0
// The adapter to libdrd, above a library written from its documentation; the test gives the cycles.
#include "arm/dhd_arm.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/arm/mock_library.hpp"
#include "tests/support/errors.hpp"

namespace kerf::dhd_arm_test {

using kerf::test::kUpright;
using kerf::test::Link;
using kerf::test::MockLibrary;
using kerf::test::test_ns;
using Force = std::array<double, 3>;
using Lines = std::vector<std::string>;

namespace {

struct Bench {
  struct How {
    bool opens = true;
    bool is_peak_given = false;
    bool initializes = false;
    int rate_hz = 1000;
    kerf::ArmExchange::Clock* clock = kerf::test::test_clock;
  };
  explicit Bench(const std::string& behaviour = "") : Bench(behaviour, How{}) {}
  Bench(const std::string& behaviour, const How& how)
      : library("mock_drd", "libdrd.so.3", behaviour),
        link(Personality::omega, how.rate_hz, how.clock),
        arm({.library = library.path(),
             .index = -1,
             .rate_hz = how.rate_hz,
             .is_peak_given = how.is_peak_given,
             .initializes = how.initializes,
             .priority = 0,
             .core = -1},
            link.exchange),
        period_ns(1'000'000'000 / how.rate_hz) {
    if (!how.opens) return;
    arm.open();
    static_cast<void>(link.controller());
  }
  void cycle(int cycles = 1) {
    for (int i = 0; i < cycles; ++i, test_ns += period_ns) arm.frame();
  }
  std::optional<kerf::CartesianReport> at(const Force& position_m, int buttons = 0) {
    library.pose(position_m, kUpright, buttons);
    cycle();
    return link.report();
  }

  MockLibrary library;
  Link link;
  DhdArm arm;
  std::int64_t period_ns;
};

/// Cycles of zero force that the library was given.
std::ptrdiff_t zero_forces(const Lines& lines) {
  return std::ranges::count_if(lines, [](const std::string& line) {
    return line.starts_with("force ") && line.ends_with(" 0.000000 0.000000 0.000000");
  });
}

}  // namespace

TEST_CASE("dhd: the order of calls from the start to the end") {
  Bench bench("", {.clock = kerf::test::ticking_clock});
  bench.link.exchange.let_go();
  bench.arm.start();
  bench.arm.stop();
  bench.arm.close();
  CHECK(bench.library.calls() ==
        Lines{"drdOpen", "dhdSetWatchdog 160", "dhdEnableForce 1", "dhdEnableForce 0", "drdClose"});
  const auto all = bench.library.lines();
  CHECK(zero_forces(all) >= kerf::ArmExchange::kFewest);
  CHECK(all[all.size() - 2] == "dhdEnableForce 0");  // after the last of them
}

TEST_CASE("dhd: zero force for 20 ms at the end, at the slowest rate and at the fastest") {
  for (const int rate_hz : {200, 1000, 4000}) {
    CAPTURE(rate_hz);
    Bench bench("", {.rate_hz = rate_hz});
    bench.cycle(3);
    bench.link.exchange.let_go();
    const std::int64_t since_ns = test_ns;
    const auto before = zero_forces(bench.library.lines());
    while (!bench.link.exchange.finished()) bench.cycle();
    CHECK(test_ns - since_ns == 20'000'000 + bench.period_ns);  // the last one began after 20 ms
    CHECK(zero_forces(bench.library.lines()) - before == 20 * rate_hz / 1000 + 1);
  }
}

TEST_CASE("dhd: x to the user, y right, z up in m become x right, y up, z to the user in mm") {
  Bench bench;
  using Um = std::array<std::int32_t, 3>;
  CHECK(bench.at({0.01, 0, 0})->position_um == Um{0, 0, 10'000});
  CHECK(bench.at({0, 0.02, 0})->position_um == Um{20'000, 0, 0});
  CHECK(bench.at({0, 0, -0.0305})->position_um == Um{0, -30'500, 0});
  CHECK(bench.at({})->orientation == std::array<std::int16_t, 4>{0, 0, 0, 32767});
}

TEST_CASE("dhd: each axis of a force goes back into the SDK's") {
  Bench bench;
  bench.cycle();
  bench.link.command({1000, 0, 0});  // to the right: y
  bench.cycle();
  CHECK(bench.library.force() == Force{0, 1, 0});
  bench.link.command({0, -2000, 0});  // down: -z
  bench.cycle();
  CHECK(bench.library.force() == Force{0, 0, -2});
  bench.link.command({0, 0, 3000});  // to the user: x
  bench.cycle();
  CHECK(bench.library.force() == Force{3, 0, 0});
}

TEST_CASE("dhd: a force is sent in every cycle, zero ones too") {
  Bench bench;
  bench.cycle(50);
  CHECK(std::ranges::count_if(bench.library.lines(), [](const std::string& line) {
          return line.starts_with("force ");
        }) == 50);
}

TEST_CASE("dhd: button 0 parks, button 1 is the first button, homed by the SDK") {
  Bench bench;
  const auto held = bench.at({}, 1);
  CHECK((held->parked && !held->button1 && held->homed));
  const auto pressed = bench.at({}, 2);
  CHECK((!pressed->parked && pressed->button1 && !pressed->button2));
  Bench unknown("not_homed");
  CHECK_FALSE(unknown.at({})->homed);
  CHECK(std::string(unknown.arm.notice()).find("--auto-init") != std::string::npos);
}

TEST_CASE("dhd: the arm is moved by itself only if asked to") {
  Bench bench("not_homed");
  const auto moved = [](const Lines& calls) { return std::ranges::count(calls, "drdAutoInit"); };
  CHECK(moved(bench.library.calls()) == 0);
  Bench asked("not_homed", {.initializes = true});
  CHECK(moved(asked.library.calls()) == 1);
  CHECK(std::ranges::count(asked.library.calls(), "drdStop 1") == 1);
}

TEST_CASE("dhd: the arm never moves by itself without a watchdog, and has it afterwards") {
  Bench asked("not_homed", {.initializes = true});
  CHECK(asked.library.calls() == Lines{"drdOpen", "dhdSetWatchdog 160", "drdAutoInit", "drdStop 1",
                                       "dhdSetWatchdog 160", "dhdEnableForce 1"});
}

TEST_CASE("dhd: a device that brakes has no power until its parking button is held") {
  constexpr int kLookFrames = 5;  // the mode is read each 4 ms
  Bench bench("too_fast=100");
  bench.cycle(99);
  CHECK(bench.link.report()->powered);
  const auto enabled = [&] {
    return std::ranges::count(bench.library.calls(), "dhdEnableForce 1");
  };
  CHECK(enabled() == 1);
  bench.link.command({1000, 0, 0});
  bench.cycle(kLookFrames);
  const auto braked = bench.link.report();
  CHECK_FALSE(braked->powered);
  CHECK_FALSE(braked->parked);
  bench.cycle(500);
  CHECK_FALSE(bench.link.report()->powered);
  CHECK(enabled() == 1);  // no force of its own accord
  CHECK_FALSE(bench.at({}, 1)->powered);
  CHECK(enabled() == 2);
  bench.cycle(kLookFrames);
  const auto back = bench.link.report();
  CHECK((back->powered && back->parked));
}

TEST_CASE(
    "dhd: an initialisation that is lost ends the force within 4 ms and a frame, at any rate") {
  for (const int rate_hz : {200, 1000, 4000}) {
    for (int lost = 20; lost < 300; lost += 23) {
      CAPTURE(rate_hz);
      CAPTURE(lost);
      Bench bench("uncalibrated=" + std::to_string(lost), {.rate_hz = rate_hz});
      bench.cycle();
      const auto push = [&] {
        bench.link.command({1000, 0, 0});
        bench.cycle();
      };
      for (int cycle = 2; cycle < lost; ++cycle) push();
      CHECK(bench.library.force() == Force{0, 1, 0});
      const std::int64_t since_ns = test_ns;
      while (bench.library.force() != Force{} && test_ns - since_ns < 100'000'000) push();
      CHECK(test_ns - since_ns <= DhdArm::kLookNs + bench.period_ns);
      CHECK_FALSE(bench.link.report()->homed);
    }
  }
}

TEST_CASE("dhd: a device that is no omega opens only with a force that it bears") {
  const auto line = [](const std::string& behaviour) {
    Bench bench(behaviour, {.opens = false});
    return kerf::test::error_of([&] { bench.arm.open(); });
  };
  CHECK(line("type=60").starts_with("device of type 60, Falcon: no omega, "));
  CHECK(line("type=60").find("--peak N") != std::string::npos);
  CHECK(line("type=63").starts_with("device of type 63, delta.3: no omega, "));
  CHECK(line("type=111").starts_with("device of type 111, a type that kerf does not know: "));
  CHECK(line("type=0").starts_with("device type 0: none that the library knows; "));
  CHECK(line("type=-1").starts_with("device type -1: none that the library knows; "));
  for (const char* const omega : {"type=33", "type=34", "type=35", "type=36", "type=37"}) {
    CHECK(line(omega).empty());
  }
  Bench falcon("type=60", {.is_peak_given = true});
  REQUIRE(falcon.arm.warnings().size() == 1);
  CHECK(falcon.arm.warnings().front().starts_with("device of type 60, Falcon: no omega; "));
  CHECK(Bench("type=33").arm.warnings().empty());
  REQUIRE(Bench("type=35").arm.warnings().size() == 1);
  CHECK(Bench("type=35").arm.warnings().front().starts_with("device of type 35, omega.7: "));
}

TEST_CASE(
    "dhd: the watchdog by expert mode only if it must be, and none if the firmware has none") {
  Bench expert("expert_watchdog");
  CHECK(expert.arm.has_watchdog());
  CHECK(expert.library.calls() == Lines{"drdOpen", "dhdEnableExpertMode", "dhdSetWatchdog 160",
                                        "dhdDisableExpertMode", "dhdEnableForce 1"});
  Bench old("old_firmware");
  CHECK_FALSE(old.arm.has_watchdog());
  CHECK(old.arm.facts().back().second.starts_with("none: error 6"));
}

TEST_CASE("dhd: the ID of the open device goes with every call") {
  Bench bench("id=3");
  bench.cycle(3);
  CHECK(bench.link.report()->number == 3);
  CHECK(bench.arm.errors().empty());
}

TEST_CASE("dhd: a device that is gone for 100 ms fails; one that comes back earlier does not") {
  Bench brief("vanish=10,back=105");
  brief.cycle(200);
  CHECK(brief.link.exchange.failure() == 0);
  CHECK(brief.link.report()->number == 200 - 95);
  Bench gone("vanish=10");
  gone.cycle(9);
  gone.link.command({1000, 0, 0});
  gone.cycle(99);
  CHECK(gone.link.exchange.failure() == 0);
  gone.cycle();
  CHECK(gone.link.exchange.failure() == 2);
  CHECK(gone.arm.text_of(2).starts_with("the device cannot be read any more (error 2: "));
}

TEST_CASE(
    "dhd: gone for 100 ms is a time, at the slowest rate, at the fastest and for a slow loop") {
  for (const int rate_hz : {200, 4000}) {
    CAPTURE(rate_hz);
    Bench gone("vanish=10", {.rate_hz = rate_hz});
    gone.cycle(9);
    const std::int64_t read_ns = test_ns - gone.period_ns;
    while (test_ns - read_ns < 100'000'000) gone.cycle();
    CHECK(gone.link.exchange.failure() == 0);
    gone.cycle();
    CHECK(gone.link.exchange.failure() == 2);
  }
  Bench blocks("vanish=10", {.rate_hz = 4000});  // its calls take 40 ms
  blocks.cycle(9);
  for (int i = 0; i < 3; ++i) {
    CHECK(blocks.link.exchange.failure() == 0);
    test_ns += 40'000'000;
    blocks.cycle();
  }
  CHECK(blocks.link.exchange.failure() == 2);
  Bench stood("vanish=10,back=12", {.rate_hz = 4000});  // a thread without a core for a second
  stood.cycle(9);
  test_ns += 1'000'000'000;
  stood.cycle(10);
  CHECK(stood.link.exchange.failure() == 0);
}

TEST_CASE("dhd: a position that is no number is left out") {
  Bench bench("nan=10");
  bench.cycle(9);
  CHECK(bench.link.report()->number == 9);
  bench.cycle();
  CHECK_FALSE(bench.link.report());
  bench.cycle();
  CHECK(bench.link.report()->number == 10);
}

TEST_CASE("dhd: a saturated motor or a reused reading is no error") {
  Bench bench("saturated,reused");
  bench.cycle(10);
  CHECK(bench.link.report()->number == 10);
  CHECK(bench.arm.errors() ==
        std::vector<std::pair<std::string, std::uint64_t>>{{"saturated motor", 10}});
}

TEST_CASE("dhd: what cannot be opened is one line") {
  const auto line = [](const std::string& behaviour) {
    Bench bench(behaviour, {.opens = false});
    return kerf::test::error_of([&] { bench.arm.open(); });
  };
  CHECK(line("init_error").starts_with("device: cannot be opened (error 5: error of the mock); "));
  CHECK(line("version=4").find("SDK 4.17.5.0, and kerf-arm knows 3; ") != std::string::npos);
  Link link(Personality::omega);
  const MockLibrary lacking("mock_drd_lacking", "libdrd.so.3", "");
  CHECK(kerf::test::error_of([&] {
          DhdArm({.library = lacking.path()}, link.exchange);
        }).find(": lacks dhdEnableForce, dhdSetForce; install ") != std::string::npos);
}

}  // namespace kerf::dhd_arm_test
