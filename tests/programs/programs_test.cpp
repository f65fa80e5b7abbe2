// SPDX-License-Identifier: Apache-2.0
// The programs together, as a user starts them: emulator and controller as processes.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include <doctest/doctest.h>

#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/connection.hpp"
#include "shared/text/text.hpp"
#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::programs_test {

using kerf::test::ended_well;
using kerf::test::eventually;
using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::kTorqueScale;
using kerf::test::Pair;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;
using namespace std::chrono_literals;

namespace {

/// Runs one program to its end and expects one line and exit code 2.
std::string refused(const std::vector<std::string>& arguments) {
  const TemporaryFolder folder;
  Process process(arguments, folder / "log");
  CHECK(process.wait() == 2);
  std::string line = process.output();
  CAPTURE(line);
  CHECK(std::count(line.begin(), line.end(), '\n') == 1);
  return line;
}

}  // namespace

TEST_CASE("a tool from an STL file cuts the same voxels in every run") {
  kerf::test::ReadJson reports[2];
  for (auto& report : reports) {
    Pair pair;
    pair.scene = "fluted_bur.toml";
    pair.start("groove.toml", {"--virtual", "--seconds", "1.5"}, {"--lockstep"});
    REQUIRE(pair.controller->wait() == 0);
    report = pair.report();
  }
  CHECK(reports[0]["removed_mm3"] > 0);
  CHECK(reports[0]["volume_hash"] == reports[1]["volume_hash"]);
  CHECK(reports[0]["output_hash"] == reports[1]["output_hash"]);
}

TEST_CASE("results that cannot be written are refused before the hand is moved") {
  for (const auto& [option, file] :
       {std::pair<std::string, std::string>{"--final", "/nonexistent/f.nrrd"},
        {"--emulator-args", "/nonexistent/f"}}) {
    Pair pair;
    pair.start("touch.toml", {"--virtual", "--seconds", "0.1", option, file}, {"--lockstep"});
    CHECK(pair.controller->wait() == 2);
    const std::string line = pair.controller->output();
    CHECK(line.find(file + ": cannot be written") != std::string::npos);
    CHECK(std::count(line.begin(), line.end(), '\n') == 1);
    CHECK_FALSE(std::filesystem::exists(pair.folder / "report.json"));
  }
}

TEST_CASE("readers that come, die and come again do not change what the servo computes") {
  if (!std::filesystem::exists(kBin + "/kerf-visualizer")) {
    MESSAGE("skipped: kerf-visualizer was not built (a library is missing)");
    return;
  }
  std::string hashes[2];
  for (const bool watched : {false, true}) {
    Pair pair;
    pair.start("cut_cavity.toml", {"--virtual", "--seconds", "5"}, {"--lockstep"});
    if (watched) {
      REQUIRE(pair.ticks_within(20s));
      for (int life = 0; life < 2; ++life) {
        const Process viewer(
            {kBin + "/kerf-visualizer", "--name", pair.name, "--headless", "--frames", "100",
             "--size", "160x120", "--out", (pair.folder / "frames").string()},
            pair.folder / "viewer.log");
        std::this_thread::sleep_for(300ms);
        viewer.signal(SIGKILL);
      }
    }
    REQUIRE(pair.controller->wait() == 0);
    hashes[watched ? 1 : 0] = pair.report()["output_hash"].get<std::string>();
  }
  CHECK(hashes[0] == hashes[1]);
}

TEST_CASE("a reader changes the tool: the servo takes it at a tick and says which command it was") {
  Pair pair;
  pair.start("touch.toml", {});
  REQUIRE(pair.ticks_within(20s));
  auto connection = kerf::connect_segment(pair.name);
  const kerf::Reply taken =
      connection.send({.kind = kerf::CommandKind::select_tool, .argument = 2});
  CHECK(taken.status == kerf::ReplyStatus::accepted);
  CHECK(eventually(
      [&] {
        const auto latest = connection.reader().latest();
        return latest && latest->active_tool == 2 && latest->last_command == taken.index;
      },
      5s));
  const kerf::Reply refused =
      connection.send({.kind = kerf::CommandKind::select_tool, .argument = 1000});
  CHECK(refused.status == kerf::ReplyStatus::refused);
}

