// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/cartesian.hpp"
#include "tests/wire/hex.hpp"

namespace kerf::cartesian_packet_test {
namespace {

using kerf::test::Bytes;
using kerf::test::from_hex;

template <class Packet>
Bytes bytes_of(const Packet& packet) {
  const auto bytes = kerf::encode(packet);
  return {bytes.begin(), bytes.end()};
}

CartesianReport some_report() {
  CartesianReport report;
  report.number = 0x01020304;
  report.position_um = {1000, -2, cartesian::kFarthestUm};
  report.orientation = {0, 0, 32767, 0};
  report.force_mn = {1, -1, 32767};
  report.button2 = report.parked = report.powered = true;
  report.age_us = 250;
  return report;
}

constexpr const char* kReport =
    "6b637231 04030201 e8030000 feffffff 40420f00 0000 0000 ff7f 0000 0100 ffff ff7f 02 05 "
    "fa000000";

}  // namespace

TEST_CASE("a Cartesian report and command have the golden bytes and read back") {
  CHECK(bytes_of(some_report()) == from_hex(kReport));
  CHECK(kerf::decode_cartesian_report(from_hex(kReport)) == some_report());
  CartesianCommand command;
  command.force_mn = {1500, -1500, -32768};
  command.force_on = true;
  command.light = CartesianCommand::Light::fault;
  command.answers = 9;
  const auto bytes = from_hex("6b636331 dc05 24fa 0080 01 02 09000000");
  CHECK(bytes_of(command) == bytes);
  CHECK(kerf::decode_cartesian_command(bytes) == command);
}

TEST_CASE("bytes that are no Cartesian packet are refused, each for its own reason") {
  const Bytes good = from_hex(kReport);
  const auto broken = [&](std::size_t at, std::uint8_t value) {
    Bytes bytes = good;
    bytes[at] = value;
    return kerf::decode_cartesian_report(bytes).has_value();
  };
  CHECK(broken(35, 7));
  CHECK_FALSE(broken(0, 0));      // mark
  CHECK_FALSE(broken(3, 0x32));   // version
  CHECK_FALSE(broken(16, 0x41));  // 1 um too far
  CHECK_FALSE(broken(25, 0x7d));  // the orientation is too short by 3 % of its square
  CHECK_FALSE(broken(34, 4));     // a third button
  CHECK_FALSE(broken(35, 8));     // an unknown state
  Bytes shorter(good.begin(), good.end() - 1), longer = good;
  longer.push_back(0);
  CHECK_FALSE(kerf::decode_cartesian_report(shorter));
  CHECK_FALSE(kerf::decode_cartesian_report(longer));
  CHECK_FALSE(kerf::decode_cartesian_report({}));
  for (const std::size_t at : {0U, 10U, 11U}) {
    Bytes command = from_hex("6b636331 0000 0000 0000 00 00 00000000");
    command[at] = 0xff;
    CHECK_FALSE(kerf::decode_cartesian_command(command));
  }
}

TEST_CASE("what no packet can hold is refused, and a force is never more than the range") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  CHECK(cartesian::packed_mm(-999.9996) == -1'000'000);
  CHECK(cartesian::packed_mm(0.0004) == 0);
  for (const double mm : {kNan, kInf, -kInf, 1e308, 1000.001, -1000.001}) {
    CHECK_FALSE(cartesian::packed_mm(mm));
  }
  CHECK(cartesian::packed_n(1.2345) == 1235);
  CHECK(cartesian::packed_n(kNan) == 0);
  CHECK(cartesian::packed_n(kInf) == 32767);
  CHECK(cartesian::packed_n(-1e308) == -32767);
  CHECK(cartesian::packed_orientation({0, 0, 0, -5}) ==
        std::array<std::int16_t, 4>{0, 0, 0, -32767});
  for (const double part : {kNan, kInf, 0.0, 1e-7}) {
    CHECK_FALSE(cartesian::packed_orientation({0, 0, 0, part}));
  }
}

TEST_CASE("every orientation that is packed is read again, within half a step of each part") {
  CHECK(rc::check([] {
    const auto part = [] { return *rc::gen::inRange(-1000, 1001) / 1000.0; };
    const std::array<double, 4> q{part(), part(), part(), part()};
    const auto packed = cartesian::packed_orientation(q);
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    RC_PRE(length > 0.01);
    RC_ASSERT(packed.has_value());
    CartesianReport report;
    report.orientation = *packed;
    RC_ASSERT(kerf::decode_cartesian_report(kerf::encode(report)) == report);
    for (std::size_t i = 0; i < 4; ++i) {
      RC_ASSERT(std::abs((*packed)[i] - q[i] / length * cartesian::kQuaternionOne) <= 0.5001);
    }
  }));
}

}  // namespace kerf::cartesian_packet_test
