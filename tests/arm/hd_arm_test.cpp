// SPDX-License-Identifier: Apache-2.0
// The adapter to libHD, above a library written from its documentation; the test gives the ticks.
#include "arm/hd_arm.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "arm/arm_error.hpp"
#include "tests/arm/mock_library.hpp"
#include "tests/support/errors.hpp"

namespace kerf::hd_arm_test {

using kerf::test::kUpright;
using kerf::test::Link;
using kerf::test::MockLibrary;
using kerf::test::test_ns;
using Force = std::array<double, 3>;
using Lines = std::vector<std::string>;

namespace {

/// An arm on a library that waits for the test; open and started.
struct Bench {
  explicit Bench(const std::string& behaviour = "", bool starts = true)
      : library("mock_hd", "libHD.so", "manual" + (behaviour.empty() ? "" : "," + behaviour)),
        link(Personality::touch),
        arm({.library = library.path(), .has_name = true, .device_name = "Default Device"},
            link.exchange) {
    if (!starts) return;
    arm.open();
    arm.start();
    static_cast<void>(link.controller());
  }
  /// One tick at a pose; its report.
  std::optional<kerf::CartesianReport> at(const Force& position,
                                          const std::array<double, 9>& rotation = kUpright,
                                          int buttons = 0, bool is_docked = false) {
    library.pose(position, rotation, buttons, is_docked);
    library.tick();
    test_ns += 1'000'000;
    return link.report();
  }

