// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/device_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <doctest/doctest.h>

#include "controller/stability/identified_loop.hpp"
#include "shared/text/text.hpp"
#include "tests/lab/lab_line.hpp"
#include "tests/support/identified_device.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::device_file_test {
namespace {

using kerf::test::device_file_with;
using kerf::test::kDeviceFile;
using kerf::test::lab;
using kerf::test::LabAnswer;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;
using kerf::zwidth::direction_of;

std::string refusal_of(const std::string& file) {
  try {
    static_cast<void>(read_identified_device(file));
  } catch (const kerf::DeviceFileError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("an identified device has in each direction the mass that a wall there moves") {
  const TemporaryFolder folder;
  const IdentifiedDevice device = read_identified_device(folder.write("device.toml", kDeviceFile));
  CHECK(device.mass_kg[0][2] == -0.022);
  CHECK(device.mass_kg[2][0] == -0.022);
  CHECK(device.delay_s == 0.0018);
  // A force of 1 N along n alone: the acceleration along n is n' M^-1 n, by elimination.
  const auto& m = device.mass_kg;
  const double yy = m[1][1] - m[0][1] * m[0][1] / m[0][0];
  const double yz = m[1][2] - m[0][1] * m[0][2] / m[0][0];
  const double zz = m[2][2] - m[0][2] * m[0][2] / m[0][0];
  const auto z = along(device, {0, 0, -3});
  CHECK(z.mass_kg == doctest::Approx(zz - yz * yz / yy).epsilon(1e-12));
  CHECK(z.viscous_ns_per_mm == doctest::Approx(0.0006));
  CHECK(z.coulomb_n == doctest::Approx(0.3));
  CHECK(z.quantum_mm == doctest::Approx(0.04));
  const auto slanted = along(device, {1, 1, 0});
  CHECK(slanted.viscous_ns_per_mm == doctest::Approx(0.00045));
  CHECK(slanted.coulomb_n == doctest::Approx(0.3 / std::sqrt(2.0)));
  // Heavier along x than what is left when y and z are free.
  CHECK(along(device, {1, 0, 0}).mass_kg < m[0][0]);
  CHECK(direction_of(device, "y", 0.002, 1000).along[1] == 1);
  CHECK(direction_of(device, "0,2,0", 0.002, 1000).mass_kg ==
        direction_of(device, "y", 0.002, 1000).mass_kg);
}

TEST_CASE(
    "the worst direction has the lowest stiffness that a push makes oscillate, with its friction") {
  const TemporaryFolder folder;
  const IdentifiedDevice device = read_identified_device(folder.write("device.toml", kDeviceFile));
  const auto lowest = [&](const kerf::DeviceDirection& at, double peak_n) {
    return kerf::pushed_stiffness(kerf::loop_along(device, at, 1000, false), 0.002, peak_n);
  };
  const auto worst = direction_of(device, "worst", 0.002, 1000);
  CHECK(lowest(worst, 3.3) > 0);
  for (const char* other : {"x", "y", "z", "1,1,0", "1,0,-1", "1,-1,1"}) {
    CHECK(lowest(worst, 3.3) <= lowest(direction_of(device, other, 0.002, 1000), 3.3));
  }
  // Near x, which has the least friction; without friction another one is lower.
  CHECK(std::abs(worst.along[0]) > 0.98);
  const auto light = kerf::worst_direction(device, 0.002, 1000);
  CHECK(std::abs(light.along[0]) < 0.95);
  const double never = std::numeric_limits<double>::infinity();
  CHECK(lowest(light, never) < lowest(worst, never));
  CHECK(
      lowest(light, never) ==
      doctest::Approx(kerf::highest_stiffness(kerf::loop_along(device, light, 1000, false), 0.002))
          .epsilon(1e-12));
}

TEST_CASE(
    "the worst direction is lower than any of two thousand, of an arm that is light across its "
    "axes") {
  const TemporaryFolder folder;
  // Its lightest direction, 0.35, 0.85, 0.4, is 23 degrees from each axis and diagonal of a cube.
  const IdentifiedDevice device = read_identified_device(folder.write(
      "device.toml", device_file_with("0.032, 0.053, 0.077, 0.01, -0.022, 0.005",
                                      "0.0909, 0.0461, 0.0881, -0.0222, -0.0104, -0.0254")));
  const auto boundary = [&](const kerf::DeviceDirection& at) {
    return kerf::pushed_stiffness(kerf::loop_along(device, at, 1000, false), 0.003, 3.3);
  };
  const auto worst = direction_of(device, "worst", 0.003, 1000);
  const double lowest = boundary(worst);
  // The same even spread of a sphere on every machine (Fibonacci's lattice).
  constexpr int kCount = 2000;
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (2 * i + 1.0) / kCount, angle = i * 2.399963229728653;
    const double across = std::sqrt(1 - z * z);
    const auto other = along(device, {across * std::cos(angle), across * std::sin(angle), z});
    CHECK(lowest <= boundary(other));
  }
}

TEST_CASE("the worst direction is that at the damping of the map") {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("device.toml", device_file_with("0.1, 0.2, 0.3", "0, 0, 0"));
  std::array<std::string, kerf::zwidth::kAxisCount> texts;
  texts[kerf::zwidth::index_of(kerf::zwidth::AxisId::damping)] = "0.02";
  const auto found = kerf::zwidth::take_device(file, "worst", texts);
  const auto worst = direction_of(read_identified_device(file), "worst", 0.02, 1000);
  CHECK(found.along == worst.along);
  CHECK(found.along != direction_of(read_identified_device(file), "worst", 0.002, 1000).along);
}

TEST_CASE("a map of a file is that of its figures as options") {
  const TemporaryFolder folder;
  const std::string file = folder.write("device.toml", kDeviceFile);
  const auto z = along(read_identified_device(file), {0, 0, 1});
  const std::string map = "zwidth --damping 0,0.002 --stiffness 0.5:5:4 --seeds 1 --csv ";
  const LabAnswer by_file =
      lab(map + (folder / "file.csv").string() + " --direction z --device " + file);
  CHECK(by_file.err.empty());
  CHECK(by_file.code == 0);
  CHECK(by_file.out.starts_with(file + " along 0, 0, 1: "));
  const std::string figures = kerf::format(
      " --mass %.6g --viscous 0.0006 --friction 0.3 --quantum 0.04 --delay 1.8", z.mass_kg);
  CHECK(lab(map + (folder / "figures.csv").string() + figures).code == 0);
  CHECK(text_of(folder / "file.csv") == text_of(folder / "figures.csv"));
}

TEST_CASE("a file that is no device, and options against it, get one line") {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& from, const std::string& to) {
    return refusal_of(folder.write("device.toml", device_file_with(from, to)));
  };
  CHECK(with("[device]", "[devices]").find("no table [device]") != std::string::npos);
  CHECK(with("mass_kg = [0.032", "# mass_kg = [0.032").find("has no mass_kg") != std::string::npos);
  CHECK(with("0.032, 0.053", "0.032, -0.053").find("not positive in each direction") !=
        std::string::npos);
  CHECK(with("0.0004, ", "").find("a list of 2; write 3 numbers") != std::string::npos);
  CHECK(with("0.1, 0.2", "0.1, -0.2").find("out of range") != std::string::npos);
  CHECK(with("0.0018", "nan").find("out of range") != std::string::npos);
  CHECK(with("rate_hz", "rate").find("unknown key") != std::string::npos);
  CHECK(with("= 0.0018", "= 0.064").find("device.toml:6: device.delay_s = 0.064 is 64 periods") !=
        std::string::npos);
  CHECK(with("[0.0003, -0.0001, 0.0005]", "\"x\"").find("low.viscous_ns_per_mm: not a list") !=
        std::string::npos);
  CHECK(with("[device]", "device = 3 #").find("device: not a table") != std::string::npos);
  CHECK(with("[device]", "[device").find("device.toml:1: ") != std::string::npos);
  CHECK(refusal_of(folder.write("device.toml", "")).find("no table [device]") != std::string::npos);
  CHECK(refusal_of(folder.path().string()).find("not a file") != std::string::npos);
  CHECK(refusal_of(folder.write("device.toml", std::string(1 << 20, '#') + "#")) ==
        (folder / "device.toml").string() + ": more than 1 MiB; use a shorter one");

  const std::string file = folder.write("device.toml", kDeviceFile);
  const std::string late = folder.write("late.toml", device_file_with("= 0.0018", "= 0.0025"));
  for (const auto& [words, line] :
       {std::pair{"--direction z", "--direction: is that of a file"},
        std::pair{"--direction 0,0,0 --device FILE", "--direction: 0,0,0: no direction"},
        std::pair{"--direction 1e-300,0,0 --device FILE", "--direction: 1e-300,0,0: no direction"},
        std::pair{"--direction up --device FILE", "--direction: up: no direction"},
        std::pair{"--arm --device FILE", "leave --arm out"},
        std::pair{"--rate 500,1000 --device FILE", "the map has one rate"},
        std::pair{"--rate 32000 --device LATE",
                  "late.toml is 80 periods, and a loop has up to 64; give a lower one"},
        std::pair{"--device omni,FILE", "one file alone"}}) {
    std::string text = words;
    if (const auto at = text.find("FILE"); at != std::string::npos) text.replace(at, 4, file);
    if (const auto at = text.find("LATE"); at != std::string::npos) text.replace(at, 4, late);
    const LabAnswer answer = lab("zwidth --quick " + text);
    CAPTURE(answer.err);
    CHECK(answer.code == 2);
    CHECK(std::ranges::count(answer.err, '\n') == 1);
    CHECK(answer.err.find(line) != std::string::npos);
  }
}

}  // namespace kerf::device_file_test
