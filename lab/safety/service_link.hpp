// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "arm/inverse3/turn_game.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/front/inverse3/service_device.hpp"
#include "hil/script/faulty_device.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf::faults {

/// An Inverse3 behind the emulated service of its vendor, as the servo's driver sees it by
/// kerf-arm: each command goes as JSON to the service, and each reply comes back through the
/// driver's own parser, `Session` and `TurnGame`. Only the sockets and the thread of `ServiceArm`
/// are left out, so that the same arguments give the same bits.
///
/// A message is under way until its reply is there or 100 ms are over; then the connection is given
/// up, with its last word if the link still carries one, and made anew at once, then after 0.5, 1,
/// 2
/// ... 10 s. One thread; allocates.
class ServiceLink final : public PacketDevice {
 public:
  /// `device` answers each command with one report (`CartesianParams::on_request`), and outlives
  /// this. `seed`: of the way in which replies cannot be read.
  ServiceLink(FaultyDevice& device, std::uint32_t seed);

  /// A `CartesianCommand`: the next message has it.
  void receive(std::span<const std::uint8_t> packet) noexcept override;
  void advance(int cycles) noexcept override;
  /// A `CartesianReport`.
  [[nodiscard]] std::span<const std::uint8_t> next_packet() noexcept override;

  [[nodiscard]] std::uint64_t turns() const noexcept { return turns_; }
  /// A fault of the service has begun that ends its connection, in the last call of `advance`.
  [[nodiscard]] bool has_failed() const noexcept { return has_failed_; }
  /// A connection that could still carry a message has ended with a force, in the last call of
  /// `advance`. The next connection takes it back so soon that the motors alone would not show it.
  [[nodiscard]] bool has_left_pushing() const noexcept { return has_left_pushing_; }

 private:
  [[nodiscard]] std::int64_t now_ns() const noexcept;
  void begin_faults();
  void connect();
  void cycle();
  void play_turn();
  void await_reply();
  void take(const ServiceMessage& reply);
  void pass_on(const CartesianReport& report);
  void drop(bool carries_a_word);

  FaultyDevice& device_;
  ServiceDevice service_;
  std::optional<inverse3::TurnGame> game_;
  inverse3::ShortText device_id_;  ///< once known
  std::int64_t cycle_ = 0;
  CartesianCommand command_;
  std::int64_t command_ns_ = 0, sent_ns_ = 0, began_ns_ = 0, retry_ns_ = 0, backoff_ns_ = 0;
  bool has_news_ = false;    ///< a command that no message had yet
  bool is_waiting_ = false;  ///< for a reply
  bool owes_word_ = false;   ///< the last one of a connection that is given up
  bool has_failed_ = false, has_left_pushing_ = false;
  std::uint32_t number_ = 0;
  std::uint64_t turns_ = 0;
  std::deque<cartesian::ReportBytes> reports_;
  cartesian::ReportBytes handed_out_{};
};

}  // namespace kerf::faults
