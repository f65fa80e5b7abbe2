// SPDX-License-Identifier: Apache-2.0
#include "controller/device/open_port.hpp"

#include <atomic>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

namespace {

const std::atomic<bool> kGoOn{false};

std::string error_of(const std::string& text, kerf::Personality personality) {
  try {
    static_cast<void>(
        kerf::open_port(kerf::resolve_port(text, personality), {personality}, 0, kGoOn));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

/// Whether the build has the bus; else it says so.
bool left_out(const std::string& bus) {
  try {
    kerf::check_port(bus);
  } catch (const std::runtime_error& error) {
    CHECK(std::string(error.what()).find("left out of this build; install lib") !=
          std::string::npos);
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a port that is none is refused with the ones that are") {
  for (const char* text : {"auto", "fw", "fw:/dev/fw1", "socket:/tmp/x", "udp:10.0.0.2:5000"}) {
    CAPTURE(text);
    CHECK_NOTHROW(kerf::check_port(text));
  }
  for (const char* text : {"", "usbx", "hid0", "fwd", "sock:/tmp/x", "automatic"}) {
    CAPTURE(text);
    CHECK_THROWS_WITH_AS(kerf::check_port(text),
                         doctest::Contains("use auto, fw, usb, hid, or socket:PATH or udp:"),
                         std::runtime_error);
  }
}

TEST_CASE("auto is the bus of the device") {
  using kerf::Personality;
  CHECK(kerf::resolve_port("auto", Personality::omni) == "fw");
  CHECK(kerf::resolve_port("auto", Personality::falcon) == "usb");
  CHECK(kerf::resolve_port("auto", Personality::woodenhaptics) == "hid");
  CHECK(kerf::resolve_port("hid:KERF0001", Personality::woodenhaptics) == "hid:KERF0001");
  CHECK(kerf::resolve_port("socket:/tmp/x", Personality::falcon) == "socket:/tmp/x");
  CHECK_THROWS_WITH_AS(static_cast<void>(kerf::resolve_port("usb,firmware=x", Personality::omni)),
                       "--port usb,firmware=x: not for --device omni; take fw, or another --device",
                       std::runtime_error);
}

TEST_CASE("--port usb: options, and what is told where no Falcon can be") {
  if (left_out("usb")) return;
  CHECK_NOTHROW(kerf::check_port("usb:KERF0001,firmware=/tmp/x"));
  CHECK_NOTHROW(kerf::check_port("usb,firmware=/tmp/x"));
  CHECK_THROWS_WITH_AS(kerf::check_port("usb:KERF0001,firmware="),
                       doctest::Contains("use firmware=FILE"), std::runtime_error);
  const auto falcon = kerf::Personality::falcon;
  CHECK(error_of("usb:/nowhere/1", falcon).find("--port usb:/nowhere/1: no such node; ") == 0);
  CHECK(error_of("usb:KERF0009", falcon).find("no Falcon (0403:cb48) with this serial number") !=
        std::string::npos);
  CHECK(error_of("usb:/dev/null", falcon).find("--port usb:/dev/null: is no USB device (") == 0);
  CHECK(error_of("usb:/,firmware=/nowhere", falcon).find("--port usb:/: firmware /nowhere: ") == 0);
  CHECK(error_of("auto", falcon).find("--port usb: no Falcon") == 0);
}

TEST_CASE("--port hid: what is told where no arm can be") {
  if (left_out("hid")) return;
  CHECK_THROWS_WITH_AS(kerf::check_port("hid:x,y"), doctest::Contains("'x,y' is not known"),
                       std::runtime_error);
  const auto arm = kerf::Personality::woodenhaptics;
  CHECK(error_of("hid:/nowhere/0", arm).find("--port hid:/nowhere/0: no such node; ") == 0);
  CHECK(error_of("hid:/dev/null", arm).find("--port hid:/dev/null: /dev/null is another device") ==
        0);
  CHECK(error_of("auto", arm).find("--port hid: no WoodenHaptics arm") == 0);
}
