// SPDX-License-Identifier: Apache-2.0
// Controller and emulator in lock-step: what is computed there depends on no clock, so other tests
// may run beside.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include <doctest/doctest.h>

#include "record/tick_log.hpp"
#include "shared/text/text.hpp"
#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::virtual_time_test {

using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::Pair;
using kerf::test::Process;
using kerf::test::small_scene;
using kerf::test::text_of;

TEST_CASE("virtual time: the same demo twice gives the same volume and output hashes") {
  kerf::test::ReadJson reports[2];
  for (auto& report : reports) {
    Pair pair;
    pair.start("cut_cavity.toml", {"--virtual", "--seconds", "4"}, {"--lockstep"});
    REQUIRE(pair.controller->wait() == 0);
    report = pair.report();
  }
  CHECK(reports[0]["ticks"] == 4000);
  CHECK(reports[0]["contact_ticks"] > 100);
  CHECK(reports[0]["removed_mm3"] > 0);
  CHECK(reports[0]["allocations"] == 0);
  CHECK(reports[0]["volume_hash"] == reports[1]["volume_hash"]);
  CHECK(reports[0]["output_hash"] == reports[1]["output_hash"]);
}

TEST_CASE(
    "virtual time: the log of the same demo twice has the same bytes, its time is the servo's") {
  std::string before;
  for (int run = 0; run < 2; ++run) {
    Pair pair;
    Process recorder(
        {kBin + "/kerf-recorder", "--name", pair.name, "--out", (pair.folder / "log").string()},
        pair.folder / "recorder.log");
    pair.scene = "touch.toml";
    pair.start("touch.toml", {"--virtual", "--seconds", "2"}, {"--lockstep"});
    REQUIRE(pair.controller->wait() == 0);
    REQUIRE(recorder.wait() == 0);
    const auto manifest = kerf::test::read_json_file(pair.folder / "log/manifest.json");
    CHECK(manifest["start_ns"] == 0);
    CHECK(manifest["lost_ticks"] == 0);
    const std::string log = text_of(pair.folder / "log/ticks.npy");
    CHECK((before.empty() || log == before));
    before = log;
    kerf::TickLogReader ticks(pair.folder / "log/ticks.npy");
    CHECK(ticks.rows() > 2000);
    ticks.for_each([](const kerf::TickRecord& tick) {
      if (tick.start_ns != tick.tick * 1'000'000 || tick.execution_ns != 0)
        FAIL("tick ", tick.tick);
    });
  }
}

TEST_CASE("virtual time: a stiffer tooth is pressed less deep, as the tutorial has it") {
  const std::string page = text_of(std::filesystem::path(kScenes) / "../docs/tutorial.md");
  for (const char* const stiffness : {"0.2", "0.6"}) {
    Pair pair;
    Process recorder(
        {kBin + "/kerf-recorder", "--name", pair.name, "--out", (pair.folder / "log").string()},
        pair.folder / "recorder.log");
    pair.scene = "touch.toml";
    pair.start("touch.toml",
               {"--virtual", "--seconds", "4", "--device", "omni", "--rate", "1000", "--set",
                "force.stiffness_n_per_mm=" + std::string(stiffness)},
               {"--lockstep", "--rate", "1000", "--unit-mm", "1"});
    REQUIRE(pair.controller->wait() == 0);
    REQUIRE(recorder.wait() == 0);
    double peak_n = 0, deepest_mm = 0;
    kerf::TickLogReader(pair.folder / "log/ticks.npy").for_each([&](const kerf::TickRecord& tick) {
      peak_n = std::max(peak_n, kerf::magnitude(tick.commanded_force_n));
      deepest_mm = std::max(deepest_mm, double{tick.penetration_mm});
    });
    for (const std::string& figure :
         {kerf::format("%.2f N", peak_n), kerf::format("%.2f mm", deepest_mm)}) {
      CAPTURE(figure);
      CHECK(page.find(figure) != std::string::npos);
    }
  }
}