  MockLibrary library;
  Link link;
  HdArm arm;
};

constexpr int kWarmUp = 5;  // two ticks without readings, three clean ones

}  // namespace

TEST_CASE("hd: the order of calls from the start to the end") {
  Bench bench;
  bench.library.tick(kWarmUp + 1);
  bench.link.exchange.let_go();
  for (int i = 0; i < 30; ++i, test_ns += 1'000'000) {
    bench.library.tick();  // 20 ms of zero force, then the callback ends
  }
  CHECK(bench.link.exchange.finished());
  bench.arm.stop();
  bench.arm.close();
  CHECK(bench.library.calls() == Lines{"hdInitDevice Default Device", "hdEnable 4000",
                                       "hdStartScheduler", "hdScheduleAsynchronous ffff",
                                       "hdStopScheduler", "hdDisableDevice"});
}

TEST_CASE("hd: a callback that has not ended is taken out of the scheduler") {
  Bench bench;
  bench.library.tick(10);
  bench.arm.stop();
  bench.arm.close();
  CHECK(bench.library.calls() == Lines{"hdInitDevice Default Device", "hdEnable 4000",
                                       "hdStartScheduler", "hdScheduleAsynchronous ffff",
                                       "hdStopScheduler", "hdUnschedule", "hdDisableDevice"});
}

TEST_CASE("hd: no report before three clean frames, and one in each tick after them") {
  Bench bench;
  bench.library.tick(kWarmUp);
  CHECK_FALSE(bench.link.report());
  bench.library.tick();
  CHECK(bench.link.report()->number == 1);
  bench.library.tick(10);
  CHECK(bench.link.report()->number == 11);
}

TEST_CASE("hd: axes are kerf's own, in mm") {
  Bench bench;
  bench.library.tick(kWarmUp);
  using Um = std::array<std::int32_t, 3>;
  CHECK(bench.at({10, 0, 0})->position_um == Um{10'000, 0, 0});
  CHECK(bench.at({0, 20, 0})->position_um == Um{0, 20'000, 0});
  CHECK(bench.at({0, 0, -30.5})->position_um == Um{0, 0, -30'500});
}

TEST_CASE("hd: each axis of a force arrives on its own, at once") {
  Bench bench;
  bench.library.tick(kWarmUp + 1);
  bench.link.command({1000, 0, 0});
  bench.library.tick();
  CHECK(bench.library.force() == Force{1, 0, 0});
  bench.link.command({0, -2000, 0});
  bench.library.tick();
  CHECK(bench.library.force() == Force{0, -2, 0});
  bench.link.command({0, 0, 3000});
  bench.library.tick();
  CHECK(bench.library.force() == Force{0, 0, 3});
}

TEST_CASE("hd: the tool's shaft is the stylus's +z") {
  Bench bench;
  bench.library.tick(kWarmUp);
  using Q = std::array<std::int16_t, 4>;
  constexpr std::int16_t h = 23170;
  // The stylus as the library reports it: its +z, the end that is held, to the user. Such a shaft
  // lies: Rx(90 degrees) from one that points up.
  CHECK(bench.at({}, {1, 0, 0, 0, 1, 0, 0, 0, 1})->orientation == Q{h, 0, 0, h});
  // Its +z up, its +y away from the user: the shaft points up, and nothing else is turned.
  CHECK(bench.at({}, {1, 0, 0, 0, 0, 1, 0, -1, 0})->orientation == Q{0, 0, 0, 32767});
  // Upright and then a quarter turn about the vertical, to the left seen from above.
  const auto q = bench.at({}, {0, -1, 0, 0, 0, 1, -1, 0, 0})->orientation;
  CHECK((q == Q{0, h, 0, h} || q == Q{0, -h, 0, -h}));
  // Its +z to the right: the shaft points to the right.
  const auto r = bench.at({}, {0, 0, 1, 1, 0, 0, 0, 1, 0})->orientation;
  const auto along = [](const Q& of, int axis) {  // where +y of the tool points, times 32767^2
    const double x = of[0], y = of[1], z = of[2], w = of[3];
    const std::array<double, 3> shaft{2 * (x * y - w * z), w * w + y * y - x * x - z * z,
                                      2 * (y * z + w * x)};
    return shaft[static_cast<std::size_t>(axis)] / (32767.0 * 32767.0);
  };
  CHECK(along(r, 0) == doctest::Approx(1).epsilon(0.001));
}

TEST_CASE("hd: buttons, and the inkwell parks") {
  Bench bench;
  bench.library.tick(kWarmUp);
  const auto docked = bench.at({0, -110, -35}, kUpright, 0, true);
  CHECK((docked->parked && docked->homed && !docked->button1 && !docked->button2));
  const auto first = bench.at({}, kUpright, 1);
  CHECK((first->button1 && !first->button2 && !first->parked));
  const auto second = bench.at({}, kUpright, 2);
  CHECK((!second->button1 && second->button2));
}

TEST_CASE("hd: a position that is no number is left out, alone") {
  Bench bench("nan=10");
  bench.library.tick(9);
  CHECK(bench.link.report()->number == 4);
  bench.library.tick();
  CHECK_FALSE(bench.link.report());
  bench.library.tick(4);
  CHECK(bench.link.report()->number == 8);
}

TEST_CASE("hd: warm motors and the library's own limits are counted, and nothing stops") {
  for (const char* const code : {"200", "201", "202", "203"}) {
    Bench bench("error=" + std::string(code) + "@10");
    bench.library.tick(20);
    CHECK(bench.link.report()->number == 15);
    CHECK(bench.link.exchange.failure() == 0);
    bench.arm.stop();
    REQUIRE(bench.arm.errors().size() == 2);  // with those of the first ticks
    CHECK(bench.arm.errors()[0].second == 1);
  }
}

TEST_CASE("hd: another error spoils its frame") {
  Bench bench("error=104@10");
  bench.library.tick(20);
  // Tick 10 itself, and the three that have to be clean.
  CHECK(bench.link.report()->number == 20 - kWarmUp - 1 - 3);
  CHECK(bench.link.exchange.failure() == 0);
}

TEST_CASE("hd: a lost device, a fault of it or of its force end the force and fail") {
  for (const char* const code : {"204", "300", "302"}) {
    Bench bench("error=" + std::string(code) + "@10");
    bench.library.tick(9);
    bench.link.command({1000, 0, 0});
    bench.library.tick(1);
    CHECK(bench.library.force() == Force{});
    CHECK(bench.link.exchange.failure() == std::stoul(code, nullptr, 16));
    for (int i = 0; i < 25; ++i, test_ns += 1'000'000) bench.library.tick();
    CHECK(bench.link.exchange.finished());
    CHECK(bench.library.force() == Force{});
  }
}

TEST_CASE("hd: a device that never gives a clean frame is a failure with its error") {
  Bench bench("unset=100000");
  bench.library.tick(HdArm::kMostUnclean - 1);
  CHECK(bench.link.exchange.failure() == 0);
  bench.library.tick();
  CHECK(bench.link.exchange.failure() == 0x401);
  CHECK(bench.arm.text_of(0x401).find("401") != std::string::npos);
}

TEST_CASE("hd: an error that is over is not the reason for a later failure") {
  Bench bench("error=104@10");
  bench.library.tick(20);
  for (int i = 0; i < HdArm::kMostUnclean; ++i) bench.at({}, {});
  CHECK(bench.link.exchange.failure() == kerf::ArmExchange::kUnreadable);
}

TEST_CASE("hd: calibration is asked for in the inkwell alone, in the servo thread") {
  Bench bench("needs_update");
  bench.library.tick(kWarmUp);  // in the inkwell, by readings that are not to be trusted yet
  CHECK_FALSE(bench.at({}, kUpright, 0, false)->homed);
  CHECK(std::string(bench.arm.notice()).find("inkwell") != std::string::npos);
  bench.library.tick(300);
  for (const std::string& call : bench.library.calls()) {
    CHECK(call.find("undocked") == std::string::npos);
  }
  bench.library.pose({0, -110, -35}, kUpright, 0, true);
  bench.library.tick(210);
  CHECK(bench.link.report()->homed);
  CHECK(std::string(bench.arm.notice()).empty());
}

TEST_CASE("hd: a calibration that is lost ends the force in the frame that sees it, at each tick") {
  for (int lost = 20; lost < 140; lost += 7) {
    CAPTURE(lost);
    Bench bench("uncalibrated=" + std::to_string(lost));
    bench.library.tick(kWarmUp);
    bench.library.pose({}, kUpright, 0, false);
    for (int tick = kWarmUp + 1; tick < lost; ++tick, test_ns += 1'000'000) {
      bench.link.command({1000, 0, 0});
      bench.library.tick();
    }
    CHECK(bench.library.force() == Force{1, 0, 0});
    CHECK(bench.link.report()->homed);
    bench.link.command({1000, 0, 0});
    bench.library.tick();
    CHECK(bench.library.force() == Force{});
    CHECK_FALSE(bench.link.report()->homed);
  }
}

TEST_CASE("hd: what cannot be opened is one line") {
  const auto line = [](const std::string& behaviour) {
    Bench bench(behaviour, false);
    return kerf::test::error_of([&] {
      bench.arm.open();
      bench.arm.start();
    });
  };
  CHECK(line("init_error")
            .starts_with(
                "device 'Default Device': cannot be opened (error 300: error of the mock); "));
  CHECK(line("garbage_handle").find("an invalid handle") != std::string::npos);
  CHECK(line("start_error").starts_with("hdStartScheduler: error 304: "));
  CHECK(line("schedule_error").starts_with("hdScheduleAsynchronous: error 501: "));
}

TEST_CASE("hd: errors of the start reach the main thread, however early the servo thread ticks") {
  const auto line = [](const std::string& behaviour) {
    Bench bench(behaviour + ",early_ticks", false);
    return kerf::test::error_of([&] {
      bench.arm.open();
      bench.arm.start();
    });
  };
  CHECK(line("start_error").starts_with("hdStartScheduler: error 304: "));
  CHECK(line("schedule_error").starts_with("hdScheduleAsynchronous: error 501: "));
  Bench bench("early_ticks");
  CHECK(bench.link.exchange.frames() == 0);
  bench.library.tick();
  CHECK(bench.link.exchange.frames() == 1);
}

TEST_CASE("hd: a missing library and missing symbols are one line each") {
  Link link(Personality::touch);
  const auto load = [&](const std::string& path) {
    return kerf::test::error_of(
        [&] { HdArm({.library = path, .has_name = true, .device_name = "x"}, link.exchange); });
  };
  const MockLibrary lacking("mock_hd_lacking", "libHD.so", "");
  const std::string missing = load(lacking.path());
  CHECK(missing.find(": lacks hdBeginFrame, hdEndFrame; install ") != std::string::npos);
  CHECK(load("/nowhere/libHD.so").find("/nowhere/libHD.so") != std::string::npos);
  const kerf::test::TemporaryFolder folder;
  const std::string text = folder.write("libHD.so", "not a library").string();
  CHECK(load(text).find('\n') == std::string::npos);
  CHECK(load(text).find("--library PATH") != std::string::npos);
}

TEST_CASE("hd: a library that gives no names does no harm") {
  Bench bench("null_strings");
  CHECK(bench.arm.facts().size() == 6);
}

}  // namespace kerf::hd_arm_test
