// SPDX-License-Identifier: Apache-2.0
// A run beside its loop: messages, report, checks of the scene, the probe.
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <ios>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/loop/wait_state.hpp"
#include "controller/run/probe.hpp"
#include "controller/run/run_report.hpp"
#include "controller/run/scene_check.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/text/text.hpp"
#include "tests/json.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::run_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

Waiting waiting_in(Phase phase, const DeviceReport& report) {
  ServoOutput output;
  output.phase = phase;
  return waiting_for(report, output);
}

}  // namespace

TEST_CASE("what a device waits for follows from its phase and its report") {
  const DeviceReport unhomed{.fresh = true, .parked = true, .homed = false};
  const DeviceReport in_hand{.fresh = true};
  const DeviceReport parked{.fresh = true, .parked = true};
  CHECK(waiting_in(Phase::off, {}) == Waiting::report);
  for (const Phase phase : {Phase::calibrating, Phase::fault}) {
    CHECK(waiting_in(phase, unhomed) == Waiting::homing);
    CHECK(waiting_in(phase, in_hand) == Waiting::parked);
    CHECK(waiting_in(phase, parked) == Waiting::rest);
  }
  CHECK(waiting_in(Phase::armed, parked) == Waiting::hand);
  CHECK(waiting_in(Phase::ramping, in_hand) == Waiting::nothing);
  CHECK(waiting_in(Phase::active, in_hand) == Waiting::nothing);
}

TEST_CASE("each device has its own words for what its user does") {
  CHECK(text_of(Personality::omni, Waiting::parked) ==
        "waiting until parked: rest the stylus in the inkwell");
  CHECK(text_of(Personality::falcon, Waiting::homing) ==
        "waiting until homed: pull the grip all the way out, then push it in");
  CHECK(text_of(Personality::woodenhaptics, Waiting::hand) ==
        "waiting to be picked up: move the arm away from its home pose");
  CHECK(text_of(Personality::omni, Waiting::nothing).empty());
}

