// SPDX-License-Identifier: Apache-2.0
// Two arms on one machine: told apart by their serials, and one does not suffer for the other.
#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

#include <doctest/doctest.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

namespace {

using kerf::BusFault;
using kerf::FirewireOptions;
using kerf::FirewireSettings;

constexpr std::uint32_t kOther = 0x83A6'D80E;
const std::atomic<bool> kGoOn{false};

FirewireSettings settings_of(std::uint32_t packed, std::vector<kerf::ScriptedFault> script = {}) {
  FirewireSettings settings;
  settings.packed_serial = packed;
  settings.script = std::move(script);
  return settings;
}

/// `fw0` and `fw1` in one folder, served by one thread.
struct TwoArms {
  TwoArms() : mount(folder.path()) {
    mount.add("fw0", left);
    mount.add("fw1", right);
    thread = std::thread([this] { mount.serve([this] { return !stop; }); });
  }
  ~TwoArms() {
    stop = true;
    thread.join();
  }
  kerf::test::TempFolder folder;
  kerf::Emulator left_arm{kerf::OmniParams{}, {}}, right_arm{kerf::OmniParams{}, {}};
  kerf::FirewireNode left{settings_of(0x82B6'980C), left_arm};
  kerf::FirewireNode right{settings_of(kOther, {{8 * 300, BusFault::vanish}}), right_arm};
  kerf::FuseMount mount;
  std::atomic<bool> stop{false};
  std::thread thread;
};

}  // namespace

TEST_CASE("of two devices one is named by its node or its serial, and none is guessed") {
  const TwoArms arms;
  int refused = 0;
  const auto all = kerf::list_firewire(arms.folder.path(), &refused);
  REQUIRE(all.size() == 2);
  CHECK(refused == 0);
  CHECK(all[0].serial == "50626300006");
  CHECK(all[1].serial == "70427300007");

  FirewireOptions options;
  options.where = arms.folder.path();
  CHECK_THROWS_WITH_AS(static_cast<void>(kerf::find_firewire(options)),
                       doctest::Contains("several devices are there: "), std::runtime_error);
  options.where = arms.folder.path() + "/fw1";
  CHECK(kerf::find_firewire(options).packed == kOther);
  options.where = "50626300006";
  CHECK(kerf::find_firewire(options, arms.folder.path()).path == arms.folder.path() + "/fw0");
  options.where = "50626300007";
  CHECK_THROWS_WITH_AS(static_cast<void>(kerf::find_firewire(options, arms.folder.path())),
                       doctest::Contains("no device of SensAble with this serial number is there"),
                       std::runtime_error);
}

TEST_CASE("one of two devices dies, the other one runs on") {
  const TwoArms arms;
  FirewireOptions options;
  options.where = arms.folder.path() + "/fw0";
  kerf::FirewirePort left_port(options, 0, kGoOn);
  options.where = arms.folder.path() + "/fw1";
  kerf::FirewirePort right_port(options, 0, kGoOn);
  kerf::OmniDriver left(left_port), right(right_port);
  int left_fresh = 0, right_fresh = 0;
  constexpr int kTicks = 3000;
  for (int i = 0; i < kTicks; ++i) {
    left_fresh += left.read().fresh ? 1 : 0;
    right_fresh += right.read().fresh ? 1 : 0;
    left.command({});
    right.command({});
  }
  CHECK(left_fresh == kTicks);
  CHECK(left.lost() == 0);
  CHECK_FALSE(left_port.closed());
  CHECK(right_fresh < 310);
  CHECK(right_port.closed());
}
