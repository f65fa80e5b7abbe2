// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "tests/studies/ranges/combination.hpp"
#include "tests/studies/ranges/covering.hpp"
#include "tests/studies/ranges/extreme_rows.hpp"
#include "tests/studies/ranges/key_levels.hpp"
#include "tests/studies/ranges/key_study.hpp"
#include "tests/studies/ranges/rules.hpp"
#include "tests/studies/studies_line.hpp"

namespace kerf::ranges_test {

using namespace kerf::ranges;

namespace {

/// The one force law that this program knows.
template <class N>
struct Spring {
  static constexpr const char* kName = "spring";
  static constexpr const char* kMeaning = "for a test";
  static constexpr std::array<LawSetting, 1> kSettings{{{"gain", "", 0, 4, 1, "of the spring"}}};
  struct State {};
  explicit Spring(const LawSetup&) {}
  DeviceVec<typename N::Real> step(const ForceInput<N>& in, State&) const noexcept {
    return in.spring_mm;
  }
};
KERF_REGISTER_FORCE_LAW(Spring)

LoadedScene plain_scene(NumericKind numeric = NumericKind::fixed, const KeyTexts& texts = {}) {
  const SceneFolder folder;
  const auto file = folder.path() / "scene.toml";
  std::ofstream(file) << scene_text(texts);
  return load_scene(file, {.numeric = numeric});
}

/// The rule that two ticks break: a quiet one, and what `change` makes of it.
template <class Change>
std::string rule_broken_by(Change&& change) {
  static const LoadedScene scene = plain_scene();
  Rules rules(scene, 1000);
  DeviceReport report;
  report.fresh = true;
  ServoOutput out;
  out.phase = Phase::active;
  out.motors_on = true;
  rules.look_at(report, out);
  change(report, out);
  rules.look_at(report, out);
  std::string names;
  for (const Violation& violation : rules.violations()) names += violation.rule + " ";
  return names;
}

std::vector<KeyRow> few_keys() {
  std::vector<KeyRow> rows;
  for (KeyLevels& levels : key_levels()) {
    for (const char* name : {"force.model", "force.stiffness_n_per_mm", "force.p0_n_per_mm2",
                             "limits.force_n", "cut.friction"}) {
      if (levels.key->name != name) continue;
      rows.push_back({levels, levels.ends, 0, {}});
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("each extreme names its rule, and a measurement or tests that exist") {
  CHECK(extreme_rows().size() >= 19);
  for (const ExtremeRow& row : extreme_rows()) {
    CAPTURE(row.name);
    CHECK(std::string(row.rule).size() > 10);
    CHECK((row.measure != nullptr || !row.shown_by.empty()));
    for (const ShownBy& test : row.shown_by) {
      std::ifstream file(std::string(KERF_TESTS_DIR) + "/" + test.file);
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      CAPTURE(test.name);
      CHECK(text.find('"' + std::string(test.name) + '"') != std::string::npos);
    }
  }
}

TEST_CASE("a setting that no scene takes is refused in one line, and is no pass") {
  const test::LabAnswer answer = test::studies("ranges --set force.stiffness_n_per_mm=1e9");
  CHECK(answer.code == 2);
  CHECK(
      answer.err ==
      "kerf-studies: --set: force.stiffness_n_per_mm = 1e+09 is out of range; use 0.001 to 100\n");
}

TEST_CASE("the rules see each way to break them, and nothing else") {
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput&) {}).empty());
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.velocity_mm_per_s[1] = std::numeric_limits<double>::quiet_NaN();
        }) == "finite ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.commanded_force_n = {0, 0.49, 0};
        }).empty());
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.commanded_force_n = {0, 0.51, 0};
        }) == "slew ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.commanded_force_n = {0, 3.31, 0};
        }) == "clamp slew ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.motors_on = false, out.dac_counts[2] = 1;
        }) == "off ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) { out.phase = Phase::armed; }) ==
        "off ");
  CHECK(rule_broken_by([](DeviceReport& report, ServoOutput& out) {
          report.fresh = false;
          out.commanded_force_n = {0.1, 0, 0};
        }) == "stale ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) {
          out.position_mm = {0, 11, 0};
        }) == "overspeed ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) { out.absorbed_mj = 0.1; }) ==
        "energy ");
  CHECK(rule_broken_by([](DeviceReport&, ServoOutput& out) { out.samples_read = 1001; }) ==
        "work ");
}

TEST_CASE("a covering array has every pair that may be, the same for a seed") {
  const std::vector<int> counts{2, 3, 4, 1, 3};
  // The last factor counts only with level 1 of the first.
  const Factors factors{
      .level_counts = counts,
      .rare = {false, false, false, true, false},
      .deciding = 1,
      .may = [](const Levels& row, std::size_t factor, int) { return factor != 4 || row[0] == 1; }};
  const std::vector<Levels> rows = covering_rows(factors, 3);
  CHECK(rows == covering_rows(factors, 3));
  CHECK(rows != covering_rows(factors, 4));
  PairTable table(counts);
  for (const Levels& row : rows) {
    CHECK((row[4] < 0 || row[0] == 1));
    table.take(row);
  }
  for (std::size_t f = 0; f < counts.size(); ++f) {
    for (std::size_t g = f + 1; g < counts.size(); ++g) {
      for (int a = 0; a < counts[f]; ++a) {
        for (int b = 0; b < counts[g]; ++b) {
          CAPTURE(f);
          CAPTURE(g);
          CHECK(table.has(f, a, g, b) == !(f == 0 && a == 0 && g == 4));
        }
      }
    }
  }
}

