// SPDX-License-Identifier: Apache-2.0
// What a run of two devices says of the one that it waits for.
#include <array>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/programs/two_arms.hpp"

namespace kerf::two_arms_waits_test {

using kerf::test::eventually;
using kerf::test::kScenes;
using kerf::test::TwoArms;
using namespace std::chrono_literals;

TEST_CASE("one of two devices waits for its user: its number and its own words, once") {
  const std::string home = "waiting until homed: pull the grip all the way out, then push it in";
  for (const int idle : {0, 1}) {
    CAPTURE(idle);
    const std::string number = std::to_string(idle + 1), other = std::to_string(2 - idle);
    TwoArms run;
    run.write_scene(idle == 0 ? std::array<std::string, 2>{"falcon", "omni"}
                              : std::array<std::string, 2>{"omni", "falcon"},
                    idle == 0
                        ? std::array<std::string, 2>{"", "torque_scale = [0.342, 0.342, 0.342]"}
                        : std::array<std::string, 2>{"torque_scale = [0.342, 0.342, 0.342]", ""});
    run.emulate(static_cast<std::size_t>(idle), "falcon", {"--lockstep"});
    run.emulate(static_cast<std::size_t>(1 - idle), "omni",
                {"--lockstep", "--hand", kScenes + "/hands/touch.toml"});
    run.control({"--virtual"});
    const std::string line = "kerf-controller: arm " + number + ": " + home + "\n";
    CHECK(eventually([&] { return run.times_said(line) > 0; }, 30s));
    std::this_thread::sleep_for(1500ms);
    CHECK(run.times_said(line) == 1);
    CHECK(run.times_said("arm " + other + ": waiting until homed") == 0);
    CHECK(run.times_said("arm " + number +
                         ": device.torque_scale is not set for falcon: the motors stay off") == 1);
    CHECK(run.times_said("device.torque_scale is not set") == 1);
    run.controller->signal(SIGTERM);
    const int code = run.controller->wait();
    CAPTURE(run.controller->output());
    CHECK(code == 0);
    CHECK(run.report()["waiting"] == "arm " + number + ": " + home);
  }
}

TEST_CASE("before there is a device, what is waited for is the port that does not answer yet") {
  const auto stopped = [](TwoArms& run) {
    REQUIRE(eventually([&] { return run.controller->catches(SIGTERM); }, 20s));
    REQUIRE(eventually([&] { return run.times_said("waiting for") > 0; }, 20s));
    run.controller->signal(SIGTERM);
    CHECK(run.controller->wait() == 0);
    return run.report()["waiting"].get<std::string>();
  };
  const std::string waits = "waiting for a device that answers at --port ";
  {
    TwoArms run;
    run.write_scene({"omni", "falcon"});
    run.emulate(0, "omni", {});
    run.control({});
    CHECK(stopped(run) == waits + "socket:" + run.socket(1));
  }
  {
    TwoArms run;  // a kerf-arm with a name is waited for, and not started
    run.write_scene({"omega", "touch"});
    run.control({}, {"arm:left", "arm:right"});
    CHECK(stopped(run) == waits + "arm:left");
  }
}

}  // namespace kerf::two_arms_waits_test
