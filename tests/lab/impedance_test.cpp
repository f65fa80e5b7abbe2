// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <string>
#include <utility>

#include <doctest/doctest.h>
#include <kerf/hand.hpp>
#include <kerf/log.hpp>
#include <kerf/scene.hpp>
#include <kerf/servo.hpp>

#include "lab/impedance/logged_wall.hpp"
#include "lab/impedance/shaken_arm.hpp"
#include "lab/impedance/spectrum.hpp"
#include "lab/stability/arm.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/identified_device.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::impedance_lab_test {
namespace {

using impedance::deviation;
using impedance::Spectrum;
using kerf::test::has, kerf::test::lab, kerf::test::LabAnswer, kerf::test::TemporaryFolder,
    kerf::test::text_of;
using zwidth::AxisId;

/// The wall of these axes at 25 frequencies up to half of Nyquist.
Spectrum measured(std::initializer_list<std::pair<AxisId, const char*>> axes, double stiffness,
                  double most_mm) {
  Spectrum spectrum;
  for (const auto& [axis, value] : axes) spectrum.values[zwidth::index_of(axis)] = value;
  spectrum.subject = zwidth::subject_of(spectrum.values);
  spectrum.stiffness_n_per_mm = stiffness;
  const double rate_hz = 1 / spectrum.subject.loop.period_s;
  for (int i = 0; i <= 24; ++i) {
    const double hz = std::pow(rate_hz / 4, i / 24.0);
    spectrum.rows.push_back(impedance::measure_one_axis(
        spectrum.subject, stiffness, impedance::sine_near(hz, rate_hz), most_mm));
  }
  return spectrum;
}

void check_near(const Spectrum& spectrum, double ratio, double deg) {
  CHECK(spectrum.theory_holds());
  for (const auto& row : spectrum.rows) {
    CAPTURE(row.hz);
    REQUIRE(row.wall);
    const impedance::Deviation off = deviation(*row.wall, spectrum.wall_by_theory(row));
    CHECK(std::abs(off.ratio) < ratio);
    CHECK(std::abs(off.deg) < deg);
  }
}

}  // namespace

TEST_CASE(
    "the servo's wall has the impedance of the theory, in fixed point, up to half of Nyquist") {
  for (const char* rate : {"500", "1000", "4000"}) {
    for (const char* delay : {"0", "1", "2.5", "64"}) {
      for (const char* filter : {"0", "3"}) {
        CAPTURE(rate);
        CAPTURE(delay);
        CAPTURE(filter);
        check_near(measured({{AxisId::rate, rate},
                             {AxisId::delay, delay},
                             {AxisId::filter, filter},
                             {AxisId::estimator, "difference"},
                             {AxisId::quantum, "0"},
                             {AxisId::damping, "0.004"}},
                            1.2, 0.5),
                   0.002, 0.1);
      }
    }
  }
}

TEST_CASE("each law of a map, in contact, is that wall") {
  for (const char* law : {"coupling", "linear", "two_sided"}) {
    for (const char* numeric : {"fixed", "double"}) {
      check_near(measured({{AxisId::law, law},
                           {AxisId::numeric, numeric},
                           {AxisId::estimator, "difference"},
                           {AxisId::quantum, "0"},
                           {AxisId::limits, "off"}},
                          5, 1),
                 0.002, 0.1);
    }
  }
}

TEST_CASE("encoder steps are felt little by a motion over many of them") {
  check_near(measured({{AxisId::estimator, "difference"}, {AxisId::limits, "off"}}, 1, 1.2), 0.01,
             1);
}

TEST_CASE("the whole loop, with servo step, driver, device and hand, has it too") {
  Spectrum spectrum;
  spectrum.values[zwidth::index_of(AxisId::estimator)] = "difference";
  spectrum.values[zwidth::index_of(AxisId::friction)] = "0";
  spectrum.values[zwidth::index_of(AxisId::mass)] = "0.2";
  spectrum.subject = zwidth::subject_of(spectrum.values);
  spectrum.subject.device = Personality::omega;  // fine steps: no motion is of a few of them
  spectrum.subject.loop.quantum_mm = 0.01;
  spectrum.stiffness_n_per_mm = 0.6;
  const LoadedScene walls = zwidth::walls_scene(spectrum.subject);
  for (const double hz : {1.0, 5.0, 30.0, 80.0, 160.0, 250.0}) {
    spectrum.rows.push_back(impedance::measure_arm(walls, spectrum.subject, 0.6, hz, 0.5));
    const auto& row = spectrum.rows.back();
    REQUIRE(row.port);
    // Its mechanics, apart from the wall: the hand's force, without the device's by theory.
    const impedance::Impedance device = *row.port - *row.wall;
    const auto off = deviation(device, device_impedance(spectrum.subject.loop, row.hz, 1));
    CAPTURE(row.hz);
    CHECK(std::abs(off.ratio) < 0.01);
    CHECK(std::abs(off.deg) < 1);
  }
  check_near(spectrum, 0.01, 1);
}