TEST_CASE("a second controller of the same name is refused in one line") {
  Pair pair;
  pair.start("touch.toml", {});
  REQUIRE(
      eventually([&] { return std::filesystem::exists(kerf::segment_socket(pair.name)); }, 20s));
  const std::string line = refused(
      {kBin + "/kerf-controller", "--scene", kScenes + "/phantom.toml", "--torque-scale",
       kTorqueScale, "--port", "socket:" + (pair.folder / "none").string(), "--name", pair.name});
  CHECK(line.find(pair.name) != std::string::npos);
}

TEST_CASE("a reader that joins in the middle of milling sees the controller's own volume") {
  Pair pair;
  pair.start("cut_cavity.toml", {"--virtual", "--seconds", "6"}, {"--lockstep"});
  std::optional<kerf::SegmentConnection> connection;
  REQUIRE(eventually(
      [&] {
        try {
          connection.emplace(kerf::connect_segment(pair.name));
          return connection->reader().dirty_head() > 200;
        } catch (const kerf::SegmentError&) {
          return false;
        }
      },
      20s));
  kerf::VolumeSnapshot snapshot;
  connection->reader().update(0, snapshot);
  CHECK(pair.controller->wait() == 0);
  connection->reader().update(0, snapshot);
  // The report chains the hashes of all volumes; with one volume it is one link.
  const std::uint64_t hash =
      kerf::fnv1a_step(kerf::kFnv1aBasis, kerf::density_hash(snapshot.density));
  CHECK(pair.report()["volume_hash"] == kerf::hex64(hash));
}

TEST_CASE("a reader resets the volumes: the mirror follows, and the report counts from there") {
  Pair pair;
  pair.start("cut_cavity.toml", {"--virtual", "--seconds", "3"}, {"--lockstep"});
  std::optional<kerf::SegmentConnection> connection;
  REQUIRE(eventually(
      [&] {
        try {
          if (!connection) connection.emplace(kerf::connect_segment(pair.name));
          return connection->reader().dirty_head() > 200;
        } catch (const kerf::SegmentError&) {
          return false;
        }
      },
      20s));
  CHECK(connection->send({.kind = kerf::CommandKind::reset, .argument = 1}).status ==
        kerf::ReplyStatus::refused);
  CHECK(connection->send({.kind = kerf::CommandKind::reset}).status == kerf::ReplyStatus::accepted);
  CHECK(pair.controller->wait() == 0);
  const kerf::test::ReadJson report = pair.report();
  CHECK(report["resets"] == 1);
  REQUIRE(report["event_count"] > 0);
  CHECK(report["events"].back()["name"] == "reset");

  const kerf::SegmentReader& reader = connection->reader();
  kerf::VolumeSnapshot snapshot;
  reader.update(0, snapshot);
  const std::uint64_t hash =
      kerf::fnv1a_step(kerf::kFnv1aBasis, kerf::density_hash(snapshot.density));
  CHECK(report["volume_hash"] == kerf::hex64(hash));
  REQUIRE(reader.dirty_head() <= reader.info().dirty_slots);
  double removed = 0;
  int boxes = 0;
  for (std::uint64_t i = 0; i < reader.dirty_head(); ++i) {
    kerf::DirtyRecord record;
    REQUIRE(reader.dirty_at(i, record) == kerf::ReadState::ok);
    const bool reset = record.cause == static_cast<std::uint16_t>(kerf::DirtyCause::reset);
    removed = reset ? 0 : removed + record.removed;
    boxes += reset ? 1 : 0;
  }
  CHECK(boxes > 0);
  const auto& h = reader.info().volumes[0].spacing_mm;
  CHECK(report["removed_density_mm3"].get<double>() ==
        doctest::Approx(removed / kerf::kDensityMax * h[0] * h[1] * h[2]));
}

