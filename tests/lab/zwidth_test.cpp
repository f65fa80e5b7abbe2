// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/stability/axis_simulation.hpp"
#include "controller/stability/gain_limits.hpp"
#include "hil/hil_error.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/map.hpp"
#include "lab/stability/map_file.hpp"
#include "lab/stability/one_axis.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace kerf;
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
  const LimitCycle swing = hit_one_axis(subject, stiffness, 0, 3, 0, ticks);
  return by_energy ? swing.active : swing.swings;
}

constexpr const char* kSmall =
    "zwidth --damping 0,0.002,0.02 --stiffness 0.2:20:6 --seconds 0.3 --delay 0,1 ";

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

}  // namespace

KERF_REGISTER_FORCE_LAW(BareSpring)

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
    while (!swings(subject, stiffness)) stiffness *= 1.03;
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
    const LimitCycle soft = hit_with_arm(scene, subject, 0.3, 0.3, 1, ticks);
    CHECK_FALSE(soft.swings);
    CHECK_FALSE(soft.active);
    const LimitCycle hard = hit_with_arm(scene, subject, 40, 0.3, 1, ticks);
    CHECK(hard.swings);
    CHECK(hard.active);
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
  REQUIRE(lab("merge" + parts + files("merged")).code == 0);
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
  REQUIRE(lab(kSmall + std::string("--seed 2") + files("seed")).code == 0);
  CHECK(text_of(folder / "seed.csv") != text_of(folder / "one.csv"));
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
  refused("merge " + a + " " + b, "seed 2, not the 1");
  refused("merge " + a, "shard 2/2 is missing");
  refused("merge " + a + " " + a, "again");
  refused("merge " + (folder / "none.part").string(), "cannot be read");
  refused(kSmall + std::string("--hand firm --shard 1/2 --part ") + a, "another map or shard");
  std::string foreign = kept;
  const std::string program = "\"program\":\"";
  foreign.replace(foreign.find(program) + program.size(), 4, "none");
  std::ofstream(b, std::ios::binary) << foreign;
  refused("merge " + b + " " + c, "another program measured it than");
  refused(kSmall + std::string("--shard 1/2 --part ") + b, "another program measured it, which");
  CHECK(text_of(b) == foreign);
  refused("merge " + a + " " + c + " --csv " + c, "is a file of this run itself");
  refused(kSmall + std::string("--shard 1/2 --part ") + a + " --json " + a,
          "is a file of this run itself");
  std::string unknown = kept;  // of a program with a law that this one has not
  unknown.replace(unknown.find("\"axes\":{"), 8, "\"axes\":{\"law\":[\"anothers\"],");
  std::ofstream(b, std::ios::binary) << unknown;
  refused("merge " + b + " " + c, "b.part: --law: anothers is unknown");
  // A version that this is not; a shard that is not done; text that is no part.
  std::string old = kept;
  old.replace(old.find(KERF_VERSION), std::string(KERF_VERSION).size(), "0.0.1");
  std::ofstream(b, std::ios::binary) << old;
  refused("merge " + b + " " + c, "of version 0.0.1");
  std::ofstream(b, std::ios::binary) << kept.substr(0, kept.rfind('\n', kept.size() - 2) + 1);
  refused("merge " + b + " " + c, "has 2 of its 3 columns");
  for (const char* shard : {"[0,0]", "[1,0]", "[3,2]"}) {
    std::string odd = kept;
    odd.replace(odd.find("[1,2]"), 5, shard);
    std::ofstream(b, std::ios::binary) << odd;
    refused("merge " + b + " " + c, "is no part of a whole");
  }
  std::string more = kept;
  more.replace(more.find("\"cells\":[["), 10, "\"cells\":[[true,true,0,0,0],[");
  std::ofstream(b, std::ios::binary) << more;
  refused("merge " + b + " " + c, "cells for ");
  std::ofstream(b, std::ios::binary) << "hello\n";
  refused("merge " + b + " " + c, "line 1");
  std::ofstream(b, std::ios::binary) << "";
  refused("merge " + b + " " + c, "no part of a map");
  CHECK(text_of(a) == kept);
}

