// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/stability/axis_simulation.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "hil/hil_error.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/map_file.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/text/json.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::zwidth_test {

using namespace kerf::zwidth;
using kerf::test::cases_in, kerf::test::lab, kerf::test::LabAnswer, kerf::test::TemporaryFolder,
    kerf::test::text_of;

namespace {

/// A law as a program of a user's own registers it: a bare spring; above 60 N/mm it breaks.
template <class N>
class BareSpring {
 public:
  static constexpr const char* kName = "bare_spring";
  static constexpr const char* kMeaning = "a spring, for a test";
  static constexpr std::array<LawSetting, 1> kSettings{
      {{"stiffness_n_per_mm", "N/mm", 0, 100, 1, "of the spring"}}};
  struct State {};

  explicit BareSpring(const LawSetup& setup)
      : stiffness_(typename N::Ratio(setup["stiffness_n_per_mm"])) {}
  [[nodiscard]] DeviceVec<typename N::Real> step(const ForceInput<N>& in, State&) const noexcept {
    using Real = typename N::Real;
    if constexpr (!N::kIsFixed) {
      if (stiffness_ > 60) return {Real(0), Real(0) / Real(0), Real(0)};
    }
    return {Real(0), multiply<Real>(stiffness_, in.spring_mm.y), Real(0)};
  }

 private:
  typename N::Ratio stiffness_;
};

/// The loop of the theory.
LoopCase ideal(double delay_periods) {
  LoopCase subject;
  subject.loop.viscous_ns_per_mm = 0.0002;
  subject.loop.delay_s = delay_periods * subject.loop.period_s;
  subject.estimator = {LawKind::velocity, "difference", {}};
  subject.law = Law::two_sided;
  subject.numeric = NumericKind::float64;
  subject.limits = false;
  return subject;
}

bool swings(const LoopCase& subject, double stiffness, bool by_energy = false) {
  StepCounter ticks;
  const LimitCycle swing = hit_one_axis(subject, stiffness, {}, kLimitS, 0, ticks);
  return by_energy ? swing.active : swing.swings;
}

/// How many random presses a test makes: KERF_PRESSES, of `.ci/all ranges`, or so many.
int presses_or(int standard) {
  const char* const wanted = std::getenv("KERF_PRESSES");
  return wanted != nullptr ? std::atoi(wanted) : standard;
}

constexpr const char* kSmall =
    "zwidth --damping 0,0.002,0.02 --stiffness 0.2:0.4:6 --seeds 2 --delay 0,1 ";

/// One column of one axis, with these values and the standards of the rest.
Column column_of(const std::string& stiffness, double seconds,
                 const std::vector<std::pair<AxisId, std::string>>& given) {
  MapSpec spec;
  spec.stiffness_n_per_mm = stiffness_values(stiffness);
  spec.seconds = seconds;
  Assignment values;
  for (const auto& [axis, value] : given) values[index_of(axis)] = value;
  StepCounter ticks;
  return measure_column(spec, values, ticks);
}

MapSpec two_cells() {
  MapSpec spec;
  spec.mapped = {index_of(AxisId::damping), kAxisCount};
  spec.table[index_of(AxisId::damping)] = {"0.002"};
  spec.stiffness_n_per_mm = {0.2, 1};
  return spec;
}

/// The verdict on a synthetic run of 1,600 ticks: position and energy given by tick. Encoder step 1
/// mm, push 1 N, held as `take` has it.
struct Sample {
  double tip_mm, given_mj;
  bool is_held = false;
};
template <class Run>
LimitCycle verdict_on(const Run& run, double step_mm = 1) {
  constexpr std::int64_t kTicks = 1600;
  LimitCycleDetector detector({.limit = kTicks, .first = 100, .settled = 50}, step_mm, 1);
  for (std::int64_t tick = 0;; ++tick) {
    REQUIRE(tick < kTicks);
    const Sample now = run(static_cast<double>(tick));
    if (detector.take(now.tip_mm, now.given_mj, now.is_held)) return detector.verdict();
  }
}

bool rests(const LimitCycle& verdict) {
  return !verdict.swings && !verdict.active && !verdict.undecided;
}

/// All keys of a map, without those of the axes. The first column and cell have those of all.
std::set<std::string> keys_in(const Json& map) {
  std::set<std::string> keys;
  const auto take = [&](const Json& object) {
    for (const auto& [name, value] : object.members()) keys.insert(name);
  };
  const Json& column = map.at("columns").at(0);
  take(map);
  take(column);
  for (const char* part : {"by_travel", "by_energy", "analytic"}) take(column.at(part));
  take(column.at("cells").at(0));
  return keys;
}

}  // namespace

KERF_REGISTER_FORCE_LAW(BareSpring)

TEST_CASE("rest is proven, a swing reverses, and what is open is undecided") {
  constexpr double kTurn = 0.3;  // rad a tick
  const auto swing = [](double t, double mm) { return mm / 2 * std::sin(kTurn * t); };
  CHECK(rests(verdict_on([](double t) { return Sample{t < 20 ? 9 - t : -11, 0, t > 20}; })));
  CHECK(rests(verdict_on([&](double t) { return Sample{swing(t, 0.99), 0}; })));
  CHECK(verdict_on([&](double t) { return Sample{swing(t, 1.2), 0}; }).swings);
  // It fluctuates without end, and its last third is a good deal less than the middle one.
  CHECK(verdict_on([&](double t) {
          return Sample{swing(t, 5 + 3 * std::cos(t / 190)), 0};
        }).swings);
  // Within a step, and the wall goes on giving energy.
  const LimitCycle dither = verdict_on([&](double t) { return Sample{swing(t, 0.5), 0.1 * t}; });
  CHECK(dither.active);
  CHECK_FALSE(dither.swings);
  CHECK_FALSE(dither.undecided);
  // A decay that has not ended; a creep; a burst in one half of the last half; energy once.
  for (const auto& run : std::vector<std::function<Sample(double)>>{
           [&](double t) {
             return Sample{swing(t, 9 * std::exp(-t / 900)), 0};
           },
           [](double t) {
             return Sample{-20 + 20 * std::exp(-t / 900), 0};
           },
           [](double t) {
             return Sample{t / 100, 0};
           },
           [&](double t) {
             return Sample{t > 900 && t < 1000 ? swing(t, 3) : 0, 0};
           },
           [](double t) {
             return Sample{0, t > 1000 ? 5.0 : 0};
           }}) {
    const LimitCycle open = verdict_on(run);
    CHECK_FALSE(open.swings);
    CHECK_FALSE(open.active);
    CHECK(open.undecided);
  }
  // It came to rest long ago, held by nothing: an encoder counts at the limit, none at once.
  const auto decay = [&](double t) { return Sample{swing(t, 9 * std::exp(-t / 20)), 0}; };
  CHECK(rests(verdict_on(decay)));
  CHECK(rests(verdict_on(decay, 0)));
}

