// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/omni.hpp"
#include "tests/wire/hex.hpp"

namespace kerf::omni_packet_test {
namespace {

using kerf::test::Bytes;
using kerf::test::from_hex;

template <class Packet>
Bytes bytes_of(const Packet& packet) {
  const auto bytes = kerf::encode(packet);
  return {bytes.begin(), bytes.end()};
}

const char* const kDockedReport =
    "00001e00 6400 38ff 2c01 0080 0080 0080 0000 00 03 0710 0080 0080 0080 4657 0000 01000000 "
    "0000 0000 00000000";

OmniReport docked_report() {
  return {.encoder = {100, -200, 300},
          .pot_a = {0x8000, 0x8000, 0x8000},
          .pot_b = {0x8000, 0x8000, 0x8000},
          .docked = true,
          .counter = 1};
}

}  // namespace

TEST_CASE("a command has the golden bytes and reads back") {
  struct Golden {
    OmniCommand command;
    const char* bytes;
  };
  const std::array<Golden, 4> golden{{
      {{{0, 0, 0}, false, OmniCommand::Light::fast_flash}, "ff07 ff07 ff07 c253 00000000 00000000"},
      {{{0, 0, 0}, true, OmniCommand::Light::steady}, "ff07 ff07 ff07 cb53 00000000 00000000"},
      {{{0x500 - 0x7FF, 0, 0}, true, OmniCommand::Light::slow_flash},
       "0005 ff07 ff07 c953 00000000 00000000"},
      {{{-2047, 2048, 1}, false, OmniCommand::Light::off}, "0000 ff0f 0008 c053 00000000 00000000"},
  }};
  for (const auto& [command, text] : golden) {
    CAPTURE(text);
    CHECK(bytes_of(command) == from_hex(text));
    CHECK(kerf::decode_command(from_hex(text)) == command);
  }
}

TEST_CASE("a report has the golden bytes and reads back") {
  CHECK(bytes_of(docked_report()) == from_hex(kDockedReport));
  CHECK(kerf::decode_report(from_hex(kDockedReport)) == docked_report());
}

TEST_CASE("a cleared status bit means pressed or docked") {
  Bytes bytes = from_hex(kDockedReport);
  for (unsigned status = 0; status < 8; ++status) {
    bytes[19] = static_cast<std::uint8_t>(status);
    const auto report = kerf::decode_report(bytes);
    REQUIRE(report);
    CHECK(report->button1 == ((status & 1) == 0));
    CHECK(report->button2 == ((status & 2) == 0));
    CHECK(report->docked == ((status & 4) == 0));
  }
}

TEST_CASE("any report survives the wire") {
  CHECK(rc::check([](std::array<std::int16_t, 3> encoder, std::array<std::uint16_t, 3> a,
                     std::array<std::uint16_t, 3> b, bool button1, bool button2, bool docked,
                     std::uint32_t counter) {
    const OmniReport report{encoder, a, b, button1, button2, docked, counter};
    RC_ASSERT(kerf::decode_report(kerf::encode(report)) == report);
  }));
}

TEST_CASE("any command survives the wire, its motors saturated to 12 bits") {
  CHECK(rc::check([](std::array<std::int16_t, 3> motor, bool on) {
    const auto light = static_cast<OmniCommand::Light>(*rc::gen::inRange(0, 4));
    OmniCommand command{motor, on, light};
    const auto back = kerf::decode_command(kerf::encode(command));
    for (auto& count : command.motor) {
      count = std::min<std::int16_t>(std::max<std::int16_t>(count, -2047), 2048);
    }
    RC_ASSERT(back == command);
  }));
}

TEST_CASE("a report with another constant word is refused, other bytes do not matter") {
  for (std::size_t at = 0; at < kerf::omni::kReportBytes; ++at) {
    for (const unsigned bit : {0x01u, 0x80u}) {
      Bytes bytes = from_hex(kDockedReport);
      bytes[at] ^= static_cast<std::uint8_t>(bit);
      const bool constant = at < 4 || at == 20 || at == 21 || at == 28 || at == 29;
      CAPTURE(at);
      CHECK(kerf::decode_report(bytes).has_value() == !constant);
    }
  }
  CHECK_FALSE(kerf::decode_report(Bytes(44)));
}

TEST_CASE("packets of another length are refused") {
  for (std::size_t size = 0; size <= 64; ++size) {
    Bytes report = from_hex(kDockedReport);
    Bytes command = bytes_of(OmniCommand{});
    report.resize(size);
    command.resize(size);
    CHECK(kerf::decode_report(report).has_value() == (size == kerf::omni::kReportBytes));
    if (size != kerf::omni::kCommandBytes) CHECK_FALSE(kerf::decode_command(command));
  }
}

TEST_CASE("16 bytes that are no command are refused") {
  const Bytes good = bytes_of(OmniCommand{{1, 2, 3}, true, OmniCommand::Light::steady});
  REQUIRE(kerf::decode_command(good));
  for (const std::size_t motor_high_byte : {1u, 3u, 5u}) {
    Bytes bad = good;
    bad[motor_high_byte] |= 0x10;  // a 13th bit
    CHECK_FALSE(kerf::decode_command(bad));
  }
  for (unsigned bit = 0; bit < 16; ++bit) {
    Bytes other = good;
    other[6 + bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    const bool has_meaning = bit == 0 || bit == 1 || bit == 3;
    CHECK(kerf::decode_command(other).has_value() == has_meaning);
  }
  for (std::size_t tail = 8; tail < 16; ++tail) {
    Bytes bad = good;
    bad[tail] = 1;
    CHECK_FALSE(kerf::decode_command(bad));
  }
}

}  // namespace kerf::omni_packet_test
