// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "controller/device/inverse3/messages.hpp"
#include "controller/device/inverse3/session.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/front/inverse3/service_device.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf::faults {

/// An Inverse3 behind the emulated service of its vendor, as the servo's driver sees it by `--port
/// ws`: each command goes as JSON to the service, and each reply comes back through the driver's
/// own parser and `Session`. Only the sockets and the thread of `ServicePort` are left out; its
/// game of turns is played here in virtual time, so that the same arguments give the same bits.
///
/// A message is under way until its reply is there or 100 ms are over; then the connection is given
/// up and made anew after 0.5, 1, 2 ... 10 s. One thread; allocates.
class ServiceLink final : public PacketDevice {
 public:
  /// `device` answers each command with one report (`CartesianParams::on_request`), and outlives
  /// this.
  explicit ServiceLink(PacketDevice& device);

  /// A `CartesianCommand`: the next message has it.
  void receive(std::span<const std::uint8_t> packet) noexcept override;
  void advance(int cycles) noexcept override;
  /// A `CartesianReport`.
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;

  [[nodiscard]] std::uint64_t turns() const noexcept { return turns_; }

 private:
  [[nodiscard]] std::int64_t now_ns() const noexcept;
  void connect();
  void cycle();
  void play_turn();
  void await_reply();
  void take(const ServiceMessage& reply);
  void pass_on(const CartesianReport& report);
  void drop();

  ServiceDevice service_;
  std::optional<inverse3::Session> session_;
  inverse3::ServiceState state_;
  std::int64_t cycle_ = 0;
  CartesianCommand command_;
  std::int64_t command_ns_ = 0, sent_ns_ = 0, retry_ns_ = 0, backoff_ns_ = 0;
  bool has_news_ = false;    ///< a command that no message had yet
  bool is_waiting_ = false;  ///< for a reply
  bool takes_back_ = false;  ///< the next turn is without force
  bool is_late_ = false;     ///< this reply is
  int unread_ = 0;           ///< replies in a row that could not be read
  std::uint32_t number_ = 0;
  std::uint64_t turns_ = 0;
  std::deque<cartesian::ReportBytes> reports_;
  cartesian::ReportBytes handed_out_{};
};

}  // namespace kerf::faults
