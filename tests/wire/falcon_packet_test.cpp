// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/falcon.hpp"

namespace kerf::falcon_packet_test {
namespace {

using kerf::falcon::PacketBytes;

constexpr PacketBytes bytes_of(std::string_view text) {
  PacketBytes bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(text[i]);
  return bytes;
}

constexpr FalconCommand kHomingGreen{{0, 0, 0}, true, true, false, false};
constexpr FalconCommand kThreeMotors{{1000, -1000, 4095}, false, false, false, false};
constexpr FalconReport kHomedCentre{
    {512, -3, -512}, kerf::falcon::kButtonCentre, {true, true, true}};
constexpr PacketBytes kHomedCentreBytes{0x3C, 0x41, 0x41, 0x43, 0x41, 0x4E, 0x50, 0x50,
                                        0x50, 0x41, 0x41, 0x4F, 0x50, 0xB5, 0x41, 0x3E};

// The golden vectors hold at compile time, in both directions.
static_assert(encode(kHomingGreen) == bytes_of("<AAAAAAAAAAAADA>"));
static_assert(encode(kThreeMotors) == bytes_of("<IODAIBMPPPPAAA>"));
static_assert(encode(kHomedCentre) == kHomedCentreBytes);
static_assert(kerf::falcon::decode_command(bytes_of("<AAAAAAAAAAAADA>")) == kHomingGreen);
static_assert(kerf::falcon::decode_command(bytes_of("<IODAIBMPPPPAAA>")) == kThreeMotors);
static_assert(kerf::falcon::decode_report(kHomedCentreBytes) == kHomedCentre);

}  // namespace

TEST_CASE("each button, light and homed axis has its bit") {
  const auto info = [](const auto& packet) { return encode(packet)[13] - 0x41; };
  CHECK(info(FalconCommand{{}, true, false, false, false}) == 1);
  CHECK(info(FalconCommand{{}, false, true, false, false}) == 2);
  CHECK(info(FalconCommand{{}, false, false, true, false}) == 4);
  CHECK(info(FalconCommand{{}, false, false, false, true}) == 8);
  CHECK(info(FalconReport{{}, kerf::falcon::kButtonPlus, {}}) == 1);
  CHECK(info(FalconReport{{}, kerf::falcon::kButtonMinus, {}}) == 8);
  CHECK(info(FalconReport{{}, 0, {true, false, false}}) == 16);
  CHECK(info(FalconReport{{}, 0, {false, false, true}}) == 64);
}

TEST_CASE("any Falcon report survives the wire") {
  CHECK(rc::check([](std::array<std::int16_t, 3> encoder, std::array<bool, 3> homed) {
    const auto buttons = static_cast<std::uint8_t>(*rc::gen::inRange(0, 16));
    const FalconReport report{encoder, buttons, homed};
    RC_ASSERT(kerf::falcon::decode_report(encode(report)) == report);
  }));
}

TEST_CASE("any Falcon command survives the wire, its motors saturated") {
  CHECK(rc::check(
      [](std::array<std::int16_t, 3> motor, bool homing, bool green, bool blue, bool red) {
        FalconCommand command{motor, homing, green, blue, red};
        const auto back = kerf::falcon::decode_command(encode(command));
        for (auto& count : command.motor) {
          count = std::clamp<std::int16_t>(count, -4096, 4096);
        }
        RC_ASSERT(back == command);
      }));
}

TEST_CASE("what is no Falcon packet is refused, byte by byte") {
  const PacketBytes command = encode(kThreeMotors);
  const PacketBytes report = encode(kHomedCentre);
  for (std::size_t at = 0; at < command.size(); ++at) {
    for (unsigned value = 0; value < 256; ++value) {
      CAPTURE(at);
      CAPTURE(value);
      auto other = command;
      other[at] = static_cast<std::uint8_t>(value);
      auto answer = report;
      answer[at] = other[at];
      const bool letter = value >= 'A' && value <= (at == 14 ? 'A' : 'P');  // 14: the spare
      const bool frame = at == 0 ? value == '<' : value == '>';
      const bool inside = at > 0 && at < 15;
      CHECK(kerf::falcon::decode_command(other).has_value() == (inside ? letter : frame));
      const bool info = at == 13 && value >= 0x41 && value <= 0x41 + 0x7F;
      CHECK(kerf::falcon::decode_report(answer).has_value() == (inside ? letter || info : frame));
    }
  }
  std::array<std::uint8_t, 32> longer{};
  std::copy(command.begin(), command.end(), longer.begin());
  std::copy(command.begin(), command.end(), longer.begin() + 16);
  for (std::size_t size = 0; size <= longer.size(); ++size) {
    const std::span<const std::uint8_t> part(longer.data(), size);
    CHECK(kerf::falcon::decode_command(part).has_value() == (size == 16));
    CHECK(kerf::falcon::decode_report(part).has_value() == (size == 16));
  }
}

TEST_CASE("the Falcon's count is 0.036435 degrees of a thigh") {
  CHECK(kerf::falcon::kRadPerCount / kerf::falcon::kRadPerDegree ==
        doctest::Approx(0.036435).epsilon(1e-5));
}

}  // namespace kerf::falcon_packet_test