TEST_CASE("a run of one tick, of none and of a law without a number has a verdict") {
  for (const std::int64_t limit : {0, 1, 7, 8, 9}) {
    LimitCycleDetector detector({.limit = limit, .first = 0, .settled = 5}, 0.05, 1);
    int ticks = 0;
    while (!detector.take(0, 0, false)) REQUIRE(++ticks < 10);
    CHECK(rests(detector.verdict()));
    CHECK(detector.lost().swings);
  }
}

TEST_CASE("an endless swing that fluctuates has one verdict, whatever --seconds says") {
  const TemporaryFolder folder;
  const std::string file = (folder / "cell.csv").string();
  for (const char* cell : {"--delay 0 --damping 0.000769 --stiffness 4.5804",
                           "--delay 0 --damping 0.002 --stiffness 8"}) {
    std::string first;
    for (const char* seconds : {"0.1", "3", "6", "12", "30", "60"}) {
      CAPTURE(seconds);
      REQUIRE(lab(std::string("zwidth --loop kerf --seeds 1 ") + cell + " --seconds " + seconds +
                  " --csv " + file)
                  .code == 0);
      if (first.empty()) first = text_of(file);
      CHECK(text_of(file) == first);
    }
    CHECK(first.find(",1,1,0,") != std::string::npos);
  }
}

TEST_CASE("no cell that rests travels more than one encoder step in the last half minute") {
  StepCounter ticks;
  int resting = 0;
  for (const double damping : {0.002, 0.012, 0.025, 0.03}) {
    LoopCase subject = subject_of({});
    subject.damping_ns_per_mm = damping;
    for (double stiffness = 0.3; stiffness < 20; stiffness *= 1.4) {
      double lowest = 0, highest = 0;
      std::int64_t tick = 0;
      const LimitCycle seen = hit_one_axis(subject, stiffness, {.hit_mm_per_s = 50}, kLimitS, 1,
                                           ticks, [&](const SwingTick& now) {
                                             if (++tick <= 30000) lowest = highest = now.tip_mm;
                                             lowest = std::min(lowest, now.tip_mm);
                                             highest = std::max(highest, now.tip_mm);
                                           });
      if (!rests(seen)) continue;
      ++resting;
      CAPTURE(damping);
      CAPTURE(stiffness);
      CHECK(highest - lowest <= subject.loop.quantum_mm);
      CHECK(seen.travel_mm <= subject.loop.quantum_mm);
    }
  }
  CHECK(resting > 15);
}

namespace {

/// The verdict of a map on one cell of kerf's loop without friction.
LimitCycle frictionless_cell(const std::vector<std::pair<AxisId, const char*>>& more,
                             double stiffness) {
  MapSpec spec;
  spec.stiffness_n_per_mm = {stiffness};
  spec.seeds = 1;
  Assignment values;
  values[index_of(AxisId::friction)] = "0";
  for (const auto& [axis, value] : more) values[index_of(axis)] = value;
  StepCounter ticks;
  return measure_column(spec, values, ticks).cells.at(0);
}

}  // namespace

TEST_CASE("a heavy device that bounces ever less is no swing") {
  // 14 kg fly for 11 s between two bounces, far longer than the period of the spring.
  for (const char* damping : {"0.002", "0.01"}) {
    const LimitCycle seen =
        frictionless_cell({{AxisId::mass, "14"}, {AxisId::damping, damping}}, 1);
    CAPTURE(std::string(damping));
    CHECK_FALSE(seen.swings);
    CHECK_FALSE(seen.active);
    CHECK(seen.undecided);
  }
  CHECK(frictionless_cell({{AxisId::mass, "14"}, {AxisId::damping, "0.002"}}, 3).swings);
}

TEST_CASE("what fixed numbers alone keep up, without encoder steps, is arithmetic") {
  const auto cell = [](double stiffness, const char* numeric) {
    return frictionless_cell(
        {{AxisId::quantum, "0"}, {AxisId::damping, "0"}, {AxisId::numeric, numeric}}, stiffness);
  };
  for (const double stiffness : {0.24, 0.29}) {
    const LimitCycle fixed = cell(stiffness, "fixed");
    CAPTURE(stiffness);
    CHECK(cell(stiffness, "double").rests());
    CHECK(fixed.arithmetic);
    CHECK_FALSE((fixed.swings || fixed.active || fixed.undecided));
    CHECK(fixed.travel_mm > 1e-4);
    CHECK(fixed.travel_mm < 1e-3);
  }
  // A swing of both is one, whatever the numbers.
  CHECK(cell(0.45, "fixed").swings);
  CHECK(cell(0.45, "double").swings);
}

TEST_CASE("the first swing is the lowest of all seeds, as an independent simulation has it") {
  // Of docs/theory.md alone: closed-form motion, a push of 0.5 N, five speeds and five phases, runs
  // of 60 s, K in steps of 3 %.
  struct Case {
    const char *damping, *delay;
    double first_n_per_mm;
  };
  for (const Case& one : {Case{"0.002", "0", 10.61}, {"0.002", "1", 2.732}, {"0", "0", 6.631}}) {
    CAPTURE(one.damping);
    CAPTURE(one.delay);
    MapSpec spec;
    spec.stiffness_n_per_mm = {0.4 * one.first_n_per_mm, 2 * one.first_n_per_mm};
    spec.seed = 0;
    spec.seeds = 3;
    Assignment values;
    for (const auto& [axis, value] : {std::pair{AxisId::damping, one.damping},
                                      {AxisId::delay, one.delay},
                                      {AxisId::friction, "0.1"},
                                      {AxisId::estimator, "difference"},
                                      {AxisId::limits, "off"},
                                      {AxisId::push, "0.5"},
                                      {AxisId::numeric, "double"}}) {
      values[index_of(axis)] = value;
    }
    StepCounter ticks;
    const StabilityBoundary swing = measure_column(spec, values, ticks).swing;
    CHECK(swing.first_n_per_mm < 1.05 * one.first_n_per_mm);
    CHECK(swing.first_n_per_mm > 0.7 * one.first_n_per_mm);
    CHECK(swing.last_n_per_mm >= swing.first_n_per_mm);
    // The least of maps of one seed each.
    double least = StabilityBoundary::kNever;
    spec.seeds = 1;
    for (spec.seed = 0; spec.seed < 3; ++spec.seed) {
      least = std::min(least, measure_column(spec, values, ticks).swing.first_n_per_mm);
    }
    CHECK(swing.first_n_per_mm == least);
  }
}

