// SPDX-License-Identifier: Apache-2.0
// Every packet decoder, of device and host, hello too, and every driver behind it; the Falcon's
// serial line and the events of FireWire, in which packets come. The input is a sequence of
// packets, each after one byte that says its length, or one stream, or one event.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_streams.hpp"
#include "shared/wire/emulator_link.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace {

using Bytes = std::span<const std::uint8_t>;

void require(bool holds) {
  if (!holds) std::abort();
}

/// What was understood is understood the same way again; a command loses what its encoder caps.
template <class Decode>
void round_trip(Bytes packet, Decode decode) {
  const auto first = decode(packet);
  if (!first) return;
  const auto again = decode(encode(*first));
  require(again.has_value());
  require(decode(encode(*again)) == again);
}

/// A bus that holds one packet, and looks at what the driver says.
class OnePacketPort final : public kerf::PacketPort {
 public:
  explicit OnePacketPort(bool (*neutral)(Bytes)) : neutral_(neutral) {}
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    const std::size_t size = waiting.size();
    std::copy_n(waiting.begin(), std::min(size, out.size()), out.begin());
    waiting = {};
    return size;
  }
  bool send(Bytes packet) noexcept override {
    require(neutral_(packet));
    return true;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }

  Bytes waiting;

 private:
  bool (*neutral_)(Bytes);
};

constexpr std::array<std::int16_t, 3> kNoTorque{};

bool omni_is_neutral(Bytes packet) {
  const auto said = kerf::decode_command(packet);
  return said && said->motor == kNoTorque && !said->motors_on;
}
bool falcon_is_neutral(Bytes packet) {
  const auto said = kerf::falcon::decode_command(packet);
  return said && said->motor == kNoTorque;
}
bool wooden_is_neutral(Bytes packet) {
  const auto said = kerf::wooden::decode_command(packet);
  return said && (said->set_encoders || said->milliamps == kNoTorque);
}

/// Whatever the device says: with motors off, no packet of the driver asks for torque.
template <class Driver>
void drive(Bytes input, bool (*neutral)(Bytes)) {
  OnePacketPort port(neutral);
  Driver driver(port);
  driver.start();
  while (!input.empty()) {
    const std::size_t size = std::min<std::size_t>(input[0], input.size() - 1);
    port.waiting = input.subspan(1, size);
    input = input.subspan(1 + size);
    static_cast<void>(driver.read());
    kerf::ServoOutput output;
    output.dac_counts = {1000, -1000, 4000};  // which `motors_on` does not allow
    driver.command(output);
    driver.release();
  }
}

/// Every byte of the line is of a packet, a stray, or of the packet that is not whole yet.
void frame(Bytes line) {
  kerf::falcon::Framer framer;
  std::size_t packets = 0;
  for (const std::uint8_t byte : line) packets += framer.take(byte) ? 1 : 0;
  const std::size_t told = packets * kerf::falcon::kPacketBytes + framer.strays();
  require(told <= line.size() && line.size() - told < kerf::falcon::kPacketBytes);
}

/// However the kernel's headers lie, a packet is within its event, and none comes for ever.
void take_events(Bytes event) {
  kerf::FirewireFile closed;
  kerf::FirewireReceiver receiver;
  receiver.take(event);
  std::size_t packets = 0;
  for (auto packet = receiver.next(); packet.size > 0; packet = receiver.next()) {
    require(++packets * packet.bytes.size() <= event.size());
    require(packet.bytes.size() <= kerf::omni::kReportBytes);
    require(receiver.newest_cycle() >= 0 && receiver.newest_cycle() < 64'000);
  }
  receiver.turn(closed);
  kerf::FirewireTransmitter transmitter;
  transmitter.take(event);
  const int skips = transmitter.wanted_skips(receiver.newest_cycle(), 8);
  require(skips >= 0 && skips <= 16);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input{data, size};
  if (!input.empty()) {
    const Bytes packet = input.subspan(1);
    round_trip(packet, [](Bytes b) { return kerf::decode_report(b); });
    round_trip(packet, [](Bytes b) { return kerf::decode_command(b); });
    round_trip(packet, [](Bytes b) { return kerf::falcon::decode_report(b); });
    round_trip(packet, [](Bytes b) { return kerf::falcon::decode_command(b); });
    round_trip(packet, [](Bytes b) { return kerf::wooden::decode_report(b); });
    round_trip(packet, [](Bytes b) { return kerf::wooden::decode_command(b); });
    round_trip(packet, [](Bytes b) { return kerf::decode_hello(b); });
  }
  frame(input);
  take_events(input);
  drive<kerf::OmniDriver>(input, omni_is_neutral);
  drive<kerf::FalconDriver>(input, falcon_is_neutral);
  drive<kerf::WoodenDriver>(input, wooden_is_neutral);
  return 0;
}
