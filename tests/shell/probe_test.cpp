// SPDX-License-Identifier: Apache-2.0
#include "controller/run/probe.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/run/probe_nodes.hpp"
#include "tests/support/process.hpp"

namespace {

namespace fs = std::filesystem;
using kerf::Personality;

/// A root with the files of sysfs and /dev that matter, of any device.
struct FakeRoot : kerf::test::TemporaryFolder {
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((*this / name).parent_path());
    std::ofstream(*this / name) << text;
  }
  void add_firewire(const std::string& node, const std::string& vendor) const {
    write("sys/bus/firewire/devices/" + node + "/vendor", vendor + "\n");
    write("dev/" + node, "");
  }
  void add_hid(const std::string& node, const std::string& id) const {
    write("sys/class/hidraw/" + node + "/device/uevent", "DRIVER=hid-generic\nHID_ID=" + id + "\n");
    write("dev/" + node, "");
  }
};

kerf::DeviceReport report(std::array<std::int16_t, 3> counts, bool parked, bool homed = true) {
  return {.fresh = true, .encoder = counts, .parked = parked, .homed = homed};
}

}  // namespace

TEST_CASE("devices are found by vendor and product, on each bus, and no others") {
  const FakeRoot root;
  CHECK(kerf::list_device_nodes(root.path()).empty());
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
  const auto nodes = kerf::list_device_nodes(root.path());
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

TEST_CASE("what lacks is told with its cure: bus, device, rule, group") {
  const FakeRoot root;
  const auto lack = [&](const std::vector<kerf::DeviceNode>& nodes) {
    const auto lacks = kerf::lacks_of_nodes(Personality::omni, nodes, root.path());
    REQUIRE(lacks.size() == 1);
    return lacks[0];
  };
  CHECK(lack({}).cure.find("modprobe firewire-ohci") != std::string::npos);
  root.add_firewire("fw0", "0x001234");
  CHECK(lack({}).what == "omni: none is connected");
  const kerf::DeviceNode closed{Personality::omni, "/dev/fw1", EACCES};
  CHECK(lack({closed}).what == "/dev/fw1: Permission denied");
  CHECK(lack({closed}).cure.find("60-kerf.rules") != std::string::npos);
  root.write("etc/udev/rules.d/60-kerf.rules", "");
  CHECK(lack({closed}).cure.find("usermod -aG plugdev") != std::string::npos);
  const kerf::DeviceNode open{Personality::omni, "/dev/fw1", 0};
  CHECK(kerf::lacks_of_nodes(Personality::omni, {{open}}, root.path()).empty());
  CHECK(kerf::lacks_of_nodes(std::nullopt, {}, root.path()).empty());
}

TEST_CASE("the view follows counts over the wrap and knows the tip once parked at rest") {
  kerf::ProbeView view({}, 1000);
  std::int64_t now_ns = 0;
  const auto take = [&](const kerf::DeviceReport& said) { view.take(said, now_ns += 1'000'000); };
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
  kerf::DeviceSettings falcon;
  falcon.personality = Personality::falcon;
  kerf::ProbeView view(falcon, 1000);
  for (int i = 0; i < 100; ++i) view.take(report({1, 2, 3}, true, false), i * 1'000'000);
  CHECK_FALSE(view.seen().calibrated);
  CHECK_FALSE(view.seen().homed);
}