TEST_CASE("a device that creeps into the wall does not swing") {
  LoopCase subject = subject_of({});
  subject.loop.viscous_ns_per_mm = 2;
  StepCounter ticks;
  for (const double stiffness : {0.05, 0.3, 1.0, 50.0}) {
    CAPTURE(stiffness);
    const LimitCycle creep =
        hit_one_axis(subject, stiffness, {},
                     std::max(kLimitS, needed_seconds(subject, stiffness, {})), 1, ticks);
    CHECK_FALSE(creep.swings);
    CHECK_FALSE(creep.undecided);
    CHECK(creep.travel_mm <= subject.loop.quantum_mm);
  }
}

TEST_CASE("the analytic lines hold for the loop that they are derived for alone") {
  using Given = std::vector<std::pair<AxisId, const char*>>;
  const auto analytic = [](const Given& given) {
    Assignment values;
    values[index_of(AxisId::loop)] = "ideal";
    for (const auto& [axis, value] : given) values[index_of(axis)] = value;
    return analytic_of(subject_of(values));
  };
  CHECK(analytic({}).exact_holds);
  CHECK(analytic({{AxisId::filter, "3"}, {AxisId::hand, "firm"}, {AxisId::delay, "2.5"}})
            .exact_holds);
  CHECK(analytic({{AxisId::law, "linear"}}).passive_holds);
  CHECK(analytic({{AxisId::friction, "0.1"}}).passive_holds);
  for (const auto& [axis, value] : Given{{AxisId::friction, "0.1"},
                                         {AxisId::quantum, "0.05"},
                                         {AxisId::law, "linear"},
                                         {AxisId::law, "coupling"},
                                         {AxisId::law, "bare_spring"},
                                         {AxisId::estimator, "foaw"},
                                         {AxisId::stabiliser, "passivity"},
                                         {AxisId::limits, "on"},
                                         {AxisId::numeric, "fixed"}}) {
    CAPTURE(value);
    CHECK_FALSE(analytic({{axis, value}}).exact_holds);
  }
  for (const auto& [axis, value] : Given{{AxisId::law, "coupling"},
                                         {AxisId::estimator, "foaw"},
                                         {AxisId::stabiliser, "energy_bounding"},
                                         {AxisId::limits, "on"},
                                         {AxisId::numeric, "fixed"}}) {
    CAPTURE(value);
    CHECK_FALSE(analytic({{axis, value}}).passive_holds);
  }
  CHECK_FALSE(analytic_of(subject_of({})).exact_holds);
}

TEST_CASE("the values of an axis rise, in whatever order they are given") {
  using Values = AxisValues;
  CHECK(axis_values(AxisId::damping, "0.02,0,1e-3") == Values{"0", "1e-3", "0.02"});
  CHECK(axis_values(AxisId::delay, "3:0:4") == axis_values(AxisId::delay, "0:3:4"));
  CHECK(axis_values(AxisId::rate, "500") == Values{"500"});
  CHECK(axis_values(AxisId::law, "linear,coupling") == Values{"linear", "coupling"});
  CHECK(stiffness_values("5,0.1,2") == std::vector<double>{0.1, 2, 5});
  CHECK(stiffness_values("50:0.05:7") == stiffness_values("0.05:50:7"));
  for (const char* twice : {"0,0.0", "1,0,1e0", "1:1:3"}) {
    CAPTURE(twice);
    CHECK_THROWS_AS(static_cast<void>(axis_values(AxisId::damping, twice)), HilError);
    CHECK_THROWS_AS(static_cast<void>(stiffness_values(twice)), HilError);
  }
}

TEST_CASE("a crossing that is no stiffness is null with its reason") {
  const auto reason = [](const std::string& stiffness, const char* loop) {
    const Column column = column_of(stiffness, kLimitS, {{AxisId::loop, loop}});
    return no_crossing(column, column.swing.first_n_per_mm);
  };
  CHECK(reason("0.1,0.2", "ideal") == "above all");
  CHECK(reason("30,50", "ideal") == "below all");
  CHECK(reason("0.2,10", "ideal") == "");
  CHECK(reason("1.583", "ideal") == "undecided");  // the exact one is 1.59
  CHECK(no_crossing({}, 0) == "not measured");
  const TemporaryFolder folder;
  const std::string file = (folder / "map.json").string();
  REQUIRE(lab("zwidth --loop ideal --damping 0.002 --stiffness 30,50 --json " + file).code == 0);
  const Json json = Json::parse(text_of(file));
  const Json& boundary = json.at("columns").at(0).at("by_travel");
  CHECK(boundary.at("first_n_per_mm").is_null());
  CHECK(boundary.at("reason").get<std::string>() == "below all");
}

TEST_CASE("docs/stability.md lists the columns of a map's CSV and the keys of its JSON") {
  const TemporaryFolder folder;
  const std::string csv = (folder / "map.csv").string(), json = (folder / "map.json").string();
  REQUIRE(lab("zwidth --damping 0.002 --stiffness 1 --csv " + csv + " --json " + json).code == 0);
  const std::string page = text_of(KERF_DOCS "/stability.md");
  const std::size_t begin = page.find("## Files of a map"), half = page.find("`--json`", begin);
  REQUIRE(half != std::string::npos);
  std::string documented;
  std::istringstream rows(page.substr(begin, half - begin));
  for (std::string line; std::getline(rows, line);) {
    if (!line.starts_with("| ") || line.starts_with("| column")) continue;
    documented += (documented.empty() ? "" : ", ") + line.substr(2, line.find(" |", 2) - 2);
  }
  std::string header = text_of(csv);
  header.resize(header.find('\n'));
  for (std::size_t at = 0; (at = header.find(',', at)) != std::string::npos; at += 2) {
    header.insert(at + 1, " ");
  }
  CHECK(documented == header);
  const std::string keys = page.substr(half);
  for (const std::string& key : keys_in(Json::parse(text_of(json)))) {
    CAPTURE(key);
    CHECK(std::regex_search(keys, std::regex("[ |]" + key + "[ ,:;]")));
  }
}

