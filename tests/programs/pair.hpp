// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <unistd.h>

#include "shared/segment/connection.hpp"
#include "tests/json.hpp"
#include "tests/support/process.hpp"

namespace kerf::test {

inline const std::string kBin = KERF_TEST_BIN;
inline const std::string kScenes = KERF_TEST_SCENES;
inline const std::string kTorqueScale = "0.342,0.342,0.342";  // of the emulated Omni

/// A scene that loads at once: a coarse tooth and one ball, nothing cut. Its path.
inline std::string small_scene(const TemporaryFolder& folder) {
  const std::filesystem::path path = folder / "small.toml";
  std::ofstream(path) << "[[volume]]\nfile = \"phantom\"\nsize = [48, 48, 32]\niso = 0.45\n"
                         "[[tool]]\nname = \"ball\"\nshape = \"ball\"\nsize_vox = 8\n"
                         "[force]\nstiffness_n_per_mm = 0.4\n[cut]\nmodel = \"none\"\n";
  return path.string();
}

inline std::string unique_name() {
  static int count = 0;
  return "test-" + std::to_string(getpid()) + "-" + std::to_string(++count);
}

/// Waits for a controller that worked in real time. It ended well with 0; or with 1, if a busy
/// machine stopped its emulator or its servo so long that a fault is due (docs/safety.md: 20 ms
/// without a report are stale_input, a hand that moved 10 mm in a gap is overspeed).
[[nodiscard]] inline bool ended_well(Process& controller, const std::filesystem::path& path) {
  const int code = controller.wait();
  if (code != 1) return code == 0;
  const ReadJson report = read_json_file(path);
  if (!(report["end"] == "finished" || report["end"] == "stopped")) return false;
  const auto only_late = [&](const ReadJson& arm) {
    const ReadJson faults = arm["faults"];
    for (std::size_t i = 0; i < faults.size(); ++i) {
      if (!(faults[i]["name"] == "stale_input" || faults[i]["name"] == "overspeed")) return false;
    }
    return faults.size() == 0 || report["overruns"] > 0 || arm["stale_ticks"] > 0;
  };
  return only_late(report) && (!report.contains("second") || only_late(report["second"]));
}

/// Emulator and controller, as processes, on a private socket.
struct Pair {
  TemporaryFolder folder;
  std::string name = unique_name();
  std::string scene = "phantom.toml";
  std::optional<Process> emulator;
  std::optional<Process> controller;

  void start(const std::string& hand, std::vector<std::string> controller_options,
             std::vector<std::string> emulator_options = {}) {
    const std::string socket = (folder / "port").string();
    std::vector<std::string> device{kBin + "/kerf-emulator",
                                    "--personality",
                                    "omni",
                                    "--front",
                                    "socket",
                                    "--socket",
                                    socket,
                                    "--hand",
                                    kScenes + "/hands/" + hand};
    device.insert(device.end(), emulator_options.begin(), emulator_options.end());
    emulator.emplace(device, folder / "emulator.log");
    std::vector<std::string> servo{kBin + "/kerf-controller",
                                   "--scene",
                                   (std::filesystem::path(kScenes) / scene).string(),
                                   "--torque-scale",
                                   kTorqueScale,
                                   "--port",
                                   "socket:" + socket,
                                   "--name",
                                   name,
                                   "--report",
                                   (folder / "report.json").string()};
    servo.insert(servo.end(), controller_options.begin(), controller_options.end());
    controller.emplace(servo, folder / "controller.log");
  }
  /// Waits until the servo has published ticks.
  [[nodiscard]] bool ticks_within(std::chrono::milliseconds patience) const {
    return eventually(
        [&] {
          try {
            return kerf::connect_segment(name).reader().state_head() > 10;
          } catch (const kerf::SegmentError&) {
            return false;
          }
        },
        patience);
  }
  [[nodiscard]] ReadJson report() const { return read_json_file(folder / "report.json"); }
};

}  // namespace kerf::test
