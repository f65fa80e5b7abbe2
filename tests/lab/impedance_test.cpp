// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "lab/impedance/shaken_arm.hpp"
#include "lab/impedance/spectrum.hpp"
#include "lab/stability/arm.hpp"
#include "shared/text/json.hpp"
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
  CHECK(has(impedance::text_of(spectrum), "beyond the limits of the force"));
  CHECK(has(impedance::json_of(spectrum), "\"measured\": null"));
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
