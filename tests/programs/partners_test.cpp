// SPDX-License-Identifier: Apache-2.0
// Controllers and emulators that do not fit, and clients that come one after the other or at once.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::partners_test {

using kerf::test::eventually;
using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::kTorqueScale;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;
using namespace std::chrono_literals;

namespace {

using Words = std::vector<std::string>;

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

bool is_one_line(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n') == 1 && text.back() == '\n';
}

/// An emulator at a socket of its own, and controllers that come to it.
struct Place {
  TemporaryFolder folder;
  std::string socket = (folder / "port").string();

  [[nodiscard]] Words emulator(const Words& options) const {
    return Words{kBin + "/kerf-emulator",       "--socket",   socket, "--hand",
                 kScenes + "/hands/touch.toml", "--priority", "0"} +
           options;
  }
  [[nodiscard]] Words controller(const Words& options) const {
    return Words{kBin + "/kerf-controller", "--scene",    kScenes + "/touch.toml",
                 "--torque-scale",          kTorqueScale, "--port",
                 "socket:" + socket,        "--name",     kerf::test::unique_name()} +
           options;
  }
  [[nodiscard]] Words probe(const std::string& device, const std::string& seconds = "1") const {
    return {kBin + "/kerf-controller",
            "--probe",
            "--port",
            "socket:" + socket,
            "--device",
            device,
            "--seconds",
            seconds};
  }
  /// A controller until its end; its report.
  [[nodiscard]] kerf::test::ReadJson visit(int code, const Words& options) const {
    const std::string report = (folder / "report.json").string();
    Process process(controller(options + Words{"--report", report}), folder / "visit.log");
    CHECK(process.wait() == code);
    return std::filesystem::exists(report) ? kerf::test::read_json_file(report)
                                           : kerf::test::ReadJson();
  }
};

struct Misfit {
  Words emulator, host;
  std::string told;
};

}  // namespace

TEST_CASE("partners that do not fit: one line on both sides, and exit code 2") {
  const Place place;
  for (const Misfit& misfit : std::vector<Misfit>{
           {{"--personality", "falcon"},
            place.probe("omni"),
            "the controller wants a device omni, the emulator is falcon; start kerf-emulator with "
            "--personality omni, or kerf-controller with --device falcon"},
           {{"--lockstep"},
            place.probe("omni"),
            "the emulator runs in lock-step, the controller by its clock; start"},
           {{},
            place.controller({"--virtual"}),
            "the controller runs in lock-step, the emulator by its clock; start"},
           {{"--lockstep", "--rate", "500"},
            place.controller({"--virtual", "--rate", "1000"}),
            "lock-step at 1000 Hz in the controller, at 500 Hz in the emulator; start"},
       }) {
    CAPTURE(misfit.told);
    Process emulator(place.emulator(misfit.emulator), place.folder / "emulator.log");
    Process host(misfit.host, place.folder / "host.log");
    CHECK(host.wait() == 2);
    CHECK(emulator.wait() == 2);
    std::string line = host.output();
    CAPTURE(line);
    CHECK(is_one_line(line));
    CHECK(line.find("kerf-controller: --port socket:" + place.socket + ": ") == 0);
    CHECK(line.find(misfit.told) != std::string::npos);
    line = emulator.output();
    CAPTURE(line);
    line = line.substr(line.find('\n') + 1);  // where it is
    CHECK(is_one_line(line));
    CHECK(line.find("kerf-emulator: " + place.socket + ": ") == 0);
    CHECK(line.find(misfit.told) != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(place.socket));
  }
}

TEST_CASE(
    "a real port refuses gains above its device and an unstable loop: one line, exit code 2") {
  const TemporaryFolder folder;
  const std::string scene = (folder / "stiff.toml").string();
  struct Case {
    std::string force, told;
  };
  for (const auto& [force, told] :
       {Case{"stiffness_n_per_mm = 0.71\nunchecked_gain = true\n",
             "force.stiffness_n_per_mm = 0.71 is above 0.7, the maximum of CHAI3D 3.3.0 for "
             "omni"},
        Case{"damping_ns_per_mm = 0.0051\n", "force.damping_ns_per_mm = 0.0051 is above 0.005"},
        Case{"damping_ns_per_mm = 0\n",
             "force.stiffness_n_per_mm = 0.4 with damping 0 is unstable on a lightly held omni"}}) {
    CAPTURE(told);
    std::ofstream(scene)
        << "[[volume]]\nfile = \"phantom\"\nsize = [48, 48, 32]\n[[tool]]\nshape = "
           "\"ball\"\nsize_vox = 8\n[force]\n"
        << force;
    Process controller({kBin + "/kerf-controller", "--scene", scene, "--port", "socket:/nowhere"},
                       folder / "controller.log");
    CHECK(controller.wait() == 2);
    CAPTURE(controller.output());
    CHECK(is_one_line(controller.output()));
    CHECK(controller.output().find(told) != std::string::npos);
    CHECK(controller.output().find(';') != std::string::npos);
  }
}