TEST_CASE("a sine has whole periods in whole ticks, near what was asked for") {
  for (const double rate_hz : {250.0, 1000.0, 32000.0}) {
    for (const double part : {0.0001, 0.01, 0.1, 0.25, 0.4}) {
      const auto sine = impedance::sine_near(part * rate_hz, rate_hz);
      CHECK(std::gcd(sine.periods, sine.ticks) == 1);
      CHECK(std::abs(sine.hz / (part * rate_hz) - 1) < 1e-3);
      CHECK(sine.ticks >= 4096);
      CHECK(sine.hz * static_cast<double>(sine.ticks) ==
            doctest::Approx(rate_hz * static_cast<double>(sine.periods)));
    }
  }
}

TEST_CASE("the lag of foaw is felt: less damping and more stiffness than the theory's") {
  const Spectrum spectrum = measured({}, 1, 0.5);
  CHECK_FALSE(spectrum.theory_holds());
  const auto& row = spectrum.rows[15];  // 31 Hz
  REQUIRE(row.wall);
  CHECK(row.wall->real() < spectrum.wall_by_theory(row).real() - 0.0002);
  CHECK(impedance::felt_stiffness(*row.wall, row.hz) >
        1.03 * impedance::felt_stiffness(spectrum.wall_by_theory(row), row.hz));
}

TEST_CASE("the command prints, and writes, the felt stiffness at 30 Hz and the margins") {
  const TemporaryFolder folder;
  const std::string file = folder / "z.json";
  const std::string device = folder.write("device.toml", kerf::test::kDeviceFile);
  const LabAnswer answer =
      lab("impedance --loop ideal --delay 1 --frequency 30,100 --json " + file);
  CHECK(answer.err.empty());
  CHECK(answer.code == 0);
  CHECK(has(answer.out, "K 1 N/mm, B 0.002 N s/mm at 1000 Hz, delay 1 ms"));
  CHECK(has(answer.out, "furthest from theory: 0.00 %, 0.00 deg\n"));
  CHECK(has(answer.out, "passive with any hand from a device damping of 0.002563 N s/mm on"));
  const Json json = Json::parse(text_of(file));
  const Json& row = json.at("rows").at(std::size_t{0});
  const double felt = row.at("wall").at("measured").at("stiffness_n_per_mm").get<double>();
  CHECK(felt == doctest::Approx(1.097).epsilon(0.001));
  CHECK(json.at("theory_holds").get<bool>());
  const LabAnswer found = lab("impedance --direction 1,0,1 --frequency 30 --device " + device);
  CHECK(found.code == 0);
  CHECK(found.out.starts_with(device + " along 0.707, 0, 0.707: "));
  CHECK(has(found.out, "delay 1.8 ms"));
}

TEST_CASE("a frequency at which the limits of the force leave no motion has theory alone") {
  const Spectrum spectrum = measured({{AxisId::rate, "32000"}}, 1, 0.5);
  CHECK(spectrum.rows.front().wall.has_value());
  CHECK_FALSE(spectrum.rows.back().wall.has_value());
  CHECK(
      has(impedance::text_of(spectrum), "beyond the limits of the force           -         -\n"));
  CHECK(has(impedance::json_of(spectrum), "\"measured\": null"));
}

