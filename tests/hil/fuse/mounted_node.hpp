// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/wooden.hpp"
#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "tests/hil/fuse/served_node.hpp"

/// The three emulated devices as nodes on FUSE.
namespace kerf::test {

/// A device on FireWire.
class MountedDevice : public ServedNode<FirewireNode> {
 public:
  MountedDevice(const FirewireSettings& settings, PacketDevice& device,
                std::function<void()> prepare = {})
      : ServedNode("fw1", std::move(prepare), settings, device) {}
};

/// The emulated Omni as a FireWire node.
class MountedNode {
 public:
  explicit MountedNode(const FirewireSettings& settings = {}, const OmniParams& params = {},
                       const std::optional<HandScript>& hand = {})
      : emulator_(params, hand), device_(settings, emulator_) {}

  void stop() { device_.stop(); }
  [[nodiscard]] std::string folder() const { return device_.folder(); }
  [[nodiscard]] std::string path() const { return device_.path(); }
  [[nodiscard]] std::string port() const { return "fw:" + path(); }
  [[nodiscard]] const FirewireNode& node() const noexcept { return device_.node(); }
  [[nodiscard]] const FuseMount& mount() const noexcept { return device_.mount(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }

 private:
  Emulator emulator_;
  MountedDevice device_;
};

/// A device's clock that a host may hold: from then on it moves only as far as the host lets it. So
/// a test about milliseconds of a device holds on every machine, however busy or slow. Any thread.
class HeldClock final : public UsbClock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override {
    const std::scoped_lock lock(mutex_);
    return present_ns();
  }
  [[nodiscard]] std::int64_t wake_ns(std::int64_t ns) const noexcept override {
    const std::scoped_lock lock(mutex_);
    if (!held_ns_) return ns + behind_ns_;
    if (ns <= *held_ns_) return 0;
    reached_ns_ = held_ns_;
    return monotonic_ns() + kPollNs;
  }
  void hold() {
    const std::scoped_lock lock(mutex_);
    held_ns_ = present_ns();
  }
  /// Only while it is held: lets so much of the device's time pass, and returns when the device has
  /// reached it, at most a second later.
  void pass(std::int64_t ns) {
    {
      const std::scoped_lock lock(mutex_);
      *held_ns_ += ns;
    }
    const std::int64_t until_ns = monotonic_ns() + kNsPerSecond;
    while (!is_reached() && monotonic_ns() < until_ns) sleep_until_ns(monotonic_ns() + kPollNs / 2);
  }
  /// It goes on with the machine's clock, from its present time.
  void let_go() {
    const std::scoped_lock lock(mutex_);
    behind_ns_ = monotonic_ns() - present_ns();
    held_ns_.reset();
  }

 private:
  static constexpr std::int64_t kPollNs = 50'000;

  /// The device has asked for a later time.
  [[nodiscard]] bool is_reached() const {
    const std::scoped_lock lock(mutex_);
    return reached_ns_ == held_ns_;
  }
  [[nodiscard]] std::int64_t present_ns() const {
    return held_ns_ ? *held_ns_ : monotonic_ns() - behind_ns_;
  }

  mutable std::mutex mutex_;
  std::int64_t behind_ns_ = 0;  ///< the machine's clock
  std::optional<std::int64_t> held_ns_;
  mutable std::optional<std::int64_t> reached_ns_;  ///< by the device
};

inline const std::atomic<bool> kGoOn{false};

/// Faults at these milliseconds since the node was made.
inline std::vector<ScriptedUsbFault> at_ms(std::vector<ScriptedUsbFault> script) {
  for (ScriptedUsbFault& entry : script) entry.cycle *= kCyclesPerUsbFrame;
  return script;
}

/// The server's thread, if the process may: with a higher priority than the servo, on its core.
inline void become_device() {
  static_cast<void>(make_real_time(82, -1));
}

inline std::optional<HandScript> touching_hand() {
  return read_hand_script(KERF_HANDS "/touch.toml");
}

/// A hand that comes down, and then presses on.
inline std::optional<HandScript> pressing_hand() {
  HandScript script;
  script.start = {0, 4, 0};
  script.steps = {hand_move({0, -1, 0}, 0.4), hand_move({0, -1, 0}, 10)};
  return script;
}
/// The settings of a device that goes by `clock`.
template <class Settings>
Settings by(const HeldClock& clock, Settings settings) {
  settings.clock = &clock;
  return settings;
}

/// The emulated Falcon as a usbfs node.
class MountedFalcon {
 public:
  explicit MountedFalcon(const FtdiFalcon::Settings& settings = {.firmware_runs = true},
                         std::vector<ScriptedUsbFault> script = {},
                         const std::optional<HandScript>& hand = touching_hand())
      : emulator_(std::make_unique<FalconModel>(), hand),
        served_("usb", become_device, by(clock_, settings), at_ms(std::move(script)), emulator_) {}

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] std::string port() const { return "usb:" + path(); }
  [[nodiscard]] const UsbfsNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }
  [[nodiscard]] HeldClock& clock() noexcept { return clock_; }

 private:
  HeldClock clock_;
  Emulator emulator_;
  ServedNode<UsbfsNode> served_;
};

/// The emulated WoodenHaptics arm as a hidraw node.
class MountedArm {
 public:
  explicit MountedArm(WoodenHid::Settings settings = {},
                      const std::optional<HandScript>& hand = touching_hand(),
                      std::array<int, 3> encoder_sign = {1, 1, 1})
      : emulator_(std::make_unique<WoodenModel>(params_of(settings, encoder_sign)), hand),
        served_("hidraw0", become_device, by(clock_, with_cycles(std::move(settings))), emulator_) {
  }

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] std::string port() const { return "hid:" + path(); }
  [[nodiscard]] const HidrawNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }
  [[nodiscard]] HeldClock& clock() noexcept { return clock_; }

 private:
  static WoodenParams params_of(const WoodenHid::Settings& settings,
                                std::array<int, 3> encoder_sign) {
    WoodenParams params;
    params.encoder_sign = encoder_sign;
    params.packet_bytes = settings.packet_bytes;
    return params;
  }
  static WoodenHid::Settings with_cycles(WoodenHid::Settings settings) {
    settings.script = at_ms(std::move(settings.script));
    return settings;
  }

  HeldClock clock_;
  Emulator emulator_;
  ServedNode<HidrawNode> served_;
};

}  // namespace kerf::test