TEST_CASE("virtual time: faults keep packets back, and the same run gives the same hashes") {
  struct Case {
    std::string fault;
    int exit_code, least_stale;
  };
  for (const auto& [fault, exit_code, least_stale] :
       {Case{"late_reports", 0, 5}, Case{"lost_long", 1, 30}, Case{"silence", 1, 300},
        Case{"duplicated", 0, 0}, Case{"lost_commands", 0, 0}}) {
    CAPTURE(fault);
    kerf::test::ReadJson reports[2];
    for (auto& report : reports) {
      Pair pair;
      pair.scene = small_scene(pair.folder);
      pair.start("touch.toml", {"--virtual", "--seconds", "2"},
                 {"--lockstep", "--fault", KERF_TEST_SCENES "/../hil/faults/" + fault + ".toml"});
      CHECK(pair.controller->wait() == exit_code);
      report = pair.report();
    }
    CHECK(reports[0]["ticks"] == 2000);
    CHECK(reports[0]["stale_ticks"] >= least_stale);
    CHECK(reports[0]["stale_ticks"] == reports[1]["stale_ticks"]);
    CHECK(reports[0]["output_hash"] == reports[1]["output_hash"]);
  }
}

TEST_CASE("virtual time: 2 ms of delay are the same loop wherever they lie") {
  const auto energy_j = [](const std::string& before_delay,
                           const std::vector<std::string>& options) {
    Pair pair;
    pair.scene = small_scene(pair.folder);
    const std::string script = (pair.folder / "late.toml").string();
    std::ofstream(script)
        << "clock = \"start\"\n[[fault]]\nkind = \"delay\"\nms = 2\nfor_s = 3600\n"
        << before_delay;
    std::vector<std::string> emulator{"--lockstep"};
    if (!before_delay.empty()) emulator.insert(emulator.end(), {"--fault", script});
    emulator.insert(emulator.end(), options.begin(), options.end());
    pair.start("touch.toml", {"--virtual", "--seconds", "2"}, emulator);
    CHECK(pair.controller->wait() == 0);
    return pair.report()["energy_j"].get<double>();
  };
  const double late_reports = energy_j("packets = \"reports\"\n", {});
  CHECK(late_reports > 0);
  CHECK(energy_j("packets = \"commands\"\n", {}) == late_reports);
  CHECK(energy_j("", {"--output-delay", "16"}) == late_reports);
  CHECK(energy_j("", {"--input-delay", "16"}) == late_reports);
  CHECK(energy_j("", {"--input-delay", "8", "--output-delay", "8"}) == late_reports);
  CHECK(energy_j("", {}) != late_reports);
}

TEST_CASE("virtual time: a stiffness that no port takes can be studied, and goes active") {
  const auto energy_j = [](double stiffness, const std::string& delay) {
    Pair pair;
    pair.scene = (pair.folder / "stiff.toml").string();
    std::ofstream(pair.scene)
        << "[[volume]]\nfile = \"phantom\"\nsize = [48, 48, 32]\niso = 0.45\n[[tool]]\nname = "
           "\"ball\"\nshape = \"ball\"\nsize_vox = 8\n[force]\ndamping_ns_per_mm = 0\n"
           "stiffness_n_per_mm = "
        << stiffness << "\n[cut]\nmodel = \"none\"\n";
    pair.start("touch.toml", {"--virtual", "--seconds", "3", "--rate", "250"},
               {"--lockstep", "--rate", "250", "--output-delay", delay});
    CHECK(pair.controller->wait() == 0);
    const kerf::test::ReadJson report = pair.report();
    CHECK(report["peak_force_n"] <= 3.3);
    return report["energy_j"].get<double>();
  };
  // What the wall took of the hand, in J: a passive one takes, an active one gives.
  CHECK(energy_j(0.4, "0") > 0);
  CHECK(energy_j(10, "0") < -1e-3);
  // A delay of two samples (of 4 ms) brings the end down: 2 N/mm gave nothing without it.
  CHECK(energy_j(2, "0") > -1e-4);
  CHECK(energy_j(2, "64") < -1e-3);
}

}  // namespace kerf::virtual_time_test