TEST_CASE("over UDP they are told alike" * doctest::test_suite("network")) {
  const Place place;
  Process emulator({kBin + "/kerf-emulator", "--front", "udp", "--udp", "0", "--priority", "0"},
                   place.folder / "emulator.log");
  REQUIRE(eventually([&] { return emulator.output().find('\n') != std::string::npos; }, 20s));
  const std::string told = emulator.output();
  const std::string port = told.substr(told.rfind(' ') + 1, told.find('\n') - told.rfind(' ') - 1);
  Process probe({kBin + "/kerf-controller", "--probe", "--device", "falcon", "--port",
                 "udp:" + port, "--seconds", "1"},
                place.folder / "probe.log");
  CHECK(probe.wait() == 2);
  CHECK(emulator.wait() == 2);
  CHECK(is_one_line(probe.output()));
  CHECK(probe.output().find("wants a device falcon, the emulator is omni") != std::string::npos);
  CHECK(emulator.output().find("wants a device falcon, the emulator is omni") != std::string::npos);
}

TEST_CASE("each client gets device and hand anew, and one that does not fit disturbs no other") {
  const Place place;
  const std::string told = (place.folder / "emulator.json").string();
  Process emulator(
      place.emulator({"--personality", "falcon", "--lockstep", "--stay", "--report", told}),
      place.folder / "emulator.log");
  const Words fits{"--device", "falcon", "--virtual", "--seconds", "1.5"};
  const auto first = place.visit(0, fits);
  Process stranger(place.probe("omni"), place.folder / "stranger.log");
  CHECK(stranger.wait() == 2);
  const auto second = place.visit(0, fits);
  CHECK(first["contact_ticks"] > 100);
  CHECK(first["output_hash"] == second["output_hash"]);
  CHECK(first["armed_at_tick"] == second["armed_at_tick"]);
  emulator.signal(SIGTERM);
  CHECK(emulator.wait() == 0);
  CHECK(emulator.output().find("wants a device omni, the emulator is falcon") != std::string::npos);
  const auto report = kerf::test::read_json_file(told);
  const auto served_s = report["seconds"].get<double>();
  const auto ticks = 2 * (first["ticks"].get<double>() + first["armed_at_tick"].get<double>());
  CHECK(served_s == doctest::Approx(ticks / 1000).epsilon(0.01));
  CHECK(report["commands_received"].get<double>() == doctest::Approx(ticks).epsilon(0.01));
  CHECK(report["peak_motor_force_n"] > 0);
}

TEST_CASE("a client that comes while another is served says that it waits, and gives up") {
  const Place place;
  const Process emulator(place.emulator({"--stay"}), place.folder / "emulator.log");
  const Process first(place.probe("omni", "60"), place.folder / "first.log");
  REQUIRE(eventually([&] { return first.output().find("counts") != std::string::npos; }, 20s));
  Process second(place.probe("omni"), place.folder / "second.log");
  CHECK(second.wait() == 2);
  const std::string told = second.output();
  CAPTURE(told);
  const auto end = told.find('\n') + 1;
  CHECK(told.substr(0, end) ==
        "kerf-controller: waiting for a device that answers at --port socket:" + place.socket +
            "\n");
  CHECK(is_one_line(told.substr(end)));
  CHECK(told.find("no answer", end) != std::string::npos);
  CHECK(first.output().find("no answer") == std::string::npos);
}

TEST_CASE("nobody who homes the device: after --wait it ends with exit code 1") {
  const Place place;
  const Process emulator(
      {kBin + "/kerf-emulator", "--personality", "falcon", "--socket", place.socket},
      place.folder / "emulator.log");
  const auto report = place.visit(1, {"--device", "falcon", "--wait", "0.5"});
  CHECK(report["ticks"] == 0);
  CHECK(report["end"].get<std::string>().find("never") != std::string::npos);
}

}  // namespace kerf::partners_test
