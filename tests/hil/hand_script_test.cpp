// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <doctest/doctest.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"

namespace {

using kerf::HandStep;

std::string error_of(const std::string& text) {
  try {
    (void)kerf::parse_hand_script(text, "hand.toml");
  } catch (const kerf::HilError& error) {
    return error.what();
  }
  return "no error";
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

}  // namespace

TEST_CASE("a script reads as it is written") {
  const auto script = kerf::parse_hand_script(
      "unit_mm = 0.5\n"
      "start_mm = [1, 6.5, -2]\n"
      "[[step]]\nmove_mm = [0, -1, 0]\nseconds = 0.25\nease = 'linear'\nbutton = 1\n"
      "[[step]]\nhold = 2\norientation_deg = [0, 90, 0]\n"
      "[[step]]\nrepeat = true\ncircle_mm = 2\nturns = 2.5\nseconds = 3\nsink_mm = -1\n"
      "[[step]]\nzigzag_mm = [3, 4]\n",
      "hand.toml");
  CHECK(script.unit_mm == 0.5);
  CHECK(script.start == std::array<double, 3>{1, 6.5, -2});
  REQUIRE(script.steps.size() == 4);
  CHECK(script.steps[0].kind == HandStep::Kind::move);
  CHECK(script.steps[0].to == std::array<double, 3>{0, -1, 0});
  CHECK(script.steps[0].ease == HandStep::Ease::linear);
  CHECK(script.steps[0].button == 1);
  CHECK(script.steps[1].kind == HandStep::Kind::hold);
  CHECK(script.steps[1].seconds == 2);
  REQUIRE(script.steps[1].orientation_rad);
  CHECK((*script.steps[1].orientation_rad)[1] == doctest::Approx(1.5707963));
  CHECK(script.steps[2].kind == HandStep::Kind::circle);
  CHECK(script.steps[2].size[0] == 2);
  CHECK(script.steps[2].turns == 2.5);
  CHECK(script.steps[2].sink == -1);
  CHECK(script.steps[3].size[1] == 4);
  CHECK(script.repeat_from == 2u);
}

TEST_CASE("errors name the file, the line and the way out, in one line") {
  struct Bad {
    const char* text;
    const char* start;
  };
  for (const auto& [text, start] : {
           Bad{"speed = 3\n[[step]]\nhold = 1", "hand.toml:1: speed: unknown key"},
           Bad{"[[step]]\nhold = 1\nsecond = 2", "hand.toml:3: step.second: unknown key"},
           Bad{"[[step]]\nhold = 'long'", "hand.toml:2: step.hold: not a number"},
           Bad{"[[step]]\n\nhold = 0", "hand.toml:3: step.hold = 0 is out of range"},
           Bad{"[[step]]\nhold = nan", "hand.toml:2: step.hold = nan is out of range"},
           Bad{"[[step]]\nmove_mm = [1, 2]",
               "hand.toml:2: step.move_mm: a list of 2; write 3 numbers"},
           Bad{"[[step]]\nmove_mm = [1, 2, 2000]", "hand.toml:2: step.move_mm = 2000 is out"},
           Bad{"[[step]]\nmove_mm = [1, 2, inf]", "hand.toml:2: step.move_mm = inf is out"},
           Bad{"[[step]]\nhold = 1\nease = 'bouncy'", "hand.toml:3: step.ease: unknown value"},
           Bad{"[[step]]\nhold = 1\nbutton = 3", "hand.toml:3: step.button = 3 is out of range"},
           Bad{"[[step]]\nhold = 1\nrepeat = 1", "hand.toml:3: step.repeat: not a truth value"},
           Bad{"[[step]]\nseconds = 1", "hand.toml:1: step: has 0 motions"},
           Bad{"[[step]]\nhold = 1\ncircle_mm = 2", "hand.toml:1: step: has 2 motions"},
           Bad{"[[step]]\nhold = 1\nturns = 2", "hand.toml:1: step: turns or sink_mm"},
           Bad{"unit_mm = 0\n[[step]]\nhold = 1", "hand.toml:1: unit_mm = 0 is out of range"},
           Bad{"unit_mm = 1", "hand.toml: no steps"},
           Bad{"step = 3", "hand.toml: no steps"},
           Bad{"[[step]]\nhold = = 1", "hand.toml:2: "},
           Bad{"[[step]]\nhold=1\nrepeat=true\n[[step]]\nhold=1\nrepeat=true",
               "hand.toml:4: step: a second repeat"},
       }) {
    const std::string error = error_of(text);
    CAPTURE(text);
    CAPTURE(error);
    CHECK(starts_with(error, start));
    CHECK(error.find('\n') == std::string::npos);
    CHECK(error.find("; ") != std::string::npos);
  }
}

TEST_CASE("a missing file, a folder and an endless file are refused") {
  CHECK_THROWS_AS((void)kerf::read_hand_script("/nowhere/hand.toml"), kerf::HilError);
  CHECK_THROWS_AS((void)kerf::read_hand_script("/dev/zero"), kerf::HilError);
  const auto folder = std::filesystem::temp_directory_path();
  CHECK_THROWS_AS((void)kerf::read_hand_script(folder), kerf::HilError);
  const auto big = folder / ("kerf-big-hand-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(big) << std::string((1 << 20) + 1, '#');
  CHECK_THROWS_WITH_AS((void)kerf::read_hand_script(big),
                       (big.string() + ": more than 1 MiB; use a shorter one").c_str(),
                       kerf::HilError);
  std::filesystem::remove(big);
}

TEST_CASE("a script may say what holds the tool: device and hand") {
  const std::string steps = "[[step]]\nhold = 1\n";
  const auto script = kerf::parse_hand_script(
      "[device]\ncoulomb_n = 0.05\noutput_delay_cycles = 16\ninput_delay_cycles = 0\n"
      "joint_inertia_kg_m2 = 1e-4\nmode_hz = 80\n[hand]\nmass_kg = 0\nstiffness_n_per_mm = 10\n" +
          steps,
      "hand.toml");
  kerf::PlantParams params;
  kerf::take_plant(script.plant, params);
  CHECK(params.coulomb_n == 0.05);
  CHECK(params.output_delay_cycles == 16);
  CHECK(params.input_delay_cycles == 0);
  CHECK(params.joint_inertia_kg_m2 == std::array{1e-4, 1e-4, 1e-4});
  CHECK(params.mode_hz == 80);
  CHECK(params.hand_mass_kg == 0);
  CHECK(params.hand_stiffness_n_per_mm == 10);
  CHECK(params.tip_mass_kg == kerf::PlantParams{}.tip_mass_kg);  // not said: the device's own

  struct Slip {
    std::string text, says;
  };
  for (const auto& [text, says] : {
           Slip{"device = 3\n", "hand.toml:1: device: not a table; write [device]"},
           Slip{"[device]\nmass_kg = 1\n",
                "hand.toml:2: device.mass_kg: unknown key; known here: "},
           Slip{"[hand]\ncoulomb_n = 1\n", "hand.toml:2: hand.coulomb_n: unknown key"},
           Slip{"[device]\ntip_mass_kg = 0\n",
                "hand.toml:2: device.tip_mass_kg = 0 is out of range; "
                "use 0.001 to 10"},
           Slip{"[hand]\nmass_kg = nan\n", "hand.toml:2: hand.mass_kg = nan is out of range"},
           Slip{"[hand]\nmass_kg = '1'\n", "hand.toml:2: hand.mass_kg: not a number"},
           Slip{"[device]\noutput_delay_cycles = 0.5\n",
                "hand.toml:1: device: output_delay_cycles is not whole"},
       }) {
    CAPTURE(text);
    const std::string error = error_of(text + steps);
    CAPTURE(error);
    CHECK(starts_with(error, says));
    CHECK(error.find('\n') == std::string::npos);
  }
}