namespace {

/// Runs the wall of a scene whose hand shakes in it, slowly, then faster and faster, and records
/// it.
void record_chirp(const TemporaryFolder& folder, const std::string& name) {
  std::string script =
      "unit_mm = 1\nstart_mm = [0, 2, 0]\n[hand]\nstiffness_n_per_mm = 5\n"
      "damping_ns_per_mm = 0.05\nmass_kg = 0\n"
      "[[step]]\nmove_mm = [0, -0.9, 0]\nseconds = 0.5\n";
  double seconds = 0.5;  // half a period
  for (int i = 0; i < 150; ++i, seconds *= 0.965) {
    script += format("[[step]]\nmove_mm = [0, %g, 0]\nseconds = %.4f\n", i % 2 == 0 ? -1.5 : -0.3,
                     std::max(seconds, 0.002));
  }
  const std::string hand_file = folder.write("chirp.toml", script);
  const Scene scene =
      Scene::load(std::string(KERF_TEST_SCENES) + "/wall.toml",
                  {"device.personality=\"omega\"", "servo.velocity={name=\"difference\", tau_ms=2}",
                   "force.stiffness_n_per_mm=0.8", "force.damping_ns_per_mm=0.003",
                   "limits.slew_n_per_ms=1.8"});
  Servo servo(scene);
  Hand hand(scene, hand_file);
  LogWriter log((folder / name), scene);
  for (int i = 0; i < 40'000 && !hand.ended(); ++i) log.add(servo.step(hand.next(servo.last())));
  CHECK(hand.ended());
  log.close();
}

}  // namespace

TEST_CASE("the log of a hand that shakes in a wall has the impedance of the theory") {
  const TemporaryFolder folder;
  record_chirp(folder, "log");
  const std::string json_file = folder / "z.json";
  const LabAnswer answer = lab("impedance --log " + (folder / "log").string() +
                               " --delay 2 --frequency 2:60:12 --json " + json_file);
  CAPTURE(answer.out);
  CHECK(answer.err.empty());
  CHECK(answer.code == 0);
  CHECK(has(answer.out,
            "K 0.8 N/mm, B 0.003 N s/mm at 1000 Hz, delay 2 ms; law coupling, "
            "estimator difference/tau_ms=2, stabiliser none"));
  const Json rows = Json::parse(text_of(json_file)).at("rows");
  int measured_rows = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    const Json& wall = rows.at(i).at("wall");
    const double hz = rows.at(i).at("hz").get<double>();
    if (!wall.at("measured").contains("damping_ns_per_mm")) continue;
    ++measured_rows;
    const auto impedance_of = [&](const char* how) {
      const Json& felt = wall.at(how);
      return impedance::Impedance(
          felt.at("damping_ns_per_mm").get<double>(),
          -felt.at("stiffness_n_per_mm").get<double>() / (impedance::kTurn * hz));
    };
    const auto off = deviation(impedance_of("measured"), impedance_of("theory"));
    CAPTURE(hz);
    CHECK(std::abs(off.ratio) < 0.01);
    CHECK(std::abs(off.deg) < 1);
  }
  CHECK(measured_rows >= 8);
  const std::string into_the_log = "--json " + (folder / "log/scene.json").string();
  for (const auto& [words, line] :
       {std::pair{"--stiffness 1", "--stiffness: the recording has its own"},
        std::pair{into_the_log.c_str(), "would lie among the files of "},
        std::pair{"--rate 500", "--rate: the scene of the recording has it"}}) {
    const LabAnswer wrong = lab("impedance --log " + (folder / "log").string() + " " + words);
    CAPTURE(wrong.err);
    CHECK(wrong.code == 2);
    CHECK(has(wrong.err, line));
    CHECK(std::ranges::count(wrong.err, '\n') == 1);
  }
}

TEST_CASE("a motion that does not explain the force shows no wall") {
  impedance::LoggedWall wall;
  const SampledLoop loop;
  for (int tick = 0; tick < 4000; ++tick) {
    wall.tip_mm.push_back(std::sin(impedance::kTurn * 20 * tick * loop.period_s));
    wall.force_n.push_back(-2 * wall.tip_mm.back());
  }
  const auto row = impedance::logged_at(wall, loop, 20);
  REQUIRE(row.wall);
  CHECK(row.amplitude_mm == doctest::Approx(1).epsilon(0.01));
  CHECK(std::abs(deviation(*row.wall, wall_impedance(loop, 2, 0, 20)).ratio) < 1e-3);
  std::uint32_t noise = 1;  // Knuth's generator
  for (double& force_n : wall.force_n) {
    noise = noise * 1664525 + 1013904223;
    force_n += noise / 4294967296.0;
  }
  CHECK_FALSE(impedance::logged_at(wall, loop, 200).wall.has_value());
  wall.tip_mm.resize(400);
  wall.force_n.resize(400);
  CHECK_FALSE(impedance::logged_at(wall, loop, 20).wall.has_value());  // one segment
}

TEST_CASE("a wall that cannot be gets one line") {
  for (const auto& [words, line] :
       {std::pair{"--rate 500,1000", "--rate: 500,1000: one wall has one value; give one"},
        std::pair{"--delay 65", "--delay: 65 is no number from 0 to 64"},
        std::pair{"--frequency 1:500:3", "--frequency: 1:500:3: not within 0.1 and 400 Hz"},
        std::pair{"--frequency slow", "slow is no number"},
        std::pair{"--arm --delay 64", "--arm: delay 64 ms: an emulated device has whole steps"},
        std::pair{"--arm --rate 3000", "--rate: 3000 does not divide 8000"},
        std::pair{"--arm --quantum 0.1", "--quantum: device and servo have their own"},
        std::pair{"--log nowhere", "--log: nowhere"},
        std::pair{"--law paper", "--law: paper is a force of the whole arm"},
        std::pair{"--filter 2", "--filter: foaw has no low-pass"},
        std::pair{"--direction z", "--direction: is that of a file"},
        std::pair{"--device nowhere.toml", "nowhere.toml: "},
        std::pair{"--stiffness 60", "--limits: peak and slew of the force leave no motion"},
        std::pair{"--stiffness 0", "--stiffness"}}) {
    const LabAnswer answer = lab(std::string("impedance ") + words);
    CAPTURE(answer.err);
    CHECK(answer.code == 2);
    CHECK(std::ranges::count(answer.err, '\n') == 1);
    CHECK(has(answer.err, line));
  }
}

}  // namespace kerf::impedance_lab_test
