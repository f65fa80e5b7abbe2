// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/open_port.hpp"
#include "hil/program/program.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

namespace {

const std::atomic<bool> kGoOn{false};

struct Outcome {
  int code = -1;
  std::string out, err;
};

Outcome run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "kerf-emulator");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, err;
  const int code = kerf::run_emulator(static_cast<int>(argv.size()), argv.data(), kGoOn, out, err);
  return {code, out.str(), err.str()};
}

/// Serves `device` while a host opens `port` in the folder, says `packet` and hears an answer.
void serve_once(const std::string& device, const std::string& bus, const std::string& node,
                std::span<const std::uint8_t> packet) {
  const kerf::test::TempFolder folder;
  std::vector<std::string> arguments{"--personality", device,        "--front",    "fuse",
                                     "--mount",       folder.path(), "--priority", "0"};
  if (device == "falcon") arguments.push_back("--firmware-runs");
  Outcome outcome;
  std::thread emulator([&] { outcome = run(arguments); });
  {
    const std::string place = folder.path() + "/" + node;
    const auto port = kerf::open_port(bus + ":" + place, {}, 5000, kGoOn);
    port->send(packet);
    CHECK(port->wait(1000));
  }
  emulator.join();
  CHECK(outcome.code == 0);
  CHECK(outcome.err == "");
  CHECK(outcome.out == "kerf-emulator: " + device + " at " + folder.path() + "/" + node + "\n");
  CHECK(std::filesystem::is_empty(folder.path()));
}

}  // namespace

TEST_CASE("kerf-emulator --front fuse is a Falcon or a WoodenHaptics arm for one client") {
  serve_once("falcon", "usb", "usb", encode(kerf::FalconCommand{}));
  serve_once("woodenhaptics", "hid", "hidraw0", encode(kerf::WoodenCommand{}));
}

TEST_CASE("--seconds ends an emulator whose node nobody opens") {
  for (const std::vector<std::string>& device :
       {std::vector<std::string>{"omni"}, {"omni", "--lockstep"}, {"falcon"}, {"woodenhaptics"}}) {
    CAPTURE(device.front());
    const kerf::test::TempFolder folder;
    std::vector<std::string> arguments{"--front", "fuse",         "--mount", folder.path(),
                                       "--stay",  "--priority",   "0",       "--seconds",
                                       "0.1",     "--personality"};
    arguments.insert(arguments.end(), device.begin(), device.end());
    CHECK(run(arguments).code == 0);
    CHECK(std::filesystem::is_empty(folder.path()));
  }
}

TEST_CASE("kerf-emulator --front fuse knows the faults and the limits of each bus") {
  const kerf::test::TempFolder folder;
  const auto refused = [&](const std::string& device, std::vector<std::string> more) {
    more.insert(more.begin(), {"--personality", device, "--front", "fuse", "--mount", folder.path(),
                               "--priority", "0"});
    const Outcome outcome = run(more);
    CHECK(outcome.code == 2);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    return outcome.err;
  };
  CHECK(refused("falcon", {"--bus-fault", "1:steal"})
            .find("1:steal is not SECONDS:KIND with one of stall, split, deaf, vanish, back") !=
        std::string::npos);
  CHECK(refused("omni", {"--bus-fault", "1:stall"}).find("one of reset, device-reset") !=
        std::string::npos);
  CHECK(
      refused("woodenhaptics", {"--lockstep"}).find("--lockstep: the USB front runs by its own") !=
      std::string::npos);
  CHECK(refused("omni", {"--firmware-runs"}).find("--firmware-runs: omni has no such thing") !=
        std::string::npos);
}

TEST_CASE("kerf-emulator --describe tells the torque of a motor count, without any front") {
  CHECK(run({"--describe"}).out == "torque_scale=0.342,0.342,0.342\n");
  CHECK(run({"--personality", "falcon", "--describe"}).out == "torque_scale=0.1,0.1,0.1\n");
  CHECK(run({"--personality", "woodenhaptics", "--describe"}).out ==
        "torque_scale=0.4144,0.3108,0.3108\n");
}