TEST_CASE("one axis in time has the exact boundary, by travel and by energy") {
  for (const double delay : {0.0, 0.5, 1.0, 2.3}) {
    for (const double damping : {0.002, 0.01}) {
      LoopCase subject = ideal(delay);
      subject.damping_ns_per_mm = damping;
      const double exact = highest_stiffness(subject.loop, damping);
      CAPTURE(delay);
      CAPTURE(damping);
      REQUIRE(exact > 0);
      for (const bool by_energy : {false, true}) {
        CHECK_FALSE(swings(subject, 0.99 * exact, by_energy));
        CHECK(swings(subject, 1.01 * exact, by_energy));
      }
    }
  }
}

TEST_CASE("Coulomb friction carries a wall without any damping, as computed elsewhere") {
  struct Cell {
    double coulomb_n, step_mm, stiffness;
  };
  for (const Cell& cell : {Cell{.02, .02, .384},
                           {.02, .055, .384},
                           {.05, .02, 1.736},
                           {.1, .02, 4.603},
                           {.26, .2, 10.532}}) {
    LoopCase subject = ideal(0);
    subject.law = Law::linear;
    subject.loop.viscous_ns_per_mm = 0;
    subject.loop.coulomb_n = cell.coulomb_n;
    subject.loop.quantum_mm = cell.step_mm;
    CAPTURE(cell.coulomb_n);
    CAPTURE(cell.step_mm);
    double stiffness = cell.stiffness / 2;
    const auto is_wide = [&] {  // as there: above three steps
      StepCounter ticks;
      const LimitCycle swing = hit_one_axis(subject, stiffness, {}, 3, 0, ticks);
      return swing.swings && swing.travel_mm > 3 * cell.step_mm;
    };
    while (!is_wide()) stiffness *= 1.03;
    CHECK(std::abs(stiffness / cell.stiffness - 1) < 0.1);
    CHECK(highest_stiffness(subject.loop, 0) == 0);
  }
}

TEST_CASE("a mass with friction comes to rest where its energy says, and stays") {
  SampledLoop loop;
  loop.coulomb_n = 0.1;
  OneAxisPlant plant(loop, 0.25, 0.75);
  plant.place(0, 100 * loop.period_s);  // 100 mm/s
  for (int tick = 0; tick < 200; ++tick) {
    plant.advance(0, 0);
    plant.advance(1, 0);
  }
  // m v^2 / 2 = f x: 0.045 kg * (0.1 m/s)^2 / 2 / 0.1 N.
  CHECK(std::abs(plant.tip_mm() - 2.25) < 1e-6);
  CHECK(plant.stuck());
  plant.advance(1, 0.0999);
  CHECK(plant.stuck());
  plant.advance(1, 0.1001);
  CHECK_FALSE(plant.stuck());
}

TEST_CASE("the whole arm comes to rest on a soft wall and swings on a hard one") {
  for (const NumericKind numeric : {NumericKind::fixed, NumericKind::float64}) {
    LoopCase subject = subject_of({});
    subject.numeric = numeric;
    subject.loop.delay_s = 0;
    const LoadedScene scene = walls_scene(subject);
    StepCounter ticks;
    for (std::size_t hit = 0; hit < kArmHits; ++hit) {
      CAPTURE(hit);
      const LimitCycle soft = hit_with_arm(scene, subject, 0.3, hit, {}, 4, 1, ticks);
      CHECK_FALSE(soft.swings);
      CHECK_FALSE(soft.active);
      CHECK_FALSE(soft.undecided);
      const LimitCycle hard = hit_with_arm(scene, subject, 40, hit, {}, 4, 1, ticks);
      CHECK(hard.swings);
      CHECK(hard.active);
    }
    CHECK(ticks.ticks() > 1000);
  }
}

TEST_CASE("a map has the same bytes on any number of threads and shards, and after a break") {
  const TemporaryFolder folder;
  const auto files = [&](const std::string& name) {
    return " --csv " + (folder / (name + ".csv")).string() + " --json " +
           (folder / (name + ".json")).string();
  };
  REQUIRE(lab(kSmall + std::string("--jobs 1 --part ") + (folder / "whole.part").string() +
              files("one"))
              .code == 0);
  REQUIRE(lab(kSmall + std::string("--jobs 3") + files("three")).code == 0);
  std::string parts;
  for (const char* shard : {"3", "1", "2"}) {
    const std::string part = (folder / (std::string("shard-") + shard + ".part")).string();
    REQUIRE(lab(kSmall + std::string("--shard ") + shard + "/3 --part " + part).code == 0);
    parts += " " + part;
  }
  REQUIRE(lab("zwidth --merge" + parts + files("merged")).code == 0);
  CHECK(text_of(folder / "one.csv").size() > 500);
  for (const char* end : {".csv", ".json"}) {
    const std::string one = text_of(folder / (std::string("one") + end));
    CHECK(one == text_of(folder / (std::string("three") + end)));
    CHECK(one == text_of(folder / (std::string("merged") + end)));
  }
  // Killed in the middle of a line: what is whole stays, the rest is measured again.
  const std::string whole = text_of(folder / "whole.part");
  std::ofstream(folder / "torn.part", std::ios::binary) << whole.substr(0, whole.size() * 3 / 5);
  const LabAnswer again =
      lab(kSmall + std::string("--part ") + (folder / "torn.part").string() + files("again"));
  CHECK(again.code == 0);
  CHECK(again.out.find("\n") != std::string::npos);
  CHECK(text_of(folder / "torn.part") == whole);
  CHECK(text_of(folder / "again.csv") == text_of(folder / "one.csv"));
  // Another seed is another map.
  const std::string cell = "zwidth --damping 0.002 --stiffness 9 --seeds 1 --seed ";
  REQUIRE(lab(cell + "1" + files("first")).code == 0);
  REQUIRE(lab(cell + "2" + files("second")).code == 0);
  CHECK(text_of(folder / "first.csv") != text_of(folder / "second.csv"));
}

