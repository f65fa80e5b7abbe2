// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "hil/front/serving.hpp"
#include "hil/front/usb/wooden_hid.hpp"

namespace kerf {

/// An emulated WoodenHaptics arm in the kernel's HID stack, by /dev/uhid (linux/uhid.h): the
/// kernel's own hidraw node stands above it. Reports go while somebody has the node open.
class UhidArm final : public KernelDevice, private HidHost {
 public:
  /// `fd` is /dev/uhid, or a socket that keeps messages apart. Owned here.
  UhidArm(int fd, const WoodenHid::Settings& settings, PacketDevice& device);
  UhidArm(const UhidArm&) = delete;
  UhidArm& operator=(const UhidArm&) = delete;
  ~UhidArm() override;

  [[nodiscard]] int descriptor() const noexcept override { return fd_; }
  void answer() override;
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override {
    return arm_.time().next_frame_ns();
  }
  void wake() override { arm_.catch_up(*this); }

  /// Somebody has written, and nobody has the node open any more.
  [[nodiscard]] bool left() const noexcept { return used_ && !open_; }
  [[nodiscard]] const WoodenHid& arm() const noexcept { return arm_; }
  /// Reports that the kernel did not take.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  void hear(std::span<const std::uint8_t> report) override;
  void plugged(bool in) override;
  void create();

  WoodenHid arm_;
  int fd_;
  bool open_ = false;
  bool used_ = false;
  std::uint64_t lost_ = 0;
};

/// /dev/uhid, open; throws `HilError` where it is missing or there is no right to it.
[[nodiscard]] int open_uhid();

}  // namespace kerf
