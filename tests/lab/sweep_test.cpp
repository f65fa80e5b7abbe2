// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <map>
#include <sstream>
#include <type_traits>
#include <variant>

#include <doctest/doctest.h>

#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_keys.hpp"
#include "hil/hil_error.hpp"
#include "lab/commands/cell_run.hpp"
#include "lab/run/grid_run.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/text/text.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/programs/pair.hpp"
#include "tests/support/errors.hpp"

namespace kerf::sweep_test {

using kerf::test::eventually;
using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::Pair;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;
using namespace kerf::grid;
using namespace std::chrono_literals;

namespace {

std::string refusal_of(const std::string& axis) {
  return kerf::test::error_of([&] { static_cast<void>(parse_axes(std::vector{axis})); });
}

/// A scene that loads at once, with a hand.
std::string scene_with_hand(const TemporaryFolder& folder) {
  const std::string path = kerf::test::small_scene(folder);
  std::ofstream(path, std::ios::app) << "[hand]\nscript = \"" << kScenes << "/hands/touch.toml\"\n";
  return path;
}

/// `kerf-lab sweep` over two axes, six runs of 0.2 s.
std::vector<std::string> sweep(const std::string& scene, const std::filesystem::path& out,
                               const std::string& jobs) {
  return {kBin + "/kerf-lab",
          "sweep",
          scene,
          "--set",
          "force.stiffness_n_per_mm=0.2:0.6:3",
          "--set",
          "servo.rate_hz=500,1000",
          "--seconds",
          "0.2",
          "--jobs",
          jobs,
          "--out",
          out.string()};
}

/// Names and cells of one line each.
std::map<std::string, std::string> row_of(const std::string& table, int row) {
  std::istringstream lines(table);
  std::string head, line;
  std::getline(lines, head);
  for (int i = 0; i <= row; ++i) std::getline(lines, line);
  std::istringstream names(head), cells(line);
  std::map<std::string, std::string> values;
  for (std::string name, cell; std::getline(names, name, ',');) {
    cell.clear();
    std::getline(cells, cell, ',');
    values[name] = cell;
  }
  return values;
}

/// Processes that name the folder in their command.
int processes_of(const std::filesystem::path& folder) {
  int count = 0;
  for (const auto& process : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(process.path() / "cmdline");
    std::string line;
    std::getline(file, line);  // of one that has just ended: nothing
    if (line.find(folder.string()) != std::string::npos) ++count;
  }
  return count;
}

}  // namespace

TEST_CASE("an axis is a range with both ends, or a list; the last axis changes fastest") {
  CHECK(parse_axis("force.stiffness_n_per_mm=0.2:3:3").values ==
        std::vector<std::string>{"0.2", "1.6", "3"});
  CHECK(parse_axis("servo.rate_hz=1000:500:2").values == std::vector<std::string>{"1000", "500"});
  CHECK(parse_axis("servo.rate_hz=500:500:1").values == std::vector<std::string>{"500"});
  CHECK(parse_axis("device.offset_mm=[0,1,2],[3,4,5]").values ==
        std::vector<std::string>{"[0,1,2]", "[3,4,5]"});
  CHECK(parse_axis("servo.velocity={name=\"difference\",tau_ms=1},{name=\"foaw\"}").values ==
        std::vector<std::string>{"{name=\"difference\",tau_ms=1}", "{name=\"foaw\"}"});
  const std::vector<std::string> texts{"servo.rate_hz=1,2,3", "emulator.seed=7,8"};
  const std::vector<Axis> axes = parse_axes(texts);
  CHECK(cells_of(axes) == 6);
  CHECK(values_of(axes, 0) == std::vector<std::string>{"1", "7"});
  CHECK(values_of(axes, 1) == std::vector<std::string>{"1", "8"});
  CHECK(values_of(axes, 5) == std::vector<std::string>{"3", "8"});
}

namespace {

/// Values that a scene may give to a key: ends of its range, words, texts, lists, laws.
std::vector<std::string> values_of_key(const kerf::SceneKey& key) {
  kerf::SceneParts parts;
  std::vector<std::string> values;
  const auto [lo, hi] = key.allowed.range;
  const std::string low = kerf::number_text(lo), high = kerf::number_text(hi);
  for (const std::string_view word : key.allowed.words) values.emplace_back(word);
  const auto list = [&](std::size_t count) {
    std::string up = "[", down = "[ ";
    for (std::size_t i = 0; i < count; ++i) {
      up += (i > 0 ? "," : "") + (i == 1 ? high : low);
      down += (i > 0 ? ", " : "") + (i == 1 ? low : high);
    }
    values.insert(values.end(), {up + "]", down + " ]"});
    if (key.options.one_for_all) values.push_back(high);
  };
  std::visit(
      [&](auto* slot) {
        using T = std::remove_pointer_t<decltype(slot)>;
        using std::is_same_v;
        if constexpr (is_same_v<T, bool>) {
          values = {"true", "false"};
        } else if constexpr (is_same_v<T, std::string>) {
          if (!key.allowed.words.empty()) return;
          values = {"plain", "two words", "twowords", "\"a, b\"", "'c, \"d\"'", "e:f",
                    "1/T",   "\"1:2:3\"", "it's",     "x]",       "[y",         "\"q\\\"r,s\""};
        } else if constexpr (is_same_v<T, kerf::LawChoice>) {
          if (slot->kind == kerf::LawKind::force) values = {"coupling"};
          if (slot->kind == kerf::LawKind::velocity)
            values = {"foaw", "{name=\"difference\",tau_ms=1}",
                      "{ name = 'difference', tau_ms = 2 }"};
          if (slot->kind == kerf::LawKind::stabiliser)
            values = {"none", "passivity", "{ name = \"energy_bounding\" }"};
        } else if constexpr (is_same_v<T, std::array<double, 3>> ||
                             is_same_v<T, std::optional<std::array<double, 3>>> ||
                             is_same_v<T, std::optional<kerf::VoxelGrid>>) {
          list(3);
        } else if constexpr (is_same_v<T, std::optional<std::array<double, 2>>>) {
          list(2);
        } else if constexpr (is_same_v<T, std::optional<std::array<double, 4>>>) {
          list(4);
        } else if (lo < hi) {
          values.insert(values.end(), {low, high});
        }
      },
      key.at(parts));
  return values;
}

}  // namespace

TEST_CASE("an axis takes every value of every key that a scene takes, alone and in a list") {
  for (const kerf::SceneKey& key : kerf::scene_keys()) {
    const std::string name(key.name);
    CAPTURE(name);
    const std::vector<std::string> values = values_of_key(key);
    REQUIRE_FALSE(values.empty());
    std::string all;
    for (const std::string& value : values) all += (all.empty() ? "" : ",") + value;
    // A bracket that opens a bare text is that of a list: its commas are not between values.
    const bool is_text = std::ranges::find(values, "[y") != values.end();
    if (is_text) all.replace(all.find("[y"), 2, "\"[y\"");
    CAPTURE(all);
    CHECK(parse_axis(name + "=" + all).values.size() == values.size());
    for (const std::string& value : values) {
      CAPTURE(value);
      CHECK(parse_axis(name + "=" + value).values == std::vector<std::string>{value});
    }
  }
  CHECK(parse_axis("force.stabiliser=none,passivity").values.size() == 2);
}

TEST_CASE("the numbers of a law are axes below its key, whichever law it is") {
  CHECK(parse_axis("force.law.hardening_n_per_mm3=0:1:3").values ==
        std::vector<std::string>{"0", "0.5", "1"});
  CHECK(parse_axis("servo.velocity.tau_ms=1,2").key == "servo.velocity.tau_ms");
  for (const char* const text : {"force.law.=1", "force.law.a.b=1", "force.friction.a=1"}) {
    CHECK(refusal_of(text).starts_with("--set "));
  }
  const std::string scene =
      "[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = \"ball\"\nsize_vox = 8\n";
  const auto tau_ms = [&](const std::vector<std::string>& texts) {
    std::vector<kerf::KeyOverride> settings;
    for (const std::string& text : texts) settings.push_back(kerf::parse_setting(text));
    const kerf::SceneSpec read =
        kerf::parse_scene(scene, "scene.toml", kerf::scene_keys(), settings);
    return read.servo.velocity.settings.at(0).second;
  };
  CHECK(tau_ms({"servo.velocity=difference", "servo.velocity.tau_ms=3"}) == 3);
  CHECK(tau_ms({"servo.velocity.tau_ms=4", "servo.velocity={name=\"difference\",tau_ms=1}"}) == 4);
  CHECK(kerf::test::error_of([&] {
          tau_ms({"servo.velocity.tau_ms=4"});
        }).find("--set servo.velocity = { tau_ms = 4 } does not say which") != std::string::npos);
  CHECK(kerf::test::error_of([&] {
          tau_ms({"servo.velocity.taus=4", "servo.velocity=difference"});
        }).find("taus") != std::string::npos);
}

TEST_CASE("a sweep takes laws by name, and has energy by source, least energy and swing") {
  const TemporaryFolder folder;
  Process process({kBin + "/kerf-lab", "sweep", kScenes + "/touch.toml", "--set",
                   "force.stabiliser=none,passivity,{name=\"energy_bounding\"}", "--seconds", "3",
                   "--out", (folder / "out").string()},
                  folder / "log");
  CHECK(process.wait() == 0);
  const std::string table = text_of(folder / "out/sweep.csv");
  for (int run = 0; run < 3; ++run) {
    const auto row = row_of(table, run);
    CHECK(row.at("exit") == "0");
    CHECK(std::stod(row.at("port_minimum_j")) <= 0);
    double sum_j = 0;
    for (const std::string_view source : kerf::kEnergySourceNames) {
      sum_j += std::stod(row.at(std::string(source) + "_j"));
    }
    CHECK(sum_j == doctest::Approx(std::stod(row.at("energy_j"))));
    CHECK(row.at("swing") == "rest");
  }
}

TEST_CASE("a wall that the device cannot hold swings in a sweep, whatever the number of cores") {
  const TemporaryFolder folder;
  std::string before;
  for (const char* const jobs : {"1", "3"}) {
    const std::filesystem::path out = folder / jobs;
    Process process({kBin + "/kerf-lab", "sweep", scene_with_hand(folder), "--set",
                     "force.stiffness_n_per_mm=0.3,9", "--set", "force.unchecked_gain=true",
                     "--set", "servo.rate_hz=250", "--set", "force.damping_ns_per_mm=0",
                     "--seconds", "3", "--jobs", jobs, "--out", out.string()},
                    folder / "log");
    CHECK(process.wait() == 0);
    const std::string table = text_of(out / "sweep.csv");
    CHECK(row_of(table, 0).at("swing") == "rest");
    CHECK(row_of(table, 1).at("swing") == "swings");
    CHECK((before.empty() || table == before));
    before = table;
  }
}

TEST_CASE("the page of sweeps has the columns of the table, in their order") {
  const std::string page = text_of(std::filesystem::path(kScenes) / "../docs/scenes.md");
  std::size_t at = page.find("| `exit` |");
  for (const std::string& column : kerf::sweep::result_columns()) {
    CAPTURE(column);
    at = page.find("`" + column + "`", at);
    REQUIRE(at != std::string::npos);
  }
}

TEST_CASE("what is no axis is refused in one line that names it") {
  for (const std::string& text : kerf::test::cases_in(
           "force; =1; force.stiffness_n_per_mm=; force.stiffness_n_per_mm=1,,2; "
           "force.stiffness_n_per_mm=1:2:0; force.stiffness_n_per_mm=1:2:1; "
           "force.stiffness_n_per_mm=1:2:2.5; force.stiffness_n_per_mm=1:2:1e9; "
           "force.stifness=1; servo.rate=500; servo.rate_hz=500,1000,500; "
           "servo.rate_hz=1000,1e3; emulator.hand=a.toml; emulator.stay=true; "
           "emulator.hand-socket=s; servo.rate_hz=1000,+1000; force.friction=0.2, 0.2; "
           "force.friction=0,-0; device.offset_mm=[0,1,2],[0, 1, 2]; "
           "force.stiffness_n_per_mm=0.3:0.3:2")) {
    CAPTURE(text);
    const std::string line = refusal_of(text);
    CHECK(line.starts_with("--set "));
    CHECK(line.find('\n') == std::string::npos);
  }
  CHECK(refusal_of("force.stifness_n_per_mm=1").find("force.stiffness_n_per_mm?") !=
        std::string::npos);
  const std::vector<std::string> twice{"servo.rate_hz=500", "servo.rate_hz=1000"};
  CHECK_THROWS_AS(static_cast<void>(parse_axes(twice)), kerf::HilError);
  const std::vector<std::string> many{"servo.rate_hz=1:2:1000", "emulator.seed=1:2:1000",
                                      "cut.radius=1,2"};
  CHECK_THROWS_AS(static_cast<void>(parse_axes(many)), std::exception);
}

TEST_CASE("a part goes on where it stopped, without a row that was cut, and is one sweep's alone") {
  const TemporaryFolder folder;
  {
    Table table(folder / "out", "plan a");
    table.add(2, "two,");
    table.add(0, "zero,failed");
    CHECK_THROWS_AS(Table(folder / "out", "plan a"), kerf::HilError);  // at work
  }
  CHECK_THROWS_AS(Table(folder / "out", "plan b"), kerf::HilError);
  std::ofstream(folder / "out/sweep.part", std::ios::app) << "1,on";
  {
    Table table(folder / "out", "plan a");
    CHECK(table.size() == 2);
    CHECK(table.has(2));
    CHECK_FALSE(table.has(1));
    table.add(1, "one,");
    CHECK(table.failed() == 1);
    table.finish("name,message");
  }
  CHECK(text_of(folder / "out/sweep.csv") == "run,name,message\n0,zero,failed\n1,one,\n2,two,\n");
  CHECK_FALSE(std::filesystem::exists(folder / "out/sweep.part"));
  CHECK_THROWS_AS(Table(folder / "out", "plan a"), kerf::HilError);  // done
}

TEST_CASE("a sweep gives the same bytes on any number of cores, interrupted or not") {
  const TemporaryFolder folder;
  const std::string scene = scene_with_hand(folder);
  Process two(sweep(scene, folder / "two", "2"), folder / "two.log");
  CHECK(two.wait() == 0);
  {
    Process cut(sweep(scene, folder / "cut", "1"), folder / "cut.log");
    REQUIRE(eventually(
        [&] {
          const std::string part = text_of(folder / "cut/sweep.part");
          return std::ranges::count(part, '\n') >= 2;
        },
        120s));
    cut.signal(SIGINT);
    CHECK(cut.wait() == 130);
    CHECK(cut.output().find("of 6 runs are kept") != std::string::npos);
  }
  Process rest(sweep(scene, folder / "cut", "1"), folder / "rest.log");
  CHECK(rest.wait() == 0);
  const std::string table = text_of(folder / "two/sweep.csv");
  CHECK(table == text_of(folder / "cut/sweep.csv"));
  CHECK(std::ranges::count(table, '\n') == 7);
}

TEST_CASE("a sweep over fault scripts tells how much each of them changed") {
  const TemporaryFolder folder;
  const std::string faults = kScenes + "/../hil/faults/";
  Process process({kBin + "/kerf-lab", "sweep", kScenes + "/touch.toml", "--set",
                   "emulator.fault=" + faults + "lost_reports.toml," + faults + "all_well.toml",
                   "--seconds", "3", "--out", (folder / "out").string()},
                  folder / "log");
  CHECK(process.wait() == 0);
  const std::string table = text_of(folder / "out/sweep.csv");
  const auto lost = row_of(table, 0), well = row_of(table, 1);
  CHECK(lost.at("injected") == lost.at("lost_packets"));
  CHECK(std::stoi(lost.at("injected")) > 0);
  CHECK(well.at("injected") == "0");
}

TEST_CASE("a sweep that is killed takes its programs with it") {
  const TemporaryFolder folder;
  setenv("TMPDIR", folder.path().c_str(), 1);
  Process process(
      {kBin + "/kerf-lab", "sweep", kScenes + "/touch.toml", "--set", "servo.rate_hz=500,1000",
       "--seconds", "10000", "--jobs", "1", "--out", (folder / "out").string()},
      folder / "log");
  unsetenv("TMPDIR");
  REQUIRE(eventually([&] { return processes_of(folder.path()) >= 3; }, 60s));
  process.signal(SIGKILL);
  process.wait();
  CHECK(eventually([&] { return processes_of(folder.path()) == 0; }, 20s));
}

TEST_CASE(
    "a run of a sweep is the demo's, bit by bit; a run that fails is a row with its message") {
  const TemporaryFolder folder;
  Process process({kBin + "/kerf-lab", "sweep", kScenes + "/touch.toml", "--set",
                   "servo.rate_hz=99,1000", "--seconds", "1", "--out", (folder / "out").string()},
                  folder / "log");
  CHECK(process.wait() == 1);
  const std::string table = text_of(folder / "out/sweep.csv");
  const auto refused = row_of(table, 0), fine = row_of(table, 1);
  CHECK(refused.at("exit") == "2");
  CHECK(refused.at("message").find("servo.rate_hz = 99") != std::string::npos);
  CHECK(refused.at("output_hash").empty());
  CHECK(fine.at("exit") == "0");

  Pair pair;  // as ./kerf demo starts the two
  pair.scene = "touch.toml";
  pair.start("touch.toml", {"--virtual", "--seconds", "1", "--device", "omni", "--rate", "1000"},
             {"--lockstep", "--rate", "1000", "--unit-mm", "1"});
  REQUIRE(pair.controller->wait() == 0);
  const auto report = pair.report();
  CHECK(report["output_hash"] == fine.at("output_hash"));
  CHECK(report["volume_hash"] == fine.at("volume_hash"));
  CHECK(report["config_hash"] == fine.at("config_hash"));
  CHECK(std::to_string(report["contact_ticks"].get<int>()) == fine.at("contact_ticks"));
}

}  // namespace kerf::sweep_test