TEST_CASE("parts that make no map are refused in one line, and nothing is lost") {
  const TemporaryFolder folder;
  const std::string a = (folder / "a.part").string(), b = (folder / "b.part").string(),
                    c = (folder / "c.part").string();
  REQUIRE(lab(kSmall + std::string("--shard 1/2 --part ") + a).code == 0);
  REQUIRE(lab(kSmall + std::string("--seed 2 --shard 2/2 --part ") + b).code == 0);
  REQUIRE(lab(kSmall + std::string("--shard 2/2 --part ") + c).code == 0);
  const std::string kept = text_of(a);
  const auto refused = [&](const std::string& line, const char* why) {
    const LabAnswer said = lab(line);
    CAPTURE(line);
    CAPTURE(said.err);
    CHECK(said.code == 2);
    CHECK(said.err.find(why) != std::string::npos);
    CHECK(std::count(said.err.begin(), said.err.end(), '\n') == 1);
  };
  refused("zwidth --merge " + a + " " + b, "seed 2, not the 1");
  refused("zwidth --merge " + a, "shard 2/2 is missing");
  refused("zwidth --merge " + a + " " + a, "again");
  refused("zwidth --merge " + (folder / "none.part").string(), "cannot be read");
  refused(kSmall + std::string("--hand firm --shard 1/2 --part ") + a, "another map or shard");
  std::string foreign = kept;
  const std::string program = "\"program\":\"";
  foreign.replace(foreign.find(program) + program.size(), 4, "none");
  std::ofstream(b, std::ios::binary) << foreign;
  refused("zwidth --merge " + b + " " + c, "another program measured it than");
  refused(kSmall + std::string("--shard 1/2 --part ") + b, "another program measured it, which");
  CHECK(text_of(b) == foreign);
  refused("zwidth --merge " + a + " " + c + " --csv " + c, "is a file of this run itself");
  refused(kSmall + std::string("--shard 1/2 --part ") + a + " --json " + a,
          "is a file of this run itself");
  std::string unknown = kept;  // of a program with a law that this one has not
  unknown.replace(unknown.find("\"axes\":{"), 8, "\"axes\":{\"law\":[\"anothers\"],");
  std::ofstream(b, std::ios::binary) << unknown;
  refused("zwidth --merge " + b + " " + c, "b.part: --law: anothers is unknown");
  // A version that this is not; a shard that is not done; text that is no part.
  std::string old = kept;
  old.replace(old.find(KERF_VERSION), std::string(KERF_VERSION).size(), "0.0.1");
  std::ofstream(b, std::ios::binary) << old;
  refused("zwidth --merge " + b + " " + c, "of version 0.0.1");
  std::ofstream(b, std::ios::binary) << kept.substr(0, kept.rfind('\n', kept.size() - 2) + 1);
  refused("zwidth --merge " + b + " " + c, "has 2 of its 3 columns");
  for (const char* shard : {"[0,0]", "[1,0]", "[3,2]"}) {
    std::string odd = kept;
    odd.replace(odd.find("[1,2]"), 5, shard);
    std::ofstream(b, std::ios::binary) << odd;
    refused("zwidth --merge " + b + " " + c, "is no part of a whole");
  }
  std::string more = kept;
  more.replace(more.find("\"cells\":[["), 10, "\"cells\":[[true,true,false,false,0,0,0],[");
  std::ofstream(b, std::ios::binary) << more;
  refused("zwidth --merge " + b + " " + c, "cells for ");
  std::ofstream(b, std::ios::binary) << "hello\n";
  refused("zwidth --merge " + b + " " + c, "line 1");
  std::ofstream(b, std::ios::binary) << "";
  refused("zwidth --merge " + b + " " + c, "no part of a map");
  CHECK(text_of(a) == kept);
}

TEST_CASE("axes that mean nothing are refused in one line; columns that cannot exist are told") {
  for (const std::string& line : cases_in(
           "--damping 1:1:5; --damping 0:1:1; --damping -1; --damping nan; "
           "--damping 0.02,2e-2; --rate 1000,1000; --rate 1000,500,1000.0; --law "
           "coupling,coupling; --damping 0,,1; "
           "--delay 65; --rate 0; --hand soft; --hand 1/2; --hand -1/0/0; --law none; "
           "--stiffness 0:1:5; --stiffness 0:0:1; --stiffness 1:2:1001; "
           "--stiffness 2,1,2; --stiffness 1:200:4; --seeds 0; "
           "--portraits /dev/null --cells 1:0.002 --seeds 2; --map damping; "
           "--map damping,damping; --map x,stiffness; --map delay,stiffness; "
           "--shard 3/2 --part x; --shard 0/2 --part x; --shard 1/2; --shard a/b; --mode 100; "
           "--arm --quantum 0.1; --stiffness 1,1.00000001; "
           "--estimator difference/tau_ms=5 --filter 5; --part /dev/null; "
           "--law paper --damping 0; --arm --law paper; --page /dev/null --cells 1:0.002; "
           "--page /dev/null --shard 1/2; --portraits /dev/null --cells 1:0.002 --damping 0.01; "
           "--portraits /dev/null --cells 1:0.002 --stiffness 1,2; "
           "--portraits /dev/null --cells 1:0.002,1:0.002; "
           "--portraits /dev/null --cells 0.00001:0; --portraits /dev/null --cells 127:2; "
           "--portraits /dev/null; --portraits /dev/null --cells 1; "
           "--portraits /dev/null --cells 1:0.002 --csv /dev/null; "
           "--page /dev/null --csv /dev/null; --page /dev/null --portraits /dev/null; "
           "--page /dev/null --rate 500; --cells 1:0.002; "
           "--portraits /dev/null --cells 1:0.002 --delay 0,1; --filter 5; "
           "--filter 0,5 --estimator difference,foaw; --stabiliser passivity/mass_kg=-1; "
           "--seconds 0; --plot /dev/null --delay 0:3:7 --quantum 0,0.1")) {
    const LabAnswer said = lab("zwidth " + line);
    CAPTURE(line);
    CAPTURE(said.err);
    CHECK(said.code == 2);
    CHECK(std::count(said.err.begin(), said.err.end(), '\n') == 1);
  }
  // B T/m above 2 without a delay: no wall may have it.
  const LabAnswer said = lab("zwidth --damping 0.002,0.2 --delay 0 --viscous 0 --stiffness 0.2,1");
  CHECK(said.code == 0);
  CHECK(said.out.find("1 of 2 columns are left empty: damping ") != std::string::npos);
  // What was measured beside it is not lost.
  const LabAnswer rates =
      lab("zwidth --arm --rate 1000,3000 --damping 0.002 --stiffness 0.2,1 --seeds 1");
  CHECK(rates.code == 0);
  CHECK(rates.out.find("1 of 2 columns are left empty: rate 3000 Hz: ") != std::string::npos);
}

