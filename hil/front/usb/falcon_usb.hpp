// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "shared/wire/falcon.hpp"

/// The USB side of an emulated Falcon: boot loader, FT232R chip, and the plug with its faults.
namespace kerf {

/// The signal processor behind a Falcon's FTDI chip before its firmware runs: it answers a
/// greeting, then echoes every byte that it stores. It starts the firmware when the host turns to
/// the baud rate of packets. One thread.
class FalconBootLoader {
 public:
  /// `wrong_echo_at`: fault, the n-th byte of the firmware (from 0) comes back wrong; -1: none.
  /// `wrong_loads`: in so many loads, then in none.
  explicit FalconBootLoader(bool firmware_runs, std::int64_t wrong_echo_at = -1,
                            int wrong_loads = kEveryLoad)
      : state_(firmware_runs ? State::running : State::asleep),
        wrong_echo_at_(wrong_echo_at),
        wrong_loads_(wrong_loads) {}
  static constexpr int kEveryLoad = 1'000'000;

  [[nodiscard]] bool running() const noexcept { return state_ == State::running; }
  /// Bytes of firmware received.
  [[nodiscard]] std::int64_t stored() const noexcept { return stored_; }

  void set_divisor(std::uint16_t divisor) noexcept;
  /// A rising edge begins the greeting anew; of a processor that runs its firmware, only at the
  /// boot loader's baud rate: hosts load firmware without asking whether it is there.
  void set_dtr(bool high) noexcept;
  /// A byte of the host; answers go to `line`.
  void take(std::uint8_t byte, std::deque<std::uint8_t>& line);

 private:
  enum class State : std::uint8_t { asleep, greeting, waiting, loading, running };

  void on_greeting(std::uint8_t byte, std::deque<std::uint8_t>& line);

  State state_;
  std::int64_t wrong_echo_at_;
  int wrong_loads_;
  std::int64_t stored_ = 0;
  std::size_t greeted_ = 0;  ///< bytes of the greeting that were right
  std::uint16_t divisor_ = 0;
  bool dtr_ = false;
};

/// The chip of an emulated Falcon: FTDI FT232R (vendor requests, two
/// status bytes, latency timer), and behind its serial line the boot loader and then `device`.
///
/// One packet of at most 64 bytes per 1 ms frame: as soon as 62 bytes wait, otherwise with all
/// that waits (or nothing but status) when the latency timer has run out. The line itself takes no
/// time. One thread.
class FtdiFalcon {
 public:
  struct Settings {
    bool firmware_runs = false;       ///< it was started before, else the boot loader waits
    std::int64_t wrong_echo_at = -1;  ///< fault: that byte of the firmware is echoed wrongly
    std::string serial = "KERF0001";
    const UsbClock* clock = &kMachineClock;  ///< outlives this
  };
  FtdiFalcon(const Settings& settings, PacketDevice& device)
      : serial_(settings.serial),
        device_(device),
        loader_(settings.firmware_runs, settings.wrong_echo_at),
        time_(*settings.clock) {}

  /// Device and configuration descriptors, one after the other.
  [[nodiscard]] static std::span<const std::uint8_t> descriptors() noexcept;
  /// Answer to a control request; empty if the device stalls it.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> control(const UsbSetup& setup);
  /// Bytes of the host for the serial line.
  void out(std::span<const std::uint8_t> bytes);

  /// To the present. `in(packet)` once per frame, if a packet is due and `wants()`.
  template <class Wants, class In>
  void catch_up(Wants wants, In in) {
    time_.catch_up(
        device_, [this](std::span<const std::uint8_t> packet) { on_packet(packet); },
        [&] {
          ++quiet_frames_;
          if (due() && wants()) in(next_in());
        });
  }
  [[nodiscard]] const UsbTime& time() const noexcept { return time_; }
  [[nodiscard]] bool firmware_runs() const noexcept { return loader_.running(); }
  [[nodiscard]] std::int64_t firmware_bytes() const noexcept { return loader_.stored(); }
  /// Packets of the device that went into the line, and ones that had no room there.
  [[nodiscard]] std::uint64_t reports() const noexcept { return reports_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Fault: for so many frames a packet carries at most `kSplitBytes` of the line.
  void slow_down(int frames) noexcept { slow_frames_ = frames; }

 private:
  static constexpr std::size_t kFifoBytes = 256;  ///< towards the host, FT232R data sheet
  static constexpr std::size_t kSplitBytes = 9;

  void on_packet(std::span<const std::uint8_t> packet);
  [[nodiscard]] bool due() const noexcept;
  [[nodiscard]] std::span<const std::uint8_t> next_in();
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> standard(const UsbSetup& setup) const;
  bool set(const UsbSetup& setup);

  std::string serial_;
  PacketDevice& device_;
  FalconBootLoader loader_;
  UsbTime time_;
  falcon::Framer framer_;  ///< of the host's bytes
  std::deque<std::uint8_t> line_;
  std::vector<std::uint8_t> packet_;
  int latency_frames_ = 16;  // the chip's own at power-up
  int quiet_frames_ = 0;
  int slow_frames_ = 0;
  std::uint64_t reports_ = 0, lost_ = 0;
};

/// The host's side of a plug, as `FalconUsb` needs it.
class UsbHost {
 public:
  virtual ~UsbHost() = default;
  /// Bytes that the oldest waiting read takes; empty if there is none.
  [[nodiscard]] virtual std::optional<std::size_t> room() = 0;
  /// Ends the oldest read: with 0 or a negative errno, as in the kernel's URBs.
  virtual void complete_read(int status, std::span<const std::uint8_t> bytes) = 0;
  virtual void plugged(bool in) = 0;
};

/// An emulated Falcon at the end of a USB cable: its chip, its halted endpoint, and the faults of a
/// script. Requests of a host differ between fronts; the device's behaviour is the same, here. One
/// thread.
class FalconUsb {
 public:
  FalconUsb(const FtdiFalcon::Settings& settings, std::vector<ScriptedUsbFault> script,
            PacketDevice& device)
      : chip_(settings, device), script_(std::move(script)) {}

  /// To the present: reads are completed, faults are applied.
  void catch_up(UsbHost& host);
  /// `FtdiFalcon::control`; also frees a halted endpoint if the request asks for it.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> control(const UsbSetup& setup);
  /// Frees an endpoint; returns false if there is none of that address.
  bool clear_halt(unsigned endpoint) noexcept;
  void out(std::span<const std::uint8_t> bytes) { chip_.out(bytes); }
  /// It takes nothing now.
  [[nodiscard]] bool naks() const noexcept { return chip_.time().cycle() < nak_until_; }

  [[nodiscard]] bool present() const noexcept { return present_; }
  [[nodiscard]] const FtdiFalcon& chip() const noexcept { return chip_; }

 private:
  /// Of the endpoint that is read: the first read that meets it ends with -EPIPE, later ones wait.
  enum class Halt { none, unreported, reported };
  void apply_fault(UsbFault fault, UsbHost& host);

  FtdiFalcon chip_;
  UsbFaultScript script_;
  bool present_ = true;
  Halt halt_ = Halt::none;
  std::int64_t nak_until_ = 0;
};

}  // namespace kerf
