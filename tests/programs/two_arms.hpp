// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "tests/programs/pair.hpp"

namespace kerf::test {

/// A controller with two devices, each an emulator at a socket of its own, all as processes.
struct TwoArms {
  using Words = std::vector<std::string>;

  TemporaryFolder folder;
  std::string name = unique_name();
  std::array<std::optional<Process>, 2> emulators;
  std::optional<Process> controller;

  /// A scene of these two devices that loads at once: a coarse tooth and two balls, nothing cut.
  /// `keys`: more lines of each [[device]].
  void write_scene(const std::array<std::string, 2>& devices,
                   const std::array<std::string, 2>& keys = {}) const {
    std::ofstream scene(folder / "two.toml");
    scene << "[[volume]]\nfile = \"phantom\"\nsize = [48, 48, 32]\niso = 0.45\n"
             "[force]\nstiffness_n_per_mm = 0.4\n[cut]\nmodel = \"none\"\n";
    for (const char* const tool : {"left", "right"}) {
      scene << "[[tool]]\nname = \"" << tool << "\"\nshape = \"ball\"\nsize_vox = 8\n";
    }
    for (std::size_t arm = 0; arm < 2; ++arm) {
      scene << "[[device]]\npersonality = \"" << devices[arm] << "\"\n" << keys[arm] << '\n';
    }
  }
  [[nodiscard]] std::string socket(std::size_t arm) const {
    return (folder / ("port" + std::to_string(arm))).string();
  }
  /// At its socket, but for an Inverse3, which is behind a service.
  void emulate(std::size_t arm, const std::string& device, const Words& more) {
    Words words{kBin + "/kerf-emulator", "--personality", device};
    if (device != "inverse3") words.insert(words.end(), {"--socket", socket(arm)});
    words.insert(words.end(), more.begin(), more.end());
    emulators[arm].emplace(words, folder / ("emulator" + std::to_string(arm) + ".log"));
  }
  /// With the ports of the sockets if `ports` has none.
  void control(const Words& more, Words ports = {}) {
    if (ports.empty()) ports = {"socket:" + socket(0), "socket:" + socket(1)};
    Words words{kBin + "/kerf-controller",
                "--scene",
                (folder / "two.toml").string(),
                "--name",
                name,
                "--report",
                (folder / "report.json").string()};
    for (const std::string& port : ports) words.insert(words.end(), {"--port", port});
    words.insert(words.end(), more.begin(), more.end());
    controller.emplace(words, folder / "controller.log");
  }
  [[nodiscard]] ReadJson report() const { return read_json_file(folder / "report.json"); }
  /// How often the controller has printed that.
  [[nodiscard]] int times_said(const std::string& text) const {
    const std::string all = controller->output();
    int times = 0;
    for (auto at = all.find(text); at != std::string::npos; at = all.find(text, at + 1)) ++times;
    return times;
  }
};

}  // namespace kerf::test
