// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/woodenhaptics.hpp"

namespace kerf::wooden_packet_test {
namespace {

using Short = std::array<std::uint8_t, kerf::wooden::kPacketBytes>;

constexpr Short first_14(const kerf::wooden::PacketBytes& bytes) {
  Short first{};
  for (std::size_t i = 0; i < first.size(); ++i) first[i] = bytes[i];
  return first;
}

constexpr WoodenReport kReport{{1, -1, 2000, 0, 30, 0}, false};
constexpr Short kReportBytes{0x01, 0x00, 0xFF, 0xFF, 0xD0, 0x07, 0, 0, 0x1E, 0, 0, 0, 0, 0};
constexpr WoodenCommand kCurrents{{500, -500, 0}, std::nullopt};
constexpr Short kCurrentBytes{0xF4, 0x01, 0x0C, 0xFE, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
constexpr WoodenCommand kSetHome{{}, std::array<std::int16_t, 6>{0, 0, 6000, 1, -2, 3}};
constexpr Short kSetHomeBytes{1, 0, 0xFE, 0xFF, 3, 0, 1, 0, 0, 0, 0, 0, 0x70, 0x17};

// The golden vectors hold at compile time, in both directions.
static_assert(first_14(encode(kReport)) == kReportBytes);
static_assert(first_14(encode(kCurrents)) == kCurrentBytes);
static_assert(first_14(encode(kSetHome)) == kSetHomeBytes);
static_assert(kerf::wooden::decode_report(kReportBytes) == kReport);
static_assert(kerf::wooden::decode_command(kCurrentBytes)->milliamps == kCurrents.milliamps);
static_assert(kerf::wooden::decode_command(kSetHomeBytes)->set_encoders == kSetHome.set_encoders);
static_assert(kerf::wooden::kReportId == 0);

}  // namespace

TEST_CASE("any WoodenHaptics report survives the wire in both lengths") {
  CHECK(rc::check([](std::array<std::int16_t, 6> encoder, bool calibrate) {
    const WoodenReport report{encoder, calibrate};
    const auto bytes = encode(report);
    RC_ASSERT(kerf::wooden::decode_report(bytes) == report);
    RC_ASSERT(kerf::wooden::decode_report(first_14(bytes)) == report);
  }));
}

TEST_CASE("currents are capped at 2 A, and setting encoders sends no current") {
  CHECK(rc::check([](std::array<std::int16_t, 3> milliamps) {
    const auto bytes = encode(WoodenCommand{milliamps, std::nullopt});
    for (auto& current : milliamps) {
      current = std::clamp<std::int16_t>(current, -2000, 2000);
    }
    const WoodenCommand capped{milliamps, std::nullopt};
    RC_ASSERT(kerf::wooden::decode_command(bytes) == capped);
  }));
  CHECK(rc::check([](std::array<std::int16_t, 6> counts) {
    const WoodenCommand without_current{{}, counts};
    const auto back = kerf::wooden::decode_command(encode(WoodenCommand{{1, 2, 3}, counts}));
    RC_ASSERT(back == without_current);
  }));
}

TEST_CASE("only 14 or 64 bytes are a WoodenHaptics packet, and only commands 0 and 1 one") {
  std::array<std::uint8_t, 80> bytes{};
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    const std::span<const std::uint8_t> part(bytes.data(), size);
    CHECK(kerf::wooden::decode_report(part).has_value() == (size == 14 || size == 64));
    CHECK(kerf::wooden::decode_command(part).has_value() == (size == 14 || size == 64));
  }
  for (int kind = 0; kind < 65536; ++kind) {
    auto packet = kCurrentBytes;
    packet[6] = static_cast<std::uint8_t>(kind & 0xFF);
    packet[7] = static_cast<std::uint8_t>(kind >> 8);
    CHECK(kerf::wooden::decode_command(packet).has_value() == (kind < 2));
    auto report = kReportBytes;
    report[12] = packet[6];
    report[13] = packet[7];
    CHECK(kerf::wooden::decode_report(report).has_value() == (kind < 2));
  }
}

TEST_CASE("the wireless button stands on encoder d") {
  using kerf::wooden::wireless_button;
  for (const std::int16_t d : std::array<std::int16_t, 5>{-4999, -1, 0, 1, 5000}) {
    CHECK_FALSE(wireless_button(d));
    CHECK(wireless_button(static_cast<std::int16_t>(d + 10000)));
  }
}

}  // namespace kerf::wooden_packet_test