TEST_CASE("--explain tells what is really allocated, and what each tool's tick takes") {
  const TemporaryFolder folder;
  Process controller({kBin + "/kerf-controller", "--scene", kScenes + "/touch.toml", "--explain",
                      "--report", (folder / "explain.json").string()},
                     folder / "explain.log");
  CHECK(controller.wait() == 0);
  CHECK(text_of(folder / "explain.log").find("ball 16 in phantom: surface/") != std::string::npos);
  const auto json = kerf::test::read_json_file(folder / "explain.json");
  CHECK(json["ticks"].size() == 3);
  for (const kerf::test::ReadJson tick : json["ticks"]) {
    CHECK(tick["measured_us"] > 0);
    for (const kerf::test::ReadJson stage : tick["stages"]) {
      CHECK(stage["operations"] > 0);
      CHECK(stage["predicted_us"] > 0);
    }
  }
  CHECK(json["total_bytes"] > 0);
}

TEST_CASE("--guard finds nothing to say about the program's own loop") {
  for (const bool lockstep : {false, true}) {
    Pair pair;
    const std::vector<std::string> by_lockstep{"--virtual", "--guard", "--seconds", "1"};
    const std::vector<std::string> by_clock{"--guard", "--seconds", "1"};
    pair.start("cut_cavity.toml", lockstep ? by_lockstep : by_clock,
               lockstep ? std::vector<std::string>{"--lockstep"} : std::vector<std::string>{});
    const bool well = lockstep ? pair.controller->wait() == 0
                               : ended_well(*pair.controller, pair.folder / "report.json");
    CAPTURE(pair.controller->output());
    CHECK(well);
    CHECK(pair.report()["guarded"] == true);
    CHECK(pair.report()["unexpected_call"] == "");
  }
}

TEST_CASE("--probe shows each device, and its motors never push") {
  // Side by side: each takes 5 s, so that a busy machine has time for homing and calibration.
  struct Probed {
    explicit Probed(const std::string& device)
        : emulator({kBin + "/kerf-emulator", "--personality", device, "--socket", socket, "--hand",
                    kScenes + "/hands/touch.toml", "--report", (folder / "emulator.json").string()},
                   folder / "emulator.log"),
          probe({kBin + "/kerf-controller", "--probe", "--device", device, "--port",
                 "socket:" + socket, "--torque-scale", "1,1,1", "--seconds", "5", "--report",
                 (folder / "probe.json").string()},
                folder / "probe.log") {}
    TemporaryFolder folder;
    std::string socket = (folder / "port").string();
    Process emulator, probe;
  };
  std::map<std::string, Probed> all;
  for (const std::string device : {"omni", "falcon", "woodenhaptics"}) {
    all.try_emplace(device, device);
  }
  for (auto& [device, one] : all) {
    CAPTURE(device);
    REQUIRE(one.probe.wait() == 0);
    CHECK(one.emulator.wait() == 0);
    CHECK(one.probe.output().find("tip ") != std::string::npos);
    const auto seen = kerf::test::read_json_file(one.folder / "probe.json");
    CHECK(seen["reports"] > 1000);
    CHECK(seen["lost_packets"] == 0);
    CHECK(seen["homed"] == true);
    CHECK(seen["calibrated"] == true);
    const auto told = kerf::test::read_json_file(one.folder / "emulator.json");
    CHECK(told["commands_received"] > 100);
    CHECK(told["peak_motor_force_n"] == 0.0);
  }
}

TEST_CASE("--probe without a port says what is there, with one that is silent it fails") {
  const TemporaryFolder folder;
  Process around({kBin + "/kerf-controller", "--probe", "--report", (folder / "r.json").string()},
                 folder / "log");
  CHECK(around.wait() == 0);
  CHECK(kerf::test::read_json_file(folder / "r.json").contains("missing"));
  CHECK(refused({kBin + "/kerf-controller", "--probe", "--port", "fw"}).find("which device") !=
        std::string::npos);
  const std::string socket = (folder / "port").string();
  std::ofstream(folder / "mute.toml")
      << "clock = \"start\"\n[[fault]]\nkind = \"silence\"\nfor_s = 3600\n";
  const Process mute(
      {kBin + "/kerf-emulator", "--socket", socket, "--fault", (folder / "mute.toml").string()},
      folder / "emulator.log");
  Process probe({kBin + "/kerf-controller", "--probe", "--device", "omni", "--port",
                 "socket:" + socket, "--seconds", "0.3"},
                folder / "probe.log");
  CHECK(probe.wait() == 1);
}

