// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kerf {

/// One figure of what a link has been through, as the reports name it.
struct LinkCounter {
  const char* name = "";
  std::uint64_t value = 0;
};

/// The interface between a bus and a driver: whole packets in, whole packets out.
///
/// The driver does not see which bus it is (a socket to an emulator, FireWire, USB, HID). Never
/// blocks, allocates or throws unless a method states it. Servo thread only, except the methods
/// that send and `closed`, which any thread and any signal handler may call.
class PacketPort {
 public:
  virtual ~PacketPort() = default;

  /// Takes the oldest waiting packet and returns its size; 0 when none waits. A packet longer than
  /// `out` is cut to it and its full size returned.
  [[nodiscard]] virtual std::size_t receive(std::span<std::uint8_t> out) noexcept = 0;

  /// False when the packet could not be sent now; the next tick sends a newer one.
  virtual bool send(std::span<const std::uint8_t> packet) noexcept = 0;

  /// Sends at once, even if it is the device's turn.
  virtual bool send_now(std::span<const std::uint8_t> packet) noexcept { return send(packet); }

  /// Sends at once the last packet of a process that may end: if packets leave by another thread,
  /// it waits up to 20 ms until this one has left.
  virtual bool send_last(std::span<const std::uint8_t> packet) noexcept { return send(packet); }

  /// True once no packet of the device will come any more, because it ended the link or is gone.
  /// Packets may still be sent: a device that ended only its own side obeys them.
  [[nodiscard]] virtual bool closed() const noexcept = 0;

  /// Waits at most `milliseconds` for a packet, for lock-step runs and for calibration. Not real
  /// time.
  [[nodiscard]] virtual bool wait(int milliseconds) noexcept = 0;

  /// Counters of the link, for reports, while no servo runs. Allocates.
  [[nodiscard]] virtual std::vector<LinkCounter> counters() const { return {}; }
};

/// The device that a port searches for.
struct SoughtDevice {
  std::string_view name;
  std::string_view port;       ///< word of `--port`
  std::string_view emulation;  ///< options of ./kerf demo that emulate it
};

/// The text of all ports for a device that is not there: of the named node, of the device with the
/// named serial number, or of any device.
[[nodiscard]] inline std::string absent_node(const SoughtDevice& sought) {
  return "no such node; --port " + std::string(sought.port) + " finds the device by itself";
}
[[nodiscard]] inline std::string absent_device(const SoughtDevice& sought, bool serial_named) {
  return "no " + std::string(sought.name) + (serial_named ? " with this serial number" : "") +
         " is there; connect one, or try ./kerf demo " + std::string(sought.emulation);
}
/// Where `where`, as the user gave it, is a node, a serial number or nothing.
[[nodiscard]] inline std::string absent_text(const SoughtDevice& sought, std::string_view where) {
  if (where.find('/') != std::string_view::npos) return absent_node(sought);
  return absent_device(sought, !where.empty());
}

}  // namespace kerf