TEST_CASE("a wait of a second is reported, each kind once until the force comes on") {
  WaitNotice teller;
  std::vector<std::string> told;
  std::int64_t now_ns = 0, servo_ns = 0;
  const auto wait = [&](Waiting waiting, int ms) {
    for (int i = 0; i < ms; i += 50, now_ns += 50 * kMs, servo_ns += 50 * kMs) {
      if (!teller.look(waiting, now_ns, servo_ns)) continue;
      told.push_back(text_of(Personality::omni, waiting));
      told.back() += " @" + std::to_string(now_ns / kMs);
    }
  };
  wait(Waiting::parked, 950);  // a hand that goes about it
  wait(Waiting::rest, 50);
  CHECK(told.empty());
  wait(Waiting::parked, 60'000);
  REQUIRE(told.size() == 1);
  CHECK(told[0] == "waiting until parked: rest the stylus in the inkwell @2000");
  wait(Waiting::hand, 2400);  // an emulated hand of a vendor's library waits for 2 s
  CHECK(told.size() == 1);
  wait(Waiting::hand, 5000);
  CHECK(told.size() == 2);
  wait(Waiting::parked, 5000);  // again, without force in between
  CHECK(told.size() == 2);
  wait(Waiting::nothing, 5000);
  CHECK(told.size() == 2);
  wait(Waiting::parked, 5000);  // after a fault
  CHECK(told.size() == 3);
}

TEST_CASE("each wait begins anew, by the clock and in ticks, whichever of them runs faster") {
  constexpr std::int64_t kFastMs = 5000, kSlowMs = 800;
  for (const bool ticks_run_faster : {false, true}) {
    CAPTURE(ticks_run_faster);
    WaitNotice teller;
    std::int64_t now_ms = 0, servo_ms = 0;
    for (int cycle = 0; cycle < 2; ++cycle) {
      for (const Waiting waiting : {Waiting::parked, Waiting::rest, Waiting::nothing}) {
        CHECK_FALSE(teller.look(waiting, now_ms * kMs, servo_ms * kMs));
        now_ms += ticks_run_faster ? kSlowMs : kFastMs;
        servo_ms += ticks_run_faster ? kFastMs : kSlowMs;
        CHECK_FALSE(teller.look(waiting, now_ms * kMs, servo_ms * kMs));
      }
    }
  }
}

TEST_CASE("while no tick comes in lock-step nothing is reported: the machine is busy") {
  WaitNotice teller;
  for (std::int64_t now_ns = 0; now_ns < 60'000 * kMs; now_ns += 50 * kMs) {
    CHECK_FALSE(teller.look(Waiting::report, now_ns, 0));
  }
  // Ticks without a word of the device, as fast as they can.
  CHECK(teller.look(Waiting::report, 60'000 * kMs, 1000 * kMs));
}

TEST_CASE("the report has every promised key, hashes as 16 hex digits") {
  RunReport report;
  report.record.ticks = 3;
  report.record.output_hash = 0xab;
  report.record.add_fault(2, "stale_input");
  report.link = {{"bus_resets", 2}};
  report.start_to_force_ms = 812.5;
  const auto json = kerf::test::read_json(report_json(report));
  for (const char* key :
       {"ticks", "overruns", "stale_ticks", "wake_us", "compute_us", "publish_us", "allocations",
        "minor_faults", "major_faults", "contact_ticks", "peak_force_n", "removed_mm3", "energy_j",
        "port_minimum_j", "energy_by_source_j", "faults", "events", "volume_hash", "output_hash"}) {
    CAPTURE(key);
    CHECK(json.contains(key));
  }
  for (const char* key : {"wake_us", "compute_us", "publish_us"}) {
    for (const char* part : {"p50", "p99", "p999", "max"}) CHECK(json[key].contains(part));
  }
  CHECK(json["output_hash"] == "00000000000000ab");
  CHECK(json["faults"][0]["tick"] == 2);
  CHECK(json["faults"][0]["name"] == "stale_input");
  CHECK(json["link"]["bus_resets"] == 2);
  CHECK(json["start_to_force_ms"] == 812.5);
}

TEST_CASE(
    "report and summary have the volume removed of each material, and touches of forbidden ones") {
  RunReport report;
  report.materials = {{"enamel", 2.1, {}}, {"dentin", 0.0001, {}}, {"pulp", 0.0, 121.0}};
  const auto json = kerf::test::read_json(report_json(report));
  CHECK(json["removed_mm3_by_material"]["enamel"] == 2.1);
  CHECK(json["removed_mm3_by_material"]["dentin"] == 0.0001);
  CHECK(json["forbidden_ms"] == kerf::test::ReadJson(Json{{"pulp", 121.0}}));
  const std::string text = summary(report);
  CHECK(text.find("  of these   enamel 2.100 mm3\n") != std::string::npos);
  CHECK(text.find("  forbidden  touched: pulp 121 ms\n") != std::string::npos);
}

TEST_CASE(
    "of two arms report and summary have each one's own figures, and which was never in use") {
  RunReport report;
  report.device = "omni";
  report.lost_packets = 1;
  report.second = ArmReport{"touch", "flame", 1.2, 21, 22, {{"bus_resets", 23}}};
  const auto fill = [](ArmRecord& arm, std::uint64_t n) {
    arm.in_use = true;
    arm.stale_ticks = n;
    arm.contact_ticks = 10 * n;
    arm.shaft_ticks = 100 * n;
    arm.peak_force_n = 0.5 * static_cast<double>(n);
    arm.absorbed_mj = 1000.0 * static_cast<double>(n);
    arm.port_minimum_mj = -1000.0 * static_cast<double>(n);
    arm.energy_mj[0] = 2000.0 * static_cast<double>(n);
    arm.output_hash = 0xa0 + n;
  };
  fill(report.record, 3);
  fill(report.record.second, 4);
  report.record.second.faults.add(7, "overspeed");
  const auto first = kerf::test::read_json(report_json(report));
  const auto second = first["second"];
  CHECK(second["device"] == "touch");
  CHECK(second["tool"] == "flame");
  CHECK(second["lost_packets"] == 21);
  CHECK(second["refused_packets"] == 22);
  CHECK(second["link"]["bus_resets"] == 23);
  CHECK(first["fault_count"] == 0);
  CHECK(second["fault_count"] == 1);
  CHECK(second["faults"][0]["name"] == "overspeed");
  for (const auto& [arm, n] : {std::pair{first, 3}, {second, 4}}) {
    CHECK(arm["stale_ticks"] == n);
    CHECK(arm["contact_ticks"] == 10 * n);
    CHECK(arm["shaft_ticks"] == 100 * n);
    CHECK(arm["peak_force_n"] == 0.5 * n);
    CHECK(arm["energy_j"] == 1.0 * n);
    CHECK(arm["port_minimum_j"] == -1.0 * n);
    CHECK(arm["energy_by_source_j"][kEnergySourceNames[0]] == 2.0 * n);
    CHECK(arm["output_hash"] == hex64(0xa0U + static_cast<unsigned>(n)));
  }
  CHECK(second["in_use"].get<bool>());
  const auto has = [&](const char* text) {
    return summary(report).find(text) != std::string::npos;
  };
  CHECK(has("  contact    30 ticks, peak force 1.500 N, work of the hand 3000.000 mJ\n"));
  CHECK(
      has("\n  second arm touch with tool flame\n"
          "  contact    40 ticks, peak force 2.000 N, work of the hand 4000.000 mJ\n"
          "  energy     lowest -4000.000 mJ"));
  CHECK(
      has("  losses     4 stale ticks, 21 packets lost\n  hash       output 00000000000000a4\n"
          "  fault      overspeed at tick 7\n"));
  CHECK_FALSE(has("never in use"));
  report.record.in_use = false;
  CHECK(has("first arm  never in use"));
  CHECK_FALSE(has("flame, never in use"));
  report.record.in_use = true;
  report.record.second.in_use = false;
  CHECK(has("second arm touch with tool flame, never in use\n"));
  CHECK_FALSE(has("first arm"));
}

TEST_CASE("the emulator of each arm gets the script, and the unit, of its own hand") {
  LoadedScene scene;
  scene.tools = {make_tool("ball 1 mm", "ball", {.pitch_mm = 0.1, .radius_mm = 0.5}),
                 make_tool("ball 4 mm", "ball", {.pitch_mm = 0.1, .radius_mm = 2})};
  scene.hand_script = "first.toml";
  scene.device.personality = Personality::omega;
  const std::string alone = hand_lines(scene);
  scene.second.emplace();
  scene.second_tool = 1;
  scene.second->device.personality = Personality::falcon;
  scene.second->hand_script = "second.toml";
  const std::string lines = hand_lines(scene);
  CHECK(lines.starts_with(alone));
  CHECK(alone.find("hand_script=first.toml\n") != std::string::npos);
  const auto number_at = [](const std::string& text, const std::string& key) {
    return std::stod(text.substr(text.find('\n' + key) + key.size() + 1));
  };
  CHECK(number_at('\n' + lines, "second_hand_unit_mm=") ==
        doctest::Approx(4 * number_at('\n' + lines, "hand_unit_mm=")));
  CHECK(lines.find("\ndevice=omega\nsecond_device=falcon\n") != std::string::npos);
  CHECK(lines.ends_with("\nsecond_hand_script=second.toml\n"));
}

TEST_CASE("an event is no fault, and more of them than fit hide none") {
  RunReport report;
  for (std::uint64_t i = 0; i < 100; ++i) report.record.add_event(i, "watchdog");
  report.record.add_fault(101, "stale_input");
  const auto json = kerf::test::read_json(report_json(report));
  CHECK(json["events"].size() == EventList::kMax);
  CHECK(json["events"][0]["name"] == "watchdog");
  CHECK(json["event_count"] == 100);
  CHECK(json["faults"].size() == 1);
  CHECK(json["faults"][0]["name"] == "stale_input");
  CHECK(json["fault_count"] == 1);
  const std::string text = summary(report);
  CHECK(text.find("fault      stale_input at tick 101\n") != std::string::npos);
  CHECK(text.find("event      watchdog at tick 0\n") != std::string::npos);
  CHECK(text.find("fault      watchdog") == std::string::npos);
}

TEST_CASE("a scan has a line of its scale beside the removed volume") {
  RunReport report;
  report.removed_mm3 = 10957.714;
  report.materials = {{"soft tissue", 0.0}, {"bone", 10957.714}};
  CHECK(summary(report).find("  scale ") == std::string::npos);
  report.workspace_scale = 4.4625;
  report.tool = "ball 16";
  report.tool_mm = 48;
  CHECK(summary(report).find(
            "  removed    10957.714 mm3\n  of these   bone 10957.714 mm3\n"
            "  scale      1 mm of the hand is 4.46 mm here, where tool ball 16 is 48 mm wide\n") !=
        std::string::npos);
}

TEST_CASE(
    "a scene reports up to which speed no tool is dragged in air, and warns of hands beyond") {
  LoadedScene scene;
  scene.tools = {make_tool("ball 1 mm", "ball", {.pitch_mm = 0.1, .radius_mm = 0.5}),
                 make_tool("fissure", "cylinder", {.pitch_mm = 0.1, .radius_mm = 0.5})};
  SceneCosts costs;
  CHECK(air_lines(scene, costs).empty());  // the paper's force drags nothing
  costs.air_speeds_mm_per_s = {2500, 1000};
  CHECK(air_lines(scene, costs) == "free_of_drag_m_per_s=1.00\n");
  costs.air_speeds_mm_per_s = {2500, 340};
  CHECK(air_lines(scene, costs) ==
        "free_of_drag_m_per_s=0.34\nnote=tool fissure has drag in air near a surface if the "
        "hand is faster than 0.34 m/s; a higher rate or larger voxels raise that\n");
}

TEST_CASE("a volume that ends in a density that contact counts is reported") {
  SceneVolume volume;
  volume.name = "scan";
  volume.image.grid = {5, 4, 3};
  volume.image.density.assign(volume.image.grid.voxel_count(), 0);
  volume.iso = Density{32000};
  volume.image.density[volume.image.grid.index(2, 2, 1)] = 65535;  // inside
  CHECK(border_line(volume).empty());
  for (const VoxelIndex at : {VoxelIndex{0, 2, 1}, VoxelIndex{4, 1, 1}, VoxelIndex{2, 0, 1},
                              VoxelIndex{2, 3, 1}, VoxelIndex{2, 2, 0}, VoxelIndex{2, 2, 2}}) {
    Density& border = volume.image.density[volume.image.grid.index(at.x, at.y, at.z)];
    border = 3999;
    CHECK(border_line(volume).empty());
    border = 4000;
    CHECK(border_line(volume) ==
          "note=scan ends in a density of 0.061, of an iso of 0.488, and air is 0: a fast tool may "
          "feel that step; give it a window that begins at its air\n");
    volume.solid = false;
    CHECK(border_line(volume).empty());
    volume.solid = true;
    border = 0;
  }
}

TEST_CASE("no output of a run takes the place of a file of its scene") {
  const kerf::test::TemporaryFolder folder;
  for (const char* name : {"scene", "hand", "ct.nrrd", "ct-labels.nrrd", "rest-b.nrrd", "bur"}) {
    std::ofstream(folder / name) << "mine";
  }
  LoadedScene scene;
  scene.path = (folder / "scene").string();
  scene.hand_script = (folder / "hand").string();
  scene.volume_specs.resize(2);
  scene.volume_specs[0].file = "ct.nrrd";
  scene.volume_specs[1].file = "rest-b.nrrd";
  scene.volumes.resize(2);
  scene.volumes[1].name = "b";
  scene.tool_specs.resize(2);
  scene.tool_specs[1].file = "bur";
  for (const char* name : {"scene", "hand", "bur"}) {
    ControllerOptions options;
    options.report = (folder / name).string();
    CHECK_THROWS_AS(check_run_files(options, scene), FileError);
    std::swap(options.report, options.emulator_args);
    CHECK_THROWS_AS(check_run_files(options, scene), FileError);
  }
  // The second volume of rest.nrrd is rest-b.nrrd.
  for (const char* name : {"ct.nrrd", "ct-labels.nrrd", "rest.nrrd"}) {
    ControllerOptions options;
    options.final_volume = (folder / name).string();
    CAPTURE(name);
    CHECK_THROWS_AS(check_run_files(options, scene), FileError);
  }
  ControllerOptions options;
  options.report = (folder / "report.json").string();
  options.final_volume = (folder / "final.nrrd").string();
  CHECK_NOTHROW(check_run_files(options, scene));
  scene.volume_specs[0].file = "final.mhd";  // has the labels of final.nrrd, but there are none
  CHECK_NOTHROW(check_run_files(options, scene));
}

namespace {

/// A root with the files of sysfs and /dev that matter, of any device.
struct FakeRoot : kerf::test::TemporaryFolder {
  void add_firewire(const std::string& node, const std::string& vendor) const {
    write("sys/bus/firewire/devices/" + node + "/vendor", vendor + "\n");
    write("dev/" + node, "");
  }
  void add_hid(const std::string& node, const std::string& id) const {
    write("sys/class/hidraw/" + node + "/device/uevent", "DRIVER=hid-generic\nHID_ID=" + id + "\n");
    write("dev/" + node, "");
  }
};

DeviceReport report(std::array<std::int16_t, 3> counts, bool parked, bool homed = true) {
  return {.fresh = true, .counts = counts, .parked = parked, .homed = homed};
}

}  // namespace

TEST_CASE("devices are found by vendor and product, on each bus, and no others") {
  const FakeRoot root;
  CHECK(list_device_nodes(root.path()).empty());
  root.add_firewire("fw0", "0x001234");  // the card itself
  root.add_firewire("fw1", "0x000b99");
  root.add_hid("hidraw0", "0003:0000046D:0000C31C");
  root.add_hid("hidraw1", "0003:00001234:00000006");
  root.add_hid("hidraw2", "0003:000016C0:00000486");
  for (const auto& [file, text] :
       {std::pair{"idVendor", "0403"}, {"idProduct", "cb48"}, {"busnum", "1"}, {"devnum", "12"}}) {
    root.write(std::string("sys/bus/usb/devices/1-2/") + file, std::string(text) + "\n");
  }
  root.write("sys/bus/usb/devices/usb1/idVendor", "1d6b\n");
  const auto nodes = list_device_nodes(root.path());
  REQUIRE(nodes.size() == 4);
  CHECK(nodes[0].path == (root / "dev/bus/usb/001/012").string());
  CHECK(nodes[0].personality == Personality::falcon);
  CHECK(nodes[0].open_error == ENOENT);  // sysfs has it, /dev does not
  CHECK(nodes[1].path == (root / "dev/fw1").string());
  CHECK(nodes[1].personality == Personality::omni);
  CHECK(nodes[1].open_error == 0);
  CHECK(nodes[2].personality == Personality::woodenhaptics);
  CHECK(nodes[3].path == (root / "dev/hidraw2").string());
}

TEST_CASE("a Touch and an omega are found on USB by their numbers, and no others") {
  const FakeRoot root;
  const auto add = [&](const char* place, const char* vendor, const char* product, int number) {
    const std::string folder = std::string("sys/bus/usb/devices/") + place + '/';
    root.write(folder + "idVendor", std::string(vendor) + '\n');
    root.write(folder + "idProduct", std::string(product) + '\n');
    root.write(folder + "busnum", "2\n");
    root.write(folder + "devnum", std::to_string(number) + '\n');
  };
  add("2-1", "2988", "0302", 1);
  add("2-2", "0301", "2988", 2);
  add("2-3", "1451", "0402", 3);
  add("2-4", "0301", "0302", 4);
  add("2-5", "1451", "0403", 5);
  const auto nodes = list_device_nodes(root.path());
  REQUIRE(nodes.size() == 3);
  CHECK(nodes[0].personality == Personality::touch);
  CHECK(nodes[1].personality == Personality::touch);
  CHECK(nodes[2].personality == Personality::omega);
  CHECK(nodes[2].path == (root / "dev/bus/usb/002/003").string());
}

TEST_CASE("a lack is reported with its cure: bus, device, rule, group") {
  const FakeRoot root;
  const auto lack = [&](const std::vector<DeviceNode>& nodes) {
    const auto lacks = lacks_of_nodes(Personality::omni, nodes, root.path());
    REQUIRE(lacks.size() == 1);
    return lacks[0];
  };
  CHECK(lack({}).cure.find("modprobe firewire-ohci") != std::string::npos);
  root.add_firewire("fw0", "0x001234");
  CHECK(lack({}).what == "omni: none is connected");
  const DeviceNode closed{Personality::omni, "/dev/fw1", EACCES};
  CHECK(lack({closed}).what == "/dev/fw1: Permission denied");
  CHECK(lack({closed}).cure.find("60-kerf.rules") != std::string::npos);
  root.write("etc/udev/rules.d/60-kerf.rules", "");
  CHECK(lack({closed}).cure.find("usermod -aG plugdev") != std::string::npos);
  const DeviceNode open{Personality::omni, "/dev/fw1", 0};
  CHECK(lacks_of_nodes(Personality::omni, {{open}}, root.path()).empty());
  CHECK(lacks_of_nodes(std::nullopt, {}, root.path()).empty());
}

TEST_CASE("an Inverse3 is there if its port is on USB and its service listens") {
  const FakeRoot root;
  const auto lack = [&] {
    const auto lacks =
        lacks_of_nodes(Personality::inverse3, list_device_nodes(root.path()), root.path());
    return lacks.empty() ? "" : lacks[0].what;
  };
  root.write("sys/bus/usb/devices/usb1/idVendor", "1d6b\n");
  CHECK(lack() == "inverse3: none is connected");
  constexpr const char* kTable =
      "  sl  local_address rem_address   st tx_queue rx_queue\n"
      "   0: 0100007F:2711 00000000:0000 %s 00000000:00000000 00:00000000 00000000\n";
  const auto table = [&](const char* state) {
    std::string text = kTable;
    return text.replace(text.find("%s"), 2, state);
  };
  root.write("proc/net/tcp", table("0A"));
  CHECK(lack() == "inverse3: none is connected");
  root.write("sys/bus/usb/devices/1-3/idVendor", "16c0\n");
  root.write("sys/bus/usb/devices/1-3/idProduct", "0483\n");
  CHECK(lack().empty());
  CHECK(list_device_nodes(root.path()).at(0).path == "127.0.0.1:10001");
  root.write("proc/net/tcp", table("01"));  // a connection, no listener
  CHECK(lack() == "inverse3: no service listens at port 10001");
}

TEST_CASE("the view follows counts over the wrap and knows the tip once parked at rest") {
  ProbeView view({}, 1000);
  std::int64_t now_ns = 0;
  const auto take = [&](const DeviceReport& said) { view.take(said, now_ns += 1'000'000); };
  take({});
  CHECK(view.seen().ticks == 0);  // counted from the first report on
  take(report({32767, 0, 0}, false));
  take(report({-32768, 0, 0}, false));
  CHECK(view.seen().highest[0] == 1);
  CHECK_FALSE(view.seen().calibrated);
  CHECK(view.line().find("unknown until parked") != std::string::npos);
  for (int i = 0; i < 51; ++i) take(report({-32768, 0, 0}, true));
  CHECK(view.seen().calibrated);
  // The Omni in its inkwell: x 0, and the pose of the dock angles by the formula of its kinematics.
  CHECK(view.tip_mm()[0] == doctest::Approx(0));
  CHECK(view.tip_mm()[1] == doctest::Approx(-70.58).epsilon(0.001));
  take({});
  take({});
  take(report({-32768, 0, 0}, true));
  CHECK(view.seen().longest_gap_ms == doctest::Approx(3));
  CHECK(view.seen().ticks == view.seen().reports + 2);
}

TEST_CASE("an unhomed device is never calibrated") {
  DeviceSettings falcon;
  falcon.personality = Personality::falcon;
  ProbeView view(falcon, 1000);
  for (int i = 0; i < 100; ++i) view.take(report({1, 2, 3}, true, false), i * 1'000'000);
  CHECK_FALSE(view.seen().calibrated);
  CHECK_FALSE(view.seen().homed);
}

namespace {

template <class Exception>
std::string failure_of(const Exception& exception) {
  try {
    throw exception;
  } catch (...) {
    return failure_text();
  }
}

}  // namespace

TEST_CASE("a failure is one line with a way out") {
  CHECK(failure_of(std::runtime_error("scene.toml: value; way\nout")) ==
        "scene.toml: value; way\\nout");
  CHECK(failure_of(std::bad_alloc())
            .ends_with("; take a smaller volume, free memory, or raise ulimit -v"));
  CHECK(failure_of(std::system_error(EAGAIN, std::generic_category())) ==
        "threads: Resource temporarily unavailable; raise ulimit -u, or TasksMax of the service");
  CHECK(failure_of(std::system_error(ENOMEM, std::generic_category(), "mmap")) ==
        failure_of(std::bad_alloc()));
  CHECK(failure_of(std::ios_base::failure("read", {EIO, std::generic_category()})) ==
        "a file: Input/output error; check its disk, or copy it again");
  const auto code = [](int error) { return std::error_code(error, std::generic_category()); };
  CHECK(failure_of(std::filesystem::filesystem_error("rename", "/a/b", code(EACCES))) ==
        "/a/b: Permission denied; check the path and its rights");
  CHECK(failure_of(std::filesystem::filesystem_error("open", "/a/b", code(EMFILE))) ==
        "/a/b: Too many open files; raise ulimit -n");
}

TEST_CASE("a limit of the machine has its own way out, anything else the usual one") {
  CHECK(remedy_for(EMFILE, "knock") == std::string("raise ulimit -n"));
  CHECK(remedy_for(EFBIG, "knock") == std::string("raise ulimit -f"));
  CHECK(remedy_for(ENOMEM, "knock") == std::string("free memory, or raise ulimit -v"));
  CHECK(remedy_for(ENOENT, "knock") == std::string("knock"));
  CHECK(remedy_for(EAGAIN, "knock") == std::string("knock"));  // a full queue, of a socket
}

}  // namespace kerf::run_test
