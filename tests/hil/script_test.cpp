// SPDX-License-Identifier: Apache-2.0
// The files of hands and faults, and the device that plays faults.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "hil/hil_error.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/faulty_device.hpp"
#include "hil/script/hand_script_file.hpp"
#include "hil/script/identified_plant.hpp"
#include "shared/device/identified_device.hpp"
#include "shared/wire/omni.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/identified_device.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::script_test {
namespace {

using kerf::test::error_of;
using kerf::test::has;

std::string hand_error(const std::string& text) {
  return error_of<kerf::HilError>(
      [&] { static_cast<void>(kerf::parse_hand_script(text, "hand.toml")); });
}

std::string fault_error(const std::string& text) {
  return error_of<kerf::HilError>(
      [&] { static_cast<void>(kerf::parse_fault_script(text, "faults.toml")); });
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

TEST_CASE("a script may have parameters of device and hand") {
  const auto script = kerf::parse_hand_script(
      "[device]\ncoulomb_n = 0.05\noutput_delay_cycles = 16\ninput_delay_cycles = 0\n"
      "joint_inertia_kg_m2 = 1e-4\nmode_hz = 80\n[hand]\nmass_kg = 0\nstiffness_n_per_mm = 10\n"
      "[[step]]\nhold = 1\n",
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
  CHECK(params.tip_mass_kg == kerf::PlantParams{}.tip_mass_kg);  // absent: the device's own
}

TEST_CASE("a fault script is read whole") {
  const auto script = parse_fault_script(R"(
    seed = 7
    latches = "overspeed"
    [[fault]]
    kind = "lose"
    packets = "commands"
    every = 3
    at_s = 0.5
    for_s = 0.25
    [[fault]]
    kind = "jump"
    axis = 2
    counts = -200
    [[fault]]
    kind = "host_late"
    ms = 10
  )",
                                         "faults.toml");
  CHECK(script.seed == 7);
  CHECK(script.latches == "overspeed");
  CHECK(script.seconds == 4);
  CHECK_FALSE(script.hides);
  REQUIRE(script.faults.size() == 3);
  CHECK(script.faults[0].kind == FaultKind::lose);
  CHECK(script.faults[0].of_commands);
  CHECK(script.faults[0].every == 3);
  CHECK(script.faults[0].at_s == 0.5);
  CHECK(script.faults[0].for_s == 0.25);
  CHECK(script.faults[1].axis == 2);
  CHECK(script.faults[1].counts == -200);
  CHECK(script.faults[2].ms == 10);
}

TEST_CASE("a script with a duration needs no faults") {
  const auto script = parse_fault_script("seconds = 12", "well.toml");
  CHECK(script.seconds == 12);
  CHECK(script.faults.empty());
}

TEST_CASE("errors of a script name the file, the line and the way out, in one line") {
  struct Bad {
    const char* text;
    const char* part;
  };
  const Bad of_hands[] = {
      {"speed = 3\n[[step]]\nhold = 1", "1: speed: unknown key"},
      {"[[step]]\nhold = 'long'", "2: step.hold: not a number"},
      {"[[step]]\n\nhold = 0", "3: step.hold = 0 is out of range"},
      {"[[step]]\nmove_mm = [1, 2, 2000]", "2: step.move_mm = 2000 is out"},
      {"[[step]]\nmove_mm = [1, 2, inf]", "2: step.move_mm = inf is out"},
      {"[[step]]\nhold = 1\nease = 'bouncy'", "3: step.ease: unknown value"},
      {"[[step]]\nhold = 1\nbutton = 3", "3: step.button = 3 is out of range"},
      {"[[step]]\nhold = 1\nrepeat = 1", "3: step.repeat: not a truth value"},
      {"[[step]]\nhold = 1\ncircle_mm = 2", "1: step: has 2 motions"},
      {"[[step]]\nhold = 1\nturns = 2", "1: step: turns or sink_mm"},
      {"unit_mm = 0\n[[step]]\nhold = 1", "1: unit_mm = 0 is out of range"},
      {"unit_mm = 1", " no steps"},
      {"step = 3", " no steps"},
      {"[[step]]\nhold = = 1", "2: "},
      {"[[step]]\nhold=1\nrepeat=true\n[[step]]\nhold=1\nrepeat=true", "4: step: a second repeat"},
      {"device = 3\n[[step]]\nhold = 1", "1: device: not a table"},
      {"[device]\nmass_kg = 1\n[[step]]\nhold = 1", "2: device.mass_kg: unknown key"},
      {"[hand]\ncoulomb_n = 1\n[[step]]\nhold = 1", "2: hand.coulomb_n: unknown key"},
      {"[device]\ntip_mass_kg = 0\n[[step]]\nhold = 1", "2: device.tip_mass_kg = 0 is out"},
      {"[hand]\nmass_kg = nan\n[[step]]\nhold = 1", "2: hand.mass_kg = nan is out"},
      {"[hand]\nmass_kg = '1'\n[[step]]\nhold = 1", "2: hand.mass_kg: not a number"},
      {"[device]\noutput_delay_cycles = 0.5\n[[step]]\nhold = 1",
       "1: device: output_delay_cycles is not whole"},
  };
  const Bad of_faults[] = {
      {"", " no faults"},
      {"[[fault]]\n", "1: fault: no kind"},
      {"[[fault]]\nkind = \"loose\"\n", "2: fault.kind: unknown"},
      {"[[fault]]\nkind = \"lose\"\naxis = 1\n", "1: fault: lose has no axis"},
      {"[[fault]]\nkind = \"delay\"\n", "1: fault: delay without ms"},
      {"[[fault]]\nkind = \"jump\"\n", "1: fault: jump without counts"},
      {"[[fault]]\nkind = \"stick\"\naxis = 3\n", "3: fault.axis = 3 is out of range"},
      {"[[fault]]\nkind = \"stick\"\naxis = 0.5\n", "1: fault: axis is not whole"},
      {"clock = \"noon\"\n[[fault]]\nkind = \"lose\"\n", "1: clock: unknown"},
      {"latches = \"fear\"\n[[fault]]\nkind = \"lose\"\n", "1: latches: unknown"},
      {"[[fault]]\nkind = \"lose\"\nat = 1\n", "3: fault.at"},
      {"[[fault]\n", ""},
      {"seconds = 0", "1: seconds = 0 is out of range"},
  };
  const auto check = [](const std::string& start, const Bad& bad, const std::string& error) {
    CAPTURE(bad.text);
    CAPTURE(error);
    CHECK(error.starts_with(start + bad.part));
    CHECK_FALSE(has(error, "\n"));
    CHECK(has(error, "; "));
  };
  for (const Bad& bad : of_hands) check("hand.toml:", bad, hand_error(bad.text));
  for (const Bad& bad : of_faults) check("faults.toml:", bad, fault_error(bad.text));
}

TEST_CASE("a script file that is missing, a folder or endless is refused") {
  const kerf::test::TemporaryFolder folder;
  const std::string big = folder.write("big.toml", std::string((1 << 20) + 1, '#'));
  for (const std::string& file :
       {std::string("/nowhere/hand.toml"), std::string("/dev/zero"), folder.path().string(), big}) {
    CAPTURE(file);
    CHECK_THROWS_AS(static_cast<void>(kerf::read_hand_script(file)), kerf::HilError);
  }
}

TEST_CASE("the scripts of the project are read, and random ones differ by seed") {
  CHECK(kerf::read_fault_script(KERF_FAULTS_DIR "/late_host.toml").faults.size() == 5);
  const auto one = kerf::random_faults(1);
  CHECK(one.faults.size() >= 3);
  CHECK(kerf::random_faults(1).faults.size() == one.faults.size());
  CHECK((kerf::random_faults(2).faults.size() != one.faults.size() ||
         kerf::random_faults(2).faults[0].at_s != one.faults[0].at_s));
}

namespace {

/// An Omni whose motors push, so that the faults' clock runs, whose packet is read once a cycle.
struct Bench {
  explicit Bench(const DeviceFault& fault)
      : emulator(kerf::OmniParams{}, std::nullopt), device(emulator, {{fault}, 1}) {
    const auto push = kerf::encode(kerf::OmniCommand{.motor = {0, 400, 0}, .motors_on = true});
    device.receive(push);
    device.advance(1);
    device.advance(1);
  }
  /// Packets of the next `cycles` cycles.
  std::vector<std::vector<std::uint8_t>> packets(int cycles) {
    std::vector<std::vector<std::uint8_t>> all;
    for (int i = 0; i < cycles; ++i) {
      device.advance(1);
      for (auto p = device.next_packet(); !p.empty(); p = device.next_packet()) {
        all.emplace_back(p.begin(), p.end());
      }
    }
    return all;
  }
  std::vector<std::uint32_t> counters(int cycles) {
    std::vector<std::uint32_t> all;
    for (const auto& packet : packets(cycles)) {
      const auto report = kerf::decode_report(packet);
      all.push_back(report ? report->counter : 0);
    }
    return all;
  }

  kerf::Emulator emulator;
  kerf::FaultyDevice device;
};

constexpr double kCycleS = 1.0 / 8000;

}  // namespace

TEST_CASE("lose, duplicate, delay and reorder: the counters of the packets that come") {
  using Counters = std::vector<std::uint32_t>;
  struct {
    DeviceFault fault;
    int cycles;
    Counters counters;
  } const cases[] = {
      {{.kind = FaultKind::lose, .at_s = 3600}, 5, {1, 2, 3, 4, 5}},  // not yet
      {{.kind = FaultKind::duplicate, .for_s = 1}, 2, {1, 1, 2, 2}},
      {{.kind = FaultKind::delay, .for_s = 1, .ms = 0.5}, 6, {1, 2}},  // late, none lost, in order
  };
  for (const auto& [fault, cycles, counters] : cases) {
    CHECK(Bench(fault).counters(cycles) == counters);
  }
  // Each n-th one is lost, for as long as asked.
  Bench lossy({.kind = FaultKind::lose, .at_s = 4 * kCycleS, .for_s = 6 * kCycleS, .every = 2});
  CHECK(lossy.counters(12).size() == 9);
  Bench mixed({.kind = FaultKind::reorder, .for_s = 1, .every = 100});
  const auto counters = mixed.counters(12);
  REQUIRE(counters.size() >= 10);
  CHECK(counters[0] == 2);
  CHECK(std::count(counters.begin(), counters.end(), 1U) == 1);  // after later ones
}

TEST_CASE("a script by the emulator's clock does not wait for a push") {
  kerf::Emulator emulator(kerf::OmniParams{}, std::nullopt);
  kerf::FaultyDevice device(emulator, {.faults = {{.kind = FaultKind::silence, .for_s = 1}},
                                       .clock = kerf::FaultClock::start});
  for (int i = 0; i < 80; ++i) {
    device.advance(1);
    CHECK(device.next_packet().empty());
  }
  CHECK(device.withheld() == 80);
}

TEST_CASE("truncate and corrupt: other bytes, never more") {
  Bench shorter({.kind = FaultKind::truncate, .for_s = 1});
  for (const auto& packet : shorter.packets(50)) CHECK(packet.size() < kerf::omni::kReportBytes);
  Bench wrong({.kind = FaultKind::corrupt, .for_s = 1});
  Bench right({.kind = FaultKind::lose, .at_s = 3600});
  const auto a = wrong.packets(50), b = right.packets(50);
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(a[i] != b[i]);
}

TEST_CASE("jump and park: other reports") {
  Bench right({.kind = FaultKind::lose, .at_s = 3600});
  const auto true_count = kerf::decode_report(right.packets(1)[0])->encoder[1];
  Bench jump({.kind = FaultKind::jump, .for_s = 1, .axis = 1, .counts = 100});
  const auto jumped = kerf::decode_report(jump.packets(1)[0])->encoder[1];
  CHECK(static_cast<std::int16_t>(jumped - true_count) == 100);
  Bench parked({.kind = FaultKind::park, .for_s = 1});
  CHECK(kerf::decode_report(parked.packets(1)[0])->docked);
}

TEST_CASE("a silent device still takes commands, an unplugged one does not") {
  const auto off = kerf::encode(kerf::OmniCommand{});
  Bench silent({.kind = FaultKind::silence, .for_s = 1});
  CHECK(silent.packets(10).empty());
  silent.device.receive(off);
  silent.device.advance(1);
  CHECK_FALSE(silent.emulator.model().motors_on());
  Bench unplugged({.kind = FaultKind::unplug, .for_s = 1});
  CHECK(unplugged.packets(10).empty());
  unplugged.device.receive(off);
  unplugged.device.advance(1);
  CHECK(unplugged.emulator.model().motors_on());
}

TEST_CASE("host_late: reported for as long as it lasts") {
  Bench bench({.kind = FaultKind::host_late, .at_s = 8 * kCycleS, .ms = 1});
  int late = 0;
  for (int i = 0; i < 100; ++i) {
    bench.device.advance(1);
    late += bench.device.host_is_late() ? 1 : 0;
  }
  CHECK(late == 8);
  CHECK(bench.device.begun() == 1);
}

TEST_CASE("a fault has been met when it changed something, not when its time has come") {
  Bench lost({.kind = FaultKind::lose, .at_s = 2 * kCycleS, .for_s = 1});
  CHECK(lost.device.met() == 0);
  lost.packets(8);
  CHECK(lost.device.met() == 1);
  Bench stuck({.kind = FaultKind::stick,  // of an arm that stands still anyhow
               .at_s = 6 * kCycleS,
               .for_s = 1});
  stuck.packets(8);
  CHECK(stuck.device.begun() == 1);
  CHECK(stuck.device.met() == 0);
  Bench late({.kind = FaultKind::host_late, .ms = 1});
  late.packets(1);
  CHECK(late.device.met() == 1);
}

TEST_CASE("an identified device is emulated with its mean mass and friction, and its delay") {
  const auto device = kerf::parse_identified_device(kerf::test::kDeviceFile, "device.toml");
  kerf::PlantParams params;
  take_plant(plant_of(device, 0.001, "device.toml"), params);
  // 3 / tr M^-1 by the eigenvalues' symmetric functions: e2 / det.
  const auto& m = device.mass_kg;
  const double e2 = m[0][0] * m[1][1] + m[0][0] * m[2][2] + m[1][1] * m[2][2] - m[0][1] * m[0][1] -
                    m[0][2] * m[0][2] - m[1][2] * m[1][2];
  const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[1][2]) -
                     m[0][1] * (m[0][1] * m[2][2] - m[1][2] * m[0][2]) +
                     m[0][2] * (m[0][1] * m[1][2] - m[1][1] * m[0][2]);
  CHECK(params.tip_mass_kg == doctest::Approx(3 * det / e2));
  CHECK(params.viscous_ns_per_mm == doctest::Approx(0.0005));
  CHECK(params.coulomb_n == doctest::Approx(0.2));
  CHECK(params.output_delay_cycles == 6);  // 0.8 ms after the period
  take_plant(plant_of(device, 1.0 / 8000, "device.toml"), params);
  CHECK(params.output_delay_cycles == 13);  // 1.675 ms
  take_plant(plant_of(device, 0.002, "device.toml"), params);
  CHECK(params.output_delay_cycles == 0);

  const auto refusal = [](const std::string& from, const std::string& to) {
    const auto odd =
        kerf::parse_identified_device(kerf::test::device_file_with(from, to), "d.toml");
    return kerf::test::error_of([&] { static_cast<void>(plant_of(odd, 0.001, "d.toml")); });
  };
  CHECK(refusal("= 0.0018", "= 0.02") ==
        "d.toml: device.delay_s: 152 bus cycles of 125 us are out of range for an "
        "emulated device; use 0 to 64");
  CHECK(kerf::test::has(refusal("0.0004, 0.0005", "0.4, 0.5"), "device.viscous_ns_per_mm: "));
}

}  // namespace kerf::script_test
