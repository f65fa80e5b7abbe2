// SPDX-License-Identifier: Apache-2.0
#include "hil/program/program.hpp"

#include <atomic>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

namespace {

struct Outcome {
  int code = -1;
  std::string out, err;
};

Outcome run(std::vector<std::string> arguments, const std::atomic<bool>& stop) {
  arguments.insert(arguments.begin(), "kerf-emulator");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, err;
  const int code = kerf::run_emulator(static_cast<int>(argv.size()), argv.data(), stop, out, err);
  return {code, out.str(), err.str()};
}

const std::atomic<bool> kGoOn{false};

}  // namespace

TEST_CASE("kerf-emulator --front fuse serves one client, ends with it and unmounts") {
  const kerf::test::TempFolder folder;
  Outcome outcome;
  std::thread emulator([&] {
    outcome =
        run({"--front", "fuse", "--mount", folder.path(), "--lockstep", "--priority", "0"}, kGoOn);
  });
  {
    kerf::FirewireOptions options;
    options.where = folder.path();
    kerf::FirewirePort port(options, 5000, kGoOn);
    kerf::OmniDriver driver(port);
    int fresh = 0;
    for (int i = 0; i < 100; ++i) {
      fresh += driver.read().fresh ? 1 : 0;
      driver.command({});
    }
    CHECK(fresh == 100);
  }
  emulator.join();
  CHECK(outcome.code == 0);
  CHECK(outcome.err == "");
  CHECK(outcome.out == "kerf-emulator: omni at " + folder.path() + "/fw1\n");
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("with --stay the second client finds the hand where the first one found it") {
  const kerf::test::TempFolder folder;
  std::atomic<bool> stop{false};
  Outcome outcome;
  std::thread emulator([&] {
    outcome = run({"--front", "fuse", "--mount", folder.path(), "--lockstep", "--priority", "0",
                   "--stay", "--hand", KERF_HANDS "/touch.toml"},
                  stop);
  });
  for (int client = 0; client < 2; ++client) {
    CAPTURE(client);
    kerf::FirewireOptions options;
    options.where = folder.path();
    kerf::FirewirePort port(options, 5000, kGoOn);
    kerf::OmniDriver driver(port);
    kerf::DeviceReport report = driver.read();
    REQUIRE(report.fresh);
    CHECK(report.parked);
    for (int tick = 0; tick < 4000 && report.parked; ++tick) {
      driver.command({});
      report = driver.read();
    }
    CHECK_FALSE(report.parked);
  }
  stop = true;
  emulator.join();
  CHECK(outcome.code == 0);
}

TEST_CASE("kerf-emulator --front fuse refuses what cannot be, in one line with a way out") {
  const kerf::test::TempFolder folder;
  const auto refused = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"--front", "fuse", "--priority", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments, kGoOn);
    CHECK(outcome.code == 2);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    return outcome.err;
  };
  CHECK(refused({}).find("--mount: missing; name an empty folder") != std::string::npos);
  CHECK(refused({"--mount", "/nowhere/at/all"}).find("is no folder; make one") !=
        std::string::npos);
  CHECK(refused({"--mount", folder.path(), "--bus-fault", "1:flood"}).find("1:flood is not") !=
        std::string::npos);
  CHECK(refused({"--mount", folder.path(), "--bus-fault", "x:reset"}).find("x:reset is not") !=
        std::string::npos);
  CHECK(refused({"--mount", folder.path(), "--packet-hz", "3"}).find("--packet-hz") !=
        std::string::npos);
}