TEST_CASE(
    "--check prints the law of a bur that does not follow Preston's law, and of no other bur") {
  const TemporaryFolder folder;
  const std::string scene = (folder / "scene.toml").string();
  std::ofstream(scene)
      << "[[volume]]\nfile = \"phantom\"\n"
         "[[tool]]\nshape = \"ball\"\nradius_mm = 1\nname = \"plain\"\n"
         "[[tool]]\nshape = \"ball\"\nradius_mm = 1\nname = \"rough\"\ngrit = \"medium\"\n"
         "[[tool]]\nshape = \"ball\"\nradius_mm = 1\nname = \"worn\"\ngrit = \"coarse\"\n"
         "[cut]\nmodel = \"preston\"\n";
  Process check({kBin + "/kerf-controller", "--scene", scene, "--check"}, folder / "log");
  CHECK(check.wait() == 0);
  const std::string said = check.output();
  CHECK(said.find("bur_law=rough force_exponent=1 speed_exponent=0 saturation_n=0.98 "
                  "wear_half_n_s=110\n") != std::string::npos);
  CHECK(said.find("bur_law=worn force_exponent=1 speed_exponent=0 saturation_n=none "
                  "wear_half_n_s=170\n") != std::string::npos);
  CHECK(said.find("bur_law=plain") == std::string::npos);
}

TEST_CASE("bad arguments are one line and exit 2") {
  const std::string controller = kBin + "/kerf-controller";
  const std::string scene = kScenes + "/phantom.toml";
  CHECK(refused({controller}).find("--scene") != std::string::npos);
  CHECK(refused({controller, "--scene", "missing.toml", "--check"}).find("missing.toml") !=
        std::string::npos);
  const TemporaryFolder folder;
  std::ofstream(folder / "scene.toml") << "[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = "
                                          "\"ball\"\nsize_vox = 8\n[hand]\nscript = \"no.toml\"\n";
  CHECK(refused({controller, "--scene", (folder / "scene.toml").string(), "--check"})
            .find("scene.toml:7: hand.script = \"no.toml\"") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--port", "usbx"}).find("socket:PATH") !=
        std::string::npos);
  CHECK(
      refused({controller, "--scene", scene, "--device", "nonsense", "--check"}).find("nonsense") !=
      std::string::npos);
  CHECK(
      refused({controller, "--scene", scene, "--check", "--explain"}).find("exclude each other") !=
      std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--explain", "--report", "/nonexistent/a.json"})
            .find("/nonexistent/a.json") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--check", "--report", "/nonexistent/a.json"})
            .find("/nonexistent/a.json") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--check", "--final", "/nonexistent/a.nrrd"})
            .find("/nonexistent/a.nrrd") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--check", "--emulator-args", "/nonexistent/a"})
            .find("/nonexistent/a") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--check", "--name", "a/b"}).find("--name: 'a/b'") !=
        std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--check", "--rate", "2000", "--spin-us", "900"})
            .find("--spin-us 900 is more than 90 % of a tick at 2000 Hz") != std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--cpu", "-1", "--check"}).find("range 0 to 1023") !=
        std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--rate", "20000", "--check"}).find("20000") !=
        std::string::npos);
  CHECK(refused({controller, "--scene", scene, "--volume", "missing.nrrd", "--check"})
            .find("missing.nrrd") != std::string::npos);
  CHECK(refused({kBin + "/kerf-emulator", "--personality", "nonsense", "--front", "socket",
                 "--socket", "/nonexistent/socket"})
            .find("nonsense") != std::string::npos);
}

}  // namespace kerf::programs_test
