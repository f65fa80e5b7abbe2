// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "controller/device/port/socket_port.hpp"
#include "hil/front/socket_servers.hpp"

namespace {

const std::atomic<bool> kGoOn{false};

}  // namespace

TEST_CASE("over UDP packets keep their borders both ways, and the end shows on both sides") {
  kerf::UdpServer server("0");
  std::optional<kerf::UdpPort> port;
  port.emplace(std::to_string(server.port()), 0, kGoOn);
  auto link = server.accept(kGoOn);  // greeted
  REQUIRE(link.has_value());

  std::array<std::uint8_t, 64> buffer{};
  CHECK(port->receive(buffer) == 0);
  CHECK_FALSE(port->closed());
  CHECK(link->send(std::array<std::uint8_t, 3>{1, 2, 3}) == kerf::PacketLink::Sent::yes);
  CHECK(link->send(std::array<std::uint8_t, 2>{4, 5}) == kerf::PacketLink::Sent::yes);
  CHECK(port->wait(1000));
  CHECK(port->receive(buffer) == 3);
  CHECK(port->receive(buffer) == 2);
  CHECK(buffer[0] == 4);
  CHECK(port->send(std::array<std::uint8_t, 2>{7, 8}));
  CHECK(link->wait(buffer, 1000).size() == 2);

  SUBCASE("a port that goes says goodbye") {
    port.reset();
    CHECK(link->wait(buffer, 1000).empty());
    CHECK(link->closed());
  }
  SUBCASE("an empty datagram is the device's goodbye") {
    CHECK(link->send({}) == kerf::PacketLink::Sent::yes);
    CHECK(port->wait(1000));
    CHECK(port->receive(buffer) == 0);
    CHECK(port->closed());
    CHECK_FALSE(port->send(std::array<std::uint8_t, 1>{1}));
  }
}

TEST_CASE("over UDP a device that is killed closes the port") {
  std::optional<kerf::UdpServer> server;
  server.emplace("0");
  kerf::UdpPort port(std::to_string(server->port()), 0, kGoOn);
  server.reset();
  // The refusal of one packet is told with the next call.
  std::array<std::uint8_t, 64> buffer{};
  for (int tries = 0; tries < 100 && !port.closed(); ++tries) {
    port.send(std::array<std::uint8_t, 1>{1});
    CHECK(port.receive(buffer) == 0);
  }
  CHECK(port.closed());
}

TEST_CASE("over UDP nobody listening, and no address, is one line that names the way out") {
  const std::string free_port = [] { return std::to_string(kerf::UdpServer("0").port()); }();
  for (const std::string& where :
       {free_port, std::string("127.0.0.1:99999"), std::string(""), std::string("[::1]:x")}) {
    CAPTURE(where);
    try {
      const kerf::UdpPort port(where, 0, kGoOn);
      FAIL("connected to nothing");
    } catch (const std::runtime_error& error) {
      const std::string line = error.what();
      CAPTURE(line);
      CHECK(line.find("--port udp:" + where + ": ") == 0);
      CHECK(line.find("; name the [ADDRESS:]PORT of kerf-emulator --front udp") !=
            std::string::npos);
    }
  }
}