TEST_CASE("what the emulated device cannot do, or the hand never meets, is empty and told") {
  const auto told = [](const char* line) {
    const LabAnswer said =
        lab(std::string("zwidth --arm --damping 0.002 --stiffness 0.3,0.31 --seeds 1 ") + line);
    CHECK(said.code == 0);
    return said.out;
  };
  CHECK(told("--delay 1,9").find("1 of 2 columns are left empty: delay 9 ms") != std::string::npos);
  CHECK(told("--device falcon --rate 500,2000")
            .find("1 of 2 columns are left empty: rate 2000 Hz:") != std::string::npos);
  CHECK(told("--delay 0.33,1").find("empty: delay 0.33 ms") != std::string::npos);
  CHECK(told("--viscous 2").find("empty: the hand did not bring the device to the wall") !=
        std::string::npos);
}

TEST_CASE("a map without any column that can exist is refused in one line") {
  for (const char* line :
       {"--damping 0.1:0.2:3", "--arm --damping 0 --delay 64", "--arm --damping 0 --rate 333"}) {
    const LabAnswer said = lab(std::string("zwidth --stiffness 0.3,3 ") + line);
    CAPTURE(line);
    CHECK(said.code == 2);
    CHECK(said.err.find("no column of this map can exist: ") != std::string::npos);
    CHECK(std::count(said.err.begin(), said.err.end(), '\n') == 1);
  }
}

TEST_CASE("behind a long delay a short hit does not take a flight for rest") {
  const Column column =
      column_of("0.5,1,2,5,10", 0.1, {{AxisId::delay, "64"}, {AxisId::damping, "0"}});
  CHECK(column.swing.re_entry_from_n_per_mm == 0);
  CHECK(column.cells.back().swings);
}

TEST_CASE("a column tells its first crossing and what comes to rest above it apart") {
  const auto column_over = [](const std::string& stiffness) {
    return column_of(stiffness, 0.5,
                     {{AxisId::loop, "ideal"}, {AxisId::delay, "0"}, {AxisId::damping, "0.01"}});
  };
  const Column column = column_over("0.1,1,10,50");
  Assignment ideal;
  ideal[index_of(AxisId::loop)] = "ideal";
  ideal[index_of(AxisId::delay)] = "0";
  const double exact = highest_stiffness(subject_of(ideal).loop, 0.01);
  CHECK(std::abs(column.swing.first_n_per_mm / exact - 1) < 0.01);
  CHECK(std::abs(column.energy.first_n_per_mm / exact - 1) < 0.01);
  CHECK(column.swing.re_entry_from_n_per_mm == 0);
  CHECK(column_over("0.1,1").swing.first_n_per_mm == StabilityBoundary::kNever);
  CHECK(column_over("30,50").swing.first_n_per_mm == 0);
}

TEST_CASE("a law of the user's own gets its map, on one axis and with the whole arm") {
  const TemporaryFolder folder;
  const auto verdicts = [&](const std::string& options) {
    const std::string file = (folder / "map.csv").string();
    REQUIRE(lab("zwidth --damping 0 --delay 0.5 --stiffness 0.3:30:4 --seeds 1 --csv " + file +
                " " + options)
                .code == 0);
    // From the stiffness on: the law's name stands before it.
    std::istringstream in(text_of(file));
    std::string all;
    for (std::string line; std::getline(in, line);) {
      std::size_t at = line.size();
      for (int comma = 0; comma < 7; ++comma) at = line.rfind(',', at - 1);
      all += line.substr(at) + "\n";
    }
    return all;
  };
  CHECK(verdicts("--law bare_spring") == verdicts("--law linear"));
  CHECK(verdicts("--law bare_spring --arm --numeric double").find(",1,1,") != std::string::npos);
  // What is no number is no wall: it counts as the worst, and nothing crashes.
  for (const char* where : {"", " --arm"}) {
    CHECK(lab(std::string("zwidth --law bare_spring --numeric double --damping 0 --delay 0 "
                          "--stiffness 61,62") +
              where)
              .out.find("below all") != std::string::npos);
  }
  CHECK(lab("zwidth --law bare_spring --stiffness 101,102 --damping 0").code == 2);
}

TEST_CASE("a stabiliser widens the map of a light push, behind a delay not that of a hard one") {
  const auto first = [](const std::string& stabiliser, const char* push) {
    return column_of(
               "0.1:50:20", 0.6,
               {{AxisId::damping, "0"}, {AxisId::stabiliser, stabiliser}, {AxisId::push, push}})
        .swing.first_n_per_mm;
  };
  CHECK(first("energy_bounding", "0.5") > 1.5 * first("none", "0.5"));
  CHECK(first("energy_bounding", "1.6") < 1.02 * first("none", "1.6"));
}

