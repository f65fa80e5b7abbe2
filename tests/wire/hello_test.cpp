// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/emulator_link.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::hello_test {
namespace {

constexpr LinkHello kOmni{Personality::omni, false, 1000};

/// One line that names the way out.
bool is_told(const std::string& line) {
  return line.find("; start ") != std::string::npos && line.find('\n') == std::string::npos;
}

}  // namespace

TEST_CASE("a hello comes back, and any other byte makes it none or another one") {
  CHECK(rc::check([] {
    const LinkHello hello{
        static_cast<Personality>(*rc::gen::inRange<int>(0, kerf::kPersonalityWords.size())),
        *rc::gen::arbitrary<bool>(), *rc::gen::inRange(0, 8001)};
    auto bytes = encode(hello);
    RC_ASSERT(decode_hello(bytes) == hello);
    bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] ^=
        static_cast<std::uint8_t>(*rc::gen::inRange(1, 256));
    RC_ASSERT(decode_hello(bytes) != hello);
  }));
  auto bytes = encode(kOmni);
  for (const std::size_t at : {8U, 9U, 10U, 15U, 19U}) {
    auto broken = bytes;
    broken[at] = kerf::kPersonalityWords.size();  // no such device, no such word
    CHECK_FALSE(decode_hello(broken).has_value());
  }
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CHECK_FALSE(decode_hello(std::span(bytes).first(size)).has_value());
  }
}

TEST_CASE("no packet of a device or for one is a hello") {
  using kerf::kHelloBytes;
  CHECK(kHelloBytes != kerf::omni::kCommandBytes);
  CHECK(kHelloBytes != kerf::omni::kReportBytes);
  CHECK(kHelloBytes != kerf::falcon::kPacketBytes);
  CHECK(kHelloBytes != kerf::wooden::kPacketBytes);
  CHECK(kHelloBytes != kerf::wooden::kLongPacketBytes);
}

TEST_CASE("what two sides differ in is told with both, and what to start instead") {
  CHECK(discord(kOmni, kOmni).empty());
  CHECK(discord(kOmni, {Personality::omni, false, 2000}).empty());  // each keeps its own clock
  const LinkHello locked{Personality::omni, true, 1000};
  CHECK(discord(locked, locked).empty());

  const std::string device = discord(kOmni, {Personality::falcon, true, 500});
  CHECK(is_told(device));
  CHECK(device.find("wants a device omni, the emulator is falcon; start kerf-emulator with "
                    "--personality omni, or kerf-controller with --device falcon") !=
        std::string::npos);
  CHECK(is_told(discord(kOmni, locked)));
  CHECK(discord(kOmni, locked).find("kerf-controller with --virtual") != std::string::npos);
  CHECK(is_told(discord(locked, kOmni)));
  CHECK(discord(locked, kOmni).find("--lockstep --rate 1000") != std::string::npos);
  const std::string rate = discord(locked, {Personality::omni, true, 2000});
  CHECK(is_told(rate));
  CHECK(rate.find("1000 Hz in the controller, at 2000 Hz in the emulator") != std::string::npos);
}

}  // namespace kerf::hello_test
