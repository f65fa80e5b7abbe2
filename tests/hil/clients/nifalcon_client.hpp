// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "shared/wire/falcon.hpp"

struct libusb_context;
struct libusb_device_handle;
struct libusb_transfer;

namespace kerf::test {

/// A Falcon's host that asks as libnifalcon does, with none of its code: the same requests in the
/// same order through the same calls of libusb, with buffers of the same sizes. What sets it apart
/// from `UsbPort`: a read is asked for with every write and outlives the question, so one is under
/// way while firmware is loaded and when the device is closed; a greeting is sent again until the
/// answer comes alone in one packet; the last answers are read into 3 bytes. One thread.
class NifalconClient {
 public:
  /// Opens, claims, and turns to the settings of packets. `node`: an open device node; -1: the
  /// first Falcon of libusb's list. Throws std::runtime_error with the call that failed.
  explicit NifalconClient(int node = -1);
  /// Gives the interface up, cancels the read that is under way, closes.
  ~NifalconClient();
  NifalconClient(const NifalconClient&) = delete;
  NifalconClient& operator=(const NifalconClient&) = delete;

  /// isFirmwareLoaded(): ten questions, each with a hundred looks for an answer.
  [[nodiscard]] bool firmware_answers();
  /// One loadFirmware(); returns the call that failed, empty if it worked.
  [[nodiscard]] std::string load(std::span<const std::uint8_t> firmware);
  /// runIOLoop() until a report has come, at most so many times (of 0.1 ms and more).
  [[nodiscard]] std::optional<FalconReport> exchange(const FalconCommand& command,
                                                     int looks = 5000);

  /// A read was asked for, and has not ended.
  [[nodiscard]] bool reads() const noexcept { return reading_; }

 private:
  void open_first();
  void control(falcon::FtdiRequest request, std::uint16_t value);
  void purge();
  void turn_to_packets();
  void turn_to_boot_loader();
  [[nodiscard]] bool greeted();
  [[nodiscard]] std::size_t write(std::span<const std::uint8_t> bytes);
  /// The line's bytes of one packet, read into `room` bytes beside the chip's own two.
  [[nodiscard]] std::span<const std::uint8_t> read(std::size_t room);
  void ask_to_read();
  [[nodiscard]] std::optional<FalconReport> look(const FalconCommand& command);
  void handle_events();
  static void read_ended(libusb_transfer* transfer);

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  libusb_transfer* transfer_ = nullptr;
  std::array<std::uint8_t, falcon::kFtdiPacketBytes> in_{};  ///< of the read under way
  std::array<std::uint8_t, 512> packet_{};                   ///< of reads that are waited for
  bool reading_ = false;
  bool came_ = false;     ///< it has ended with a packet, which was not read yet
  std::size_t size_ = 0;  ///< of the line's bytes in it
  bool asked_ = false;    ///< a question is out
};

}  // namespace kerf::test