TEST_CASE("a search over presses finds no more than any press, given or random, bears") {
  for (const char* device : {"omni", "falcon"}) {
    CAPTURE(std::string(device));
    const auto first = [&](const char* push, const char* hit) {
      return column_of("0.5:20:8", kLimitS,
                       {{AxisId::device, device}, {AxisId::push, push}, {AxisId::hit, hit}})
          .swing.first_n_per_mm;
    };
    const double found = first("any", "any");
    // Two searches end within their steps of each other.
    for (const char* push : {"0.1", "0.5", "1", "1.6", "2.4"})
      CHECK(found < 1.03 * first(push, "50"));
    CHECK(found < 1.03 * first("any", "200"));
    CHECK(found < 0.8 * first("0.5", "0"));  // what a map of one push finds is too high
    // What the page recommends at most.
    Assignment values;
    values[index_of(AxisId::device)] = device;
    const LoopCase subject = subject_of(values);
    std::mt19937_64 random(17);
    const auto any = [&](double lowest, double highest) {
      return lowest + (highest - lowest) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    StepCounter ticks;
    for (int i = 0; i < presses_or(1000); ++i) {
      const Press press{any(0.05, 2.97), any(0, 500), any(0, 2)};
      CAPTURE(press.push_n);
      CAPTURE(press.hit_mm_per_s);
      CAPTURE(press.start_mm);
      CHECK(hit_one_axis(subject, found / 1.5, press, kLimitS, random(), ticks).rests());
    }
  }
}

TEST_CASE("a press of the sequence finds what lies beside no standard press") {
  // Downwards from standard presses alone it is 5.66 N/mm.
  const StabilityBoundary swing =
      column_of("0.3:40:30", kLimitS,
                {{AxisId::device, "omni"}, {AxisId::delay, "0"}, {AxisId::damping, "0.02"}})
          .swing;
  CHECK(swing.first_n_per_mm < 4);
}

TEST_CASE("on the emulated devices the safe stiffnesses of docs/stability.md bear any press") {
  const int presses = presses_or(20);
  std::ifstream page(std::string(KERF_DOCS) + "/stability.md");
  const std::regex row(R"(\| (\w+) \| (\d) \| ([\d.]+) \|(?:[^|]*\|){4} ([\d.]+) \| [^|]* \|)");
  std::mt19937_64 random(23);
  const auto any = [&](double lowest, double highest) {
    return lowest + (highest - lowest) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  int rows = 0;
  for (std::string line; std::getline(page, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, row)) continue;
    CAPTURE(line);
    ++rows;
    Assignment values;
    std::string& device = values[index_of(AxisId::device)] = found[1];
    std::ranges::transform(device, device.begin(), [](char c) { return std::tolower(c); });
    values[index_of(AxisId::delay)] = found[2];
    values[index_of(AxisId::damping)] = found[3];
    const LoopCase subject = subject_of(values);
    StepCounter ticks;
    int bad = 0;
    for (int i = 0; i < presses; ++i) {
      const Press press{any(0.05, 0.9 * LimitSettings().force_n), any(0, 500), any(0, 2)};
      const std::uint64_t phase = random();
      const LimitCycle run =
          hit_one_axis(subject, std::stod(found[4]), press, kLimitS, phase, ticks);
      // A tip that the peak hardly gets out against push and friction creeps for longer than that.
      const bool creeps = run.undecided && run.given_mj == 0;
      bad += run.rests() || (creeps && !run.swings && !run.active) ? 0 : 1;
    }
    CHECK(bad == 0);
  }
  CHECK(rows == 18);
}

TEST_CASE("without damping the first stiffness is that at which half the peak outgrows friction") {
  struct Arm {
    const char *mass, *friction, *delay;
  };
  for (const Arm& arm : {Arm{"0.045", "0.1", "1"}, {"0.045", "0.26", "1"}, {"0.2", "0.1", "2"}}) {
    CAPTURE(std::string(arm.friction));
    CAPTURE(std::string(arm.delay));
    Assignment values;
    values[index_of(AxisId::mass)] = arm.mass;
    values[index_of(AxisId::friction)] = arm.friction;
    values[index_of(AxisId::delay)] = arm.delay;
    values[index_of(AxisId::damping)] = "0";
    const SampledLoop loop = subject_of(values).loop;
    // docs/forces.md 5.7, in N, m and s.
    const double late_s = loop.period_s / 2 + loop.delay_s, b = 1000 * loop.viscous_ns_per_mm;
    const double r =
        8 / std::numbers::pi * loop.coulomb_n / LimitSettings().force_n * std::sqrt(loop.mass_kg);
    const double root = (r + std::sqrt(r * r + 4 * late_s * b)) / (2 * late_s);
    MapSpec spec;
    spec.stiffness_n_per_mm = {0.1, 5};
    spec.seeds = 2;
    StepCounter ticks;
    const double found = measure_column(spec, values, ticks).swing.first_n_per_mm;
    CHECK(found == doctest::Approx(root * root / 1000).epsilon(0.05));
  }
}

TEST_CASE("presses fill their ranges evenly, and what is given stays") {
  const auto ranges = PressChoice::ranges();
  std::array<std::array<int, 10>, 3> counts{};
  for (std::uint64_t n = 500; n < 700; ++n) {
    const Press press = press_of({}, n);
    const std::array<double, 3> values{press.push_n, press.hit_mm_per_s, press.start_mm};
    for (std::size_t i = 0; i < 3; ++i) {
      REQUIRE(values[i] >= ranges[i].lowest);
      REQUIRE(values[i] < ranges[i].highest);
      const double part = (values[i] - ranges[i].lowest) / (ranges[i].highest - ranges[i].lowest);
      ++counts[i][static_cast<std::size_t>(10 * part)];
    }
  }
  for (const auto& of_value : counts) {
    for (const int count : of_value) CHECK(std::abs(count - 20) <= 5);
  }
  const PressChoice given{{{1.0, std::nullopt, 0.5}}};
  CHECK(press_of(given, 7).push_n == 1.0);
  CHECK(press_of(given, 7).start_mm == 0.5);
  for (const Press& press : presses_beside(given, {1, 0, 0.5}, 0.25)) {
    CHECK(press == Press{1, 125, 0.5});  // less is below the range
  }
  CHECK(standard_presses(given).size() == kHitsMmPerS.size());
  CHECK(standard_presses({{{1.0, 5.0, 0.5}}}) == std::vector<Press>{{1, 5, 0.5}});
  CHECK(PressChoice{{{1.0, 5.0, 0.5}}}.is_one());
}

TEST_CASE("each cell tells the lowest energy of its port, which the passivity controller bounds") {
  constexpr double kSeconds = 5;  // of a hit
  const auto cells = [](const std::string& stabiliser) {
    return column_of("0.05:20:8", kSeconds,
                     {{AxisId::damping, "0"},
                      {AxisId::delay, "0"},
                      {AxisId::limits, "off"},
                      {AxisId::push, "0.5"},
                      {AxisId::hit, "200"},
                      {AxisId::start, "0.1"},
                      {AxisId::stabiliser, stabiliser}})
        .cells;
  };
  const std::vector<LimitCycle> off = cells("none"), on = cells("passivity/mass_kg=10");
  REQUIRE(off.size() == on.size());
  for (std::size_t i = 0; i < on.size(); ++i) {
    CAPTURE(i);
    // A little leaks in every step of an encoder that comes between two ticks.
    CHECK(on[i].port_minimum_mj > -2 * kSeconds);
    CHECK(on[i].port_minimum_mj >= off[i].port_minimum_mj);
  }
  CHECK(off.front().port_minimum_mj == 0);
  CHECK(off.back().port_minimum_mj < -50);
}

TEST_CASE("the paper's force has its map, with the whole arm") {
  LoopCase subject = subject_of({});
  subject.law = Law::paper;
  subject.damping_ns_per_mm = 0;
  subject.loop.delay_s = 0;
  const LoadedScene scene = walls_scene(subject);
  CHECK(scene.force.model == ForceModel::paper);
  StepCounter ticks;
  CHECK_FALSE(hit_with_arm(scene, subject, 0.5, 0, {}, 4, 1, ticks).swings);
  CHECK(hit_with_arm(scene, subject, 60, 1, {}, 4, 1, ticks).swings);
}

TEST_CASE("behind a delay the arm's port gives what its motors did, not what the servo booked") {
  Assignment values;
  values[index_of(AxisId::delay)] = "8";
  const LoopCase subject = subject_of(values);
  StepCounter ticks;
  const LimitCycle swing = hit_with_arm(walls_scene(subject), subject, 0.5, 2, {}, 4, 1, ticks);
  CHECK(swing.swings);
  CHECK(swing.active);
  CHECK(swing.port_minimum_mj < -50);
}

TEST_CASE("every hit of a whole arm begins at the wall, whatever the device") {
  for (const char* device : {"omni", "falcon", "woodenhaptics"}) {
    Assignment values;
    values[index_of(AxisId::device)] = device;
    values[index_of(AxisId::damping)] = "0.003";
    const LoopCase subject = subject_of(values);
    StepCounter ticks;
    for (std::size_t hit = 0; hit < kArmHits; ++hit) {
      CAPTURE(device);
      CAPTURE(hit);
      std::vector<SwingTick> curve;
      static_cast<void>(hit_with_arm(walls_scene(subject), subject, 0.5, hit, {}, 0.3, 1, ticks,
                                     [&](const SwingTick& tick) { curve.push_back(tick); }));
      REQUIRE(curve.size() == 300);
      CHECK(std::abs(curve.front().tip_mm) < 0.3);  // a tick at 200 mm/s and one voxel
      CHECK(curve.front().mm_per_s < 0);
      CHECK(curve.back().tip_mm < 0);
    }
  }
}

TEST_CASE("a heavy device's boundary is found, too: its hits last as long as its swings") {
  for (const char* const mass : {"0.005", "0.045", "1", "5", "20"}) {
    CAPTURE(mass);
    Assignment ideal;
    ideal[index_of(AxisId::loop)] = "ideal";
    ideal[index_of(AxisId::mass)] = mass;
    const Column column =
        column_of("0.05:20:10", 0.5,
                  {{AxisId::loop, "ideal"}, {AxisId::mass, mass}, {AxisId::damping, "0.002"}});
    const LoopCase subject = subject_of(ideal);
    const double exact = highest_stiffness(subject.loop, subject.damping_ns_per_mm);
    CHECK(std::abs(column.swing.first_n_per_mm / exact - 1) < 0.03);
    CHECK(std::abs(column.energy.first_n_per_mm / exact - 1) < 0.03);
  }
  MapSpec spec;
  spec.stiffness_n_per_mm = {0.0001};
  LoopCase slow = subject_of({});
  slow.loop.mass_kg = 100;
  CHECK(impossible(spec, slow).find("mass 100 kg, damping 0.0005 N s/mm: a hit would last") == 0);
}

TEST_CASE("a column has the same bits in every map that has it") {
  const TemporaryFolder folder;
  const std::string options = " --stiffness 0.2:3:4 --csv ";
  const std::string alone = (folder / "alone.csv").string(),
                    among = (folder / "among.csv").string();
  REQUIRE(lab("zwidth --damping 0.02" + options + alone).code == 0);
  REQUIRE(lab("zwidth --damping 0.001,0.01,0.02" + options + among).code == 0);
  const std::string rows = text_of(alone).substr(text_of(alone).find('\n') + 1);
  CHECK(text_of(among).find(rows) != std::string::npos);
}

TEST_CASE("a part belongs to one run at a time, and a hit ends with the word") {
  const TemporaryFolder folder;
  const std::string path = (folder / "map.part").string();
  const MapSpec spec = two_cells();
  {
    const PartWriter first(path, spec, {});
    try {
      const PartWriter second(path, spec, {});
      FAIL("two runs write one part");
    } catch (const HilError& error) {
      CHECK(std::string(error.what()).find("another run is at work on it") != std::string::npos);
    }
  }
  { const PartWriter again(path, spec, {}); }  // it ended

  const std::atomic<bool> stop{true};
  StepCounter ticks(stop);
  CHECK_THROWS_AS(
      static_cast<void>(hit_one_axis(subject_of({}), 100, {.hit_mm_per_s = 200}, 60, 1, ticks)),
      Interrupted);
  CHECK(ticks.ticks() < 2000);
}

TEST_CASE("what no map has in a part's first line is refused, and nothing crashes") {
  const TemporaryFolder folder;
  const std::string path = (folder / "map.part").string();
  const MapSpec spec = two_cells();
  const std::string good = part_text({spec, {}, {}});
  const std::pair<const char*, const char*> wrongs[] = {{"\"map\":[2,20]", "\"map\":[3,20]"},
                                                        {"\"map\":[2,20]", "\"map\":[2,99]"},
                                                        {"\"map\":[2,20]", "\"map\":[2,2]"},
                                                        {"[\"0.002\"]", "[\"nan\"]"},
                                                        {"[\"0.002\"]", "[\"0.002\",\"0.001\"]"},
                                                        {"[0.2,1.0", "[1e308,1.0"},
                                                        {"\"seconds\":60", "\"seconds\":-1"},
                                                        {"\"seeds\":5", "\"seeds\":0"},
                                                        {"[0.2,1.0]", "[1.0,0.2]"}};
  for (const auto& [was, becomes] : wrongs) {
    CAPTURE(becomes);
    const std::size_t at = good.find(was);
    REQUIRE(at != std::string::npos);
    std::ofstream(path) << std::string(good).replace(at, std::string(was).size(), becomes);
    CHECK_THROWS_AS(static_cast<void>(read_part(path)), HilError);
  }
}

}  // namespace kerf::zwidth_test
