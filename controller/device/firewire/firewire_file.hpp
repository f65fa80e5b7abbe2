// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <linux/firewire-cdev.h>

// A FireWire node (`/dev/fw*`): its ioctls and events, requests to the registers of the device and
// channels of the bus, and the search for a device.

namespace kerf {

/// One open of a FireWire node (`/dev/fw*`): its ioctls and its events, linux/firewire-cdev.h.
///
/// Every open has its own events, and at most one isochronous context. Nothing here throws,
/// allocates or sleeps, except `open` and a `ready` that may wait.
class FirewireFile {
 public:
  FirewireFile() = default;
  ~FirewireFile();
  FirewireFile(const FirewireFile&) = delete;
  FirewireFile& operator=(const FirewireFile&) = delete;

  /// Opens `path` and replaces the open file under the same descriptor, so that another thread
  /// never uses a closed or a foreign one. Returns 0 or an errno.
  [[nodiscard]] int open(const std::string& path) noexcept;

  /// Requests the state of the bus, and from now on its reset events; returns the generation, empty
  /// if the device is gone.
  [[nodiscard]] std::optional<std::uint32_t> link() noexcept;

  /// The result of ioctl(), or a negative errno. Any thread, any signal handler.
  int call(unsigned long command, void* argument) noexcept;

  /// Whether an event waits, or comes within the time. Call it before `read`, which would
  /// sleep otherwise: these nodes have no O_NONBLOCK.
  [[nodiscard]] bool ready(int milliseconds) noexcept;
  /// Reads the oldest event into `buffer`; empty if the device is gone.
  [[nodiscard]] std::span<const std::uint8_t> read(std::span<std::uint8_t> buffer) noexcept;

  /// True after the device was unplugged: every call fails from then on.
  [[nodiscard]] bool gone() const noexcept { return gone_.load(std::memory_order_relaxed); }

 private:
  void note(int error) noexcept;

  int fd_ = -1;
  std::atomic<bool> gone_{false};  ///< written by any thread that finds the end
};

/// Offset of the variable part of an event: the fixed part has padding behind it, so its size is
/// another.
inline constexpr std::size_t kResponseDataAt = offsetof(fw_cdev_event_response, data);
inline constexpr std::size_t kIsoHeadersAt = offsetof(fw_cdev_event_iso_interrupt, header);

inline constexpr int kFirewireAnswerMs = 50;  ///< a device answers sooner, or not at all

/// The fixed part of an event; missing bytes of a short one are zero.
template <class Event>
[[nodiscard]] Event event_as(std::span<const std::uint8_t> bytes) noexcept {
  Event event{};
  std::memcpy(&event, bytes.data(), std::min(sizeof event, bytes.size()));
  return event;
}

/// A channel and its bandwidth, requested or allocated.
struct FirewireClaim {
  std::uint32_t handle = 0;
  std::int32_t channel = -1;  ///< -1: not allocated
};

/// One open file of the device's node, for its registers and for the allocation of isochronous
/// channels.
///
/// Every request that the kernel accepts is answered by an event with its `closure`, also if the
/// device refuses it. A request made
/// in an older generation of the bus fails with RCODE_GENERATION. No function allocates, throws or
/// sleeps unless noted.
class FirewireRequests {
 public:
  [[nodiscard]] int open(const std::string& path) noexcept { return file_.open(path); }
  [[nodiscard]] bool gone() const noexcept { return file_.gone(); }
  [[nodiscard]] bool ready(int milliseconds) noexcept { return file_.ready(milliseconds); }
  /// The oldest event; valid until the next one.
  [[nodiscard]] std::span<const std::uint8_t> event() noexcept { return file_.read(event_); }

  [[nodiscard]] std::uint32_t generation() const noexcept { return generation_; }
  void set_generation(std::uint32_t generation) noexcept { generation_ = generation; }
  /// Requests the current generation, whose event may come half a second later. True if it has
  /// changed.
  bool refresh() noexcept;

  void write(std::uint64_t offset, std::span<const std::uint8_t> bytes,
             std::uint64_t closure) noexcept;
  void write(std::uint64_t offset, std::uint8_t byte, std::uint64_t closure) noexcept {
    write(offset, {&byte, 1}, closure);
  }
  /// Reads a register of one byte; sleeps for the answer, three times 50 ms at most. Other events
  /// are lost meanwhile.
  [[nodiscard]] std::optional<std::uint8_t> read_byte(std::uint64_t offset) noexcept;

  /// Any channel but 31, the broadcast channel, and the bandwidth of a packet of `payload_bytes` in
  /// each cycle. Empty if the request itself fails.
  [[nodiscard]] std::optional<FirewireClaim> claim(std::uint64_t closure,
                                                   std::size_t payload_bytes) noexcept;
  void give_back(const FirewireClaim& claim) noexcept;

 private:
  static constexpr std::size_t kEventBytes = 128;  // no requested answer is longer

  FirewireFile file_;
  std::uint32_t generation_ = 0;
  alignas(8) std::array<std::uint8_t, kEventBytes> event_{};
};

/// A SensAble device on FireWire, by its configuration ROM. The model is not in there: an Omni
/// looks like its siblings.
struct FirewireDevice {
  std::string path;          ///< of its node
  std::uint32_t packed = 0;  ///< low word of the GUID
  std::string serial;        ///< the digits on the unit, unpacked from it
};

/// Options of `--port fw[:WHERE][,OPTION...]`.
struct FirewireOptions {
  std::string where;  ///< a node, a folder of nodes, or a serial number; if empty, any one in /dev
  bool write_20010 =
      false;           ///< "20010": write 0xF80F0000 to that register before streaming. Two open
                       ///< drivers contradict each other: needed, or harmful with two devices
  bool fill = false;   ///< "fill": keep the transmit queue filled with skipped cycles, instead of
                       ///< letting it run dry, which costs a cycle less but is unproved on some
                       ///< controllers
  int rate_hz = 1000;  ///< how often packets will be sent
};

/// Reads `text`, the part after "fw". Throws std::runtime_error with one line.
[[nodiscard]] FirewireOptions parse_firewire_port(std::string_view text);

/// The serial number in its printed form; bit 0 has no meaning.
[[nodiscard]] std::string firewire_serial(std::uint32_t packed);

/// All devices of the vendor whose node can be opened. `refused` gets the errno of one that cannot.
[[nodiscard]] std::vector<FirewireDevice> list_firewire(const std::string& folder, int* refused);

/// The device of `options.where`; a serial number is searched in `folder`. Throws
/// std::runtime_error with one line if there is none, or more than one.
[[nodiscard]] FirewireDevice find_firewire(const FirewireOptions& options,
                                           const std::string& folder = "/dev");

}  // namespace kerf
