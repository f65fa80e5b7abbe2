// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "shared/wire/falcon.hpp"

namespace kerf::falcon_framer_test {

using kerf::falcon::Framer;

namespace {

std::vector<kerf::falcon::PacketBytes> packets_in(Framer& framer,
                                                  const std::vector<std::uint8_t>& bytes) {
  std::vector<kerf::falcon::PacketBytes> found;
  for (const std::uint8_t byte : bytes) {
    if (framer.take(byte)) found.push_back(framer.packet());
  }
  return found;
}

}  // namespace

TEST_CASE("a framer finds whole packets between and after damaged ones, and counts the rest") {
  CHECK(rc::check([] {
    std::vector<std::uint8_t> stream;
    std::vector<kerf::falcon::PacketBytes> whole;
    std::size_t strays = 0;
    const int count = *rc::gen::inRange(1, 20);
    for (int i = 0; i < count; ++i) {
      auto packet = encode(
          kerf::FalconReport{.encoder = {*rc::gen::arbitrary<std::int16_t>(), 1, -1}, .homed = {}});
      const auto size =
          static_cast<std::size_t>(*rc::gen::oneOf(rc::gen::just(16), rc::gen::inRange(1, 16)));
      stream.insert(stream.end(), packet.begin(),
                    packet.begin() + static_cast<std::ptrdiff_t>(size));
      if (size == 16) {
        whole.push_back(packet);
      } else {
        strays += size;
      }
    }
    stream.push_back(kerf::falcon::kBegin);  // ends a damaged packet at the end
    Framer framer;
    RC_ASSERT(packets_in(framer, stream) == whole);
    RC_ASSERT(framer.strays() == strays);
  }));
}

TEST_CASE("sixteen bytes that do not end as a packet are none") {
  auto packet = encode(kerf::FalconReport{});
  packet[15] = 'A';
  Framer framer;
  CHECK(packets_in(framer, {packet.begin(), packet.end()}).empty());
  CHECK(framer.strays() == 16);
}

}  // namespace kerf::falcon_framer_test