TEST_CASE("axes that mean nothing are refused in one line; columns that cannot exist are told") {
  for (const std::string& line : cases_in(
           "--damping 1:0:5; --damping 0:1:1; --damping -1; --damping nan; "
           "--damping 0.02,0.002; --rate 1000,1000; --law coupling,coupling; --damping 0,,1; "
           "--delay 65; --rate 0; --hand soft; --hand 1/2; --hand -1/0/0; --law none; "
           "--stiffness 0:1:5; --stiffness 2,1; --stiffness 1:200:4; --map damping; "
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
  const LabAnswer said =
      lab("zwidth --damping 0.002,0.2 --delay 0 --viscous 0 --stiffness 0.2,1 --seconds 0.2");
  CHECK(said.code == 0);
  CHECK(said.out.find("1 of 2 columns are left empty: damping ") != std::string::npos);
  // What was measured beside it is not lost.
  const LabAnswer rates =
      lab("zwidth --arm --rate 1000,3000 --damping 0.002 --stiffness 0.2,1 --seconds 0.1");
  CHECK(rates.code == 0);
  CHECK(rates.out.find("1 of 2 columns are left empty: rate 3000 Hz: ") != std::string::npos);
}

TEST_CASE("what the emulated device cannot do, or the hand never meets, is empty and told") {
  const auto told = [](const char* line) {
    const LabAnswer said =
        lab(std::string("zwidth --arm --damping 0.002 --stiffness 0.3,3 --seconds 0.1 ") + line);
    CHECK(said.code == 0);
    return said.out;
  };
  CHECK(told("--delay 1,9").find("1 of 2 columns are left empty: delay 9 ms") != std::string::npos);
  CHECK(told("--device falcon --rate 500,2000")
            .find("1 of 2 columns are left empty: rate 2000 Hz:") != std::string::npos);
  CHECK(told("--delay 0.33,1").find("empty: delay 0.33 ms") != std::string::npos);
  CHECK(told("--friction 3").find("empty: the hand did not bring the device to the wall") !=
        std::string::npos);
}

TEST_CASE("a map without any column that can exist is refused in one line") {
  for (const char* line :
       {"--damping 0.1:0.2:3", "--arm --damping 0 --delay 64", "--arm --damping 0 --rate 333"}) {
    const LabAnswer said = lab(std::string("zwidth --stiffness 0.3,3 --seconds 0.1 ") + line);
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
    REQUIRE(lab("zwidth --damping 0 --delay 0.5 --stiffness 0.3:30:8 --seconds 0.3 --csv " + file +
                " " + options)
                .code == 0);
    // From the stiffness on: the law's name stands before it.
    std::istringstream in(text_of(file));
    std::string all;
    for (std::string line; std::getline(in, line);) {
      std::size_t at = line.size();
      for (int comma = 0; comma < 5; ++comma) at = line.rfind(',', at - 1);
      all += line.substr(at) + "\n";
    }
    return all;
  };
  CHECK(verdicts("--law bare_spring") == verdicts("--law linear"));
  CHECK(verdicts("--law bare_spring --arm --numeric double").find(",1,1,") != std::string::npos);
  // What is no number is no wall: it counts as the worst, and nothing crashes.
  for (const char* where : {"", " --arm"}) {
    CHECK(lab(std::string(
                  "zwidth --law bare_spring --numeric double --damping 0 --delay 0 --seconds 0.2 "
                  "--stiffness 61,62") +
              where)
              .out.find("below all") != std::string::npos);
  }
  CHECK(lab("zwidth --law bare_spring --stiffness 101,102 --seconds 0.1 --damping 0").code == 2);
}

TEST_CASE("a stabiliser widens the map") {
  const auto first = [](const std::string& stabiliser) {
    return column_of("0.1:50:20", 0.6, {{AxisId::damping, "0"}, {AxisId::stabiliser, stabiliser}})
        .swing.first_n_per_mm;
  };
  CHECK(first("energy_bounding") > 1.5 * first("none"));
}

TEST_CASE("each cell tells the lowest energy of its port, which the passivity controller bounds") {
  constexpr double kSeconds = 2;  // of a hit
  const auto cells = [](const std::string& stabiliser) {
    return column_of("0.05:20:8", kSeconds,
                     {{AxisId::damping, "0"},
                      {AxisId::delay, "0"},
                      {AxisId::limits, "off"},
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
  CHECK_FALSE(hit_with_arm(scene, subject, 0.5, 0.5, 1, ticks).swings);
  CHECK(hit_with_arm(scene, subject, 60, 0.5, 1, ticks).swings);
}

TEST_CASE("behind a delay the arm's port gives what its motors did, not what the servo booked") {
  Assignment values;
  values[index_of(AxisId::delay)] = "8";
  const LoopCase subject = subject_of(values);
  StepCounter ticks;
  const LimitCycle swing = hit_with_arm(walls_scene(subject), subject, 0.5, 0.5, 1, ticks);
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
    std::vector<std::vector<SwingTick>> curves(kArmHits);
    StepCounter ticks;
    watch_arm(walls_scene(subject), subject, 0.5, 0.3, 1, ticks, [&](std::size_t hit) {
      return [&curve = curves[hit]](const SwingTick& tick) { curve.push_back(tick); };
    });
    for (std::size_t hit = 0; hit < kArmHits; ++hit) {
      CAPTURE(device);
      CAPTURE(hit);
      REQUIRE(curves[hit].size() == 300);
      CHECK(std::abs(curves[hit].front().tip_mm) < 0.3);  // a tick at 200 mm/s and one voxel
      CHECK(curves[hit].front().mm_per_s < 0);
      CHECK(curves[hit].back().tip_mm < 0);
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
  CHECK(impossible(spec, slow).find("mass 100 kg: a hit would last") == 0);
}

TEST_CASE("a column has the same bits in every map that has it") {
  const TemporaryFolder folder;
  const std::string options = " --stiffness 0.2:20:4 --seconds 0.2 --csv ";
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
  CHECK_THROWS_AS(static_cast<void>(hit_one_axis(subject_of({}), 100, 200, 60, 1, ticks)),
                  Interrupted);
  CHECK(ticks.ticks() < 2000);
}

TEST_CASE("what no map has in a part's first line is refused, and nothing crashes") {
  const TemporaryFolder folder;
  const std::string path = (folder / "map.part").string();
  const MapSpec spec = two_cells();
  const std::string good = part_text({spec, {}, {}});
  const std::pair<const char*, const char*> wrongs[] = {
      {"\"map\":[2,17]", "\"map\":[3,17]"},     {"\"map\":[2,17]", "\"map\":[2,99]"},
      {"\"map\":[2,17]", "\"map\":[2,2]"},      {"[\"0.002\"]", "[\"nan\"]"},
      {"[\"0.002\"]", "[\"0.002\",\"0.001\"]"}, {"[0.2,1.0", "[1e308,1.0"},
      {"\"seconds\":3", "\"seconds\":-1"}};
  for (const auto& [was, becomes] : wrongs) {
    CAPTURE(becomes);
    const std::size_t at = good.find(was);
    REQUIRE(at != std::string::npos);
    std::ofstream(path) << std::string(good).replace(at, std::string(was).size(), becomes);
    CHECK_THROWS_AS(static_cast<void>(read_part(path)), HilError);
  }
}
