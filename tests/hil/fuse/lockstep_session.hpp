// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "hil/script/hand_script_file.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/servo/support.hpp"

namespace kerf::test {

/// The driver on its real system calls, and above it a servo that touches a half-space, against a
/// mounted node with a hand. In lock-step unless the settings say otherwise.
class FirewireSession {
 public:
  struct Tick {
    DeviceReport report;
    ServoOutput output;
  };

  explicit FirewireSession(const FirewireSettings& settings = {}, FirewireOptions options = {})
      : mounted_(settings, {}, read_hand_script(KERF_HANDS "/touch.toml")) {
    static const std::atomic<bool> kGoOn{false};
    servo_ = compile(scene_);  // first: a hand does not wait long for a host that has come
    options.where = mounted_.path();
    port_ = std::make_unique<FirewirePort>(options, 1000, kGoOn);
    driver_ = std::make_unique<OmniDriver>(*port_);
  }
  ~FirewireSession() { end(); }

  Tick tick() {
    const DeviceReport report = driver_->read();
    return {report, step(report)};
  }
  /// The rest of a tick, for a test that reads by itself.
  ServoOutput step(const DeviceReport& report) {
    const ServoOutput output = servo_->step(report);
    driver_->command(output);
    return output;
  }
  /// Ends the driver, then the node; what the node has seen may be read from then on.
  void end() {
    driver_.reset();
    port_.reset();
    mounted_.stop();
  }

  [[nodiscard]] FirewirePort& port() noexcept { return *port_; }
  [[nodiscard]] OmniDriver& driver() noexcept { return *driver_; }
  [[nodiscard]] const MountedNode& mounted() const noexcept { return mounted_; }

 private:
  MountedNode mounted_;
  LoadedScene scene_ = half_space_scene();
  std::unique_ptr<FirewirePort> port_;
  std::unique_ptr<OmniDriver> driver_;
  std::unique_ptr<Servo> servo_;
};

}  // namespace kerf::test
