// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/open_port.hpp"
#include "shared/wire/omni.hpp"
#include "tests/device/fake_port.hpp"

using kerf::LinkHello;
using kerf::Personality;
using kerf::test::FakePort;

namespace {

const std::atomic<bool> kGoOn{false};
constexpr LinkHello kOurs{Personality::omni, true, 1000};

std::string refusal_of(FakePort& port, int patience_ms, const std::atomic<bool>& stop = kGoOn) {
  try {
    agree(port, "--port x", kOurs, true, patience_ms, stop);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("the hello goes first, and what the device said before the answer is dropped") {
  FakePort port;
  const auto early = encode(kerf::OmniReport{});
  port.push(early);
  port.push(std::vector<std::uint8_t>(64, 7));
  port.push(encode(kOurs));
  port.push(early);  // of the session
  CHECK(refusal_of(port, 5000) == "");
  REQUIRE(port.sent.size() == 1);
  CHECK(kerf::decode_hello(port.sent[0]) == kOurs);
  CHECK(port.incoming.size() == 1);
}

TEST_CASE("a partner that does not fit is refused with the place and both words") {
  FakePort port;
  port.push(encode(LinkHello{Personality::falcon, true, 1000}));
  CHECK(refusal_of(port, 5000).find("--port x: the controller wants a device omni") == 0);
}

TEST_CASE("an emulator that ends before it answers served another client: --stay is the way out") {
  FakePort port;
  port.gone = true;
  CHECK(refusal_of(port, 5000).find("--stay") != std::string::npos);
}

TEST_CASE("where nothing comes back a lossy link says it again, until patience or stop") {
  FakePort port;
  CHECK(refusal_of(port, 450).find("--port x: nobody answers the hello") == 0);
  CHECK(port.sent.size() >= 2);
  CHECK(port.sent.size() <= 3);  // each 0.2 s
  const std::atomic<bool> stop{true};
  CHECK(refusal_of(port, 60000, stop).find("nobody answers") != std::string::npos);
}