TEST_CASE("every range of the table has both of its ends, and a new key by itself") {
  for (const KeyLevels& levels : key_levels()) {
    CAPTURE(levels.key->name);
    CHECK(levels.ends.size() >= (levels.key->name == "volume.file" ? 1 : 2));
    const Range& range = levels.key->allowed.range;
    if (range.lo < range.hi) CHECK(levels.beyond.size() >= 5);
  }
  std::vector<SceneKey> keys(scene_keys().begin(), scene_keys().end());
  const auto force = std::ranges::find(keys, "limits.force_n", &SceneKey::name);
  SceneKey added = *force;
  added.name = "limits.new_n";
  added.allowed.range = {2, 7};
  keys.push_back(added);
  const auto all = key_levels(keys);
  CHECK(all.back().key->name == "limits.new_n");
  CHECK(all.back().ends == std::vector<std::string>{"2.0", "7.0"});
}

TEST_CASE("every law that the program knows has the ends of its settings") {
  const std::vector<KeyLevels> all = key_levels();
  const auto levels_of = [&](std::string_view key) -> const KeyLevels& {
    return *std::ranges::find(all, key, [](const KeyLevels& levels) { return levels.key->name; });
  };
  const KeyLevels& velocity = levels_of("servo.velocity");
  CHECK(velocity.ends == std::vector<std::string>{
                             "{ name = \"difference\" }", "{ name = \"difference\", tau_ms = 0.0 }",
                             "{ name = \"difference\", tau_ms = 1000.0 }", "{ name = \"foaw\" }"});
  CHECK(std::ranges::count(velocity.beyond, "{ name = \"difference\", tau_ms = 1001.0 }") == 1);
  CHECK(std::ranges::count(velocity.beyond, "{ name = \"nonsense\" }") == 1);
  CHECK(levels_of("force.stabiliser").ends.size() == 6);
  CHECK(levels_of("force.law").ends ==
        std::vector<std::string>{"{ name = \"spring\" }", "{ name = \"spring\", gain = 0.0 }",
                                 "{ name = \"spring\", gain = 4.0 }"});
}

TEST_CASE(
    "a scene at an end keeps every rule; what is refused is told; the same again on two threads") {
  const SceneFolder folder;
  const auto file = folder.path() / "scene.toml";
  const SceneOutcome refused =
      run_combination({{"tool.radius_mm", "1000"}}, NumericKind::fixed, file);
  CHECK(refused.refused);
  CHECK(refused.violations.empty());
  const SceneOutcome deep = run_combination({{"volume.iso", "1.0"}}, NumericKind::fixed, file);
  CHECK(deep.felt);
  CHECK(deep.violations.empty());
  const std::vector<KeyRow> keys = few_keys();
  const auto study = [&](std::size_t jobs) {
    return study_pairs(
        keys, {.numerics = {NumericKind::fixed}, .combinations = 40, .seed = 5, .jobs = jobs},
        {[](double, const std::string&) {}, [](const Broken&) {}, [](const PairRows&) {}});
  };
  const PairRows one = study(1), two = study(2);
  CHECK(one.tally.broken.empty());
  CHECK(one.tally.ran >= 40);
  CHECK(one.tally.felt > 20);
  CHECK(one.together == two.together);
  CHECK(one.tally.ticks == two.tally.ticks);
  CHECK(one.tally.cut == two.tally.cut);
}

TEST_CASE_TEMPLATE_DEFINE("a servo goes on from another's state with the same bits", N,
                          restore_id) {
  const auto numeric = static_cast<NumericKind>(N::value);
  LoadedScene scene = plain_scene(numeric), twin = scene;
  const StressInput hand = hard_hand(scene);
  const auto servo = compile(scene), other = compile(twin);
  const std::size_t half = hand.reports.size() / 2 + 37;
  ServoOutput a, b;
  for (std::size_t i = 0; i < half; ++i) a = servo->step(hand.reports[i]);
  const auto kept = servo->keep();
  for (std::size_t i = half; i < hand.reports.size(); ++i) a = servo->step(hand.reports[i]);
  other->restore(*kept);
  for (std::size_t i = half; i < hand.reports.size(); ++i) b = other->step(hand.reports[i]);
  CHECK(a.output_hash == b.output_hash);
  CHECK(std::ranges::equal(servo->density(0), other->density(0)));
  // The first tick decides too: one report less is another state.
  other->restore(*kept);
  for (std::size_t i = half + 1; i < hand.reports.size(); ++i) b = other->step(hand.reports[i]);
  CHECK(a.output_hash != b.output_hash);
}
template <NumericKind kNumeric>
struct OfKind {
  static constexpr NumericKind value = kNumeric;
};
using FixedKind = OfKind<NumericKind::fixed>;
using DoubleKind = OfKind<NumericKind::float64>;
TEST_CASE_TEMPLATE_INVOKE(restore_id, FixedKind, DoubleKind);

TEST_CASE("a state of another scene is refused") {
  LoadedScene fixed = plain_scene(), doubles = plain_scene(NumericKind::float64),
              small = plain_scene(NumericKind::fixed, {{"volume.crop", "false"}});
  const auto servo = compile(fixed), other = compile(doubles), third = compile(small);
  CHECK_THROWS_AS(other->restore(*servo->keep()), std::invalid_argument);
  CHECK_THROWS_AS(third->restore(*servo->keep()), std::invalid_argument);
}

TEST_CASE("a run in two halves ends alike, and cuts, fades in and books as it should") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    const LongRun run = run_long(numeric, 3001, [](double) {});
    for (const Violation& violation : run.violations)
      FAIL_CHECK(violation.rule << ": " << violation.what);
    CHECK(run.ticks == 3001);
    CHECK(run.removed > 0);
    CHECK(run.ramps >= 6);
    CHECK(run.longest_ramp == run.shortest_ramp);
  }
}

}  // namespace kerf::ranges_test
