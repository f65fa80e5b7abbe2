// SPDX-License-Identifier: Apache-2.0
#include "standin/settings.hpp"

#include <stdexcept>
#include <string>
#include <tuple>

#include <doctest/doctest.h>

namespace kerf::settings_test {
namespace {

std::string refusal_of(const std::string& text) {
  try {
    static_cast<void>(standin::parse_settings(text));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a socket alone is enough, and every unknown of a vendor has its first word then") {
  const auto settings = standin::parse_settings("socket:/tmp/a b/device");
  REQUIRE(settings.devices.size() == 1);
  CHECK(settings.devices[0].socket == "/tmp/a b/device");
  CHECK(settings.devices[0].kind == kerf::Personality::touch);
  CHECK(settings.devices[0].name == "Default Device");
  CHECK_FALSE(settings.lockstep);
  CHECK(settings.devices[0].rate_hz == 1000);
  CHECK(settings.ledger.empty());
  CHECK_FALSE(settings.drop_without_frame);
  CHECK_FALSE(settings.uncalibrated);
}

TEST_CASE("every key of the settings is read") {
  const auto settings = standin::parse_settings(
      "socket:s,device=omega,lockstep,rate=4000,priority=81,ledger=/"
      "l,missed=drop,stop=drop,excess=cut,"
      "before-enable=ignore,calibration=lost,handles=documented,button0=hand,status=16,ramp=0.5,"
      "stall=20,in-use=pose");
  CHECK(settings.devices[0].kind == kerf::Personality::omega);
  CHECK(settings.lockstep);
  CHECK(settings.devices[0].rate_hz == 4000);
  CHECK(settings.priority == 81);
  CHECK(settings.devices[0].ledger == "/l");
  CHECK(settings.ledger == "/l");  // of a single device: what belongs to none, too
  CHECK(settings.drop_without_frame);
  CHECK(settings.drop_on_stop);
  CHECK(settings.cut_excess);
  CHECK(settings.force_needs_enable);
  CHECK(settings.uncalibrated);
  CHECK(settings.documented_handles);
  CHECK(settings.hand_buttons);
  CHECK(settings.short_status);
  CHECK(settings.ramp_s == 0.5);
  CHECK(settings.stall_ms == 20);
  CHECK(settings.in_use == standin::InUse::pose);
  CHECK_FALSE(standin::parse_settings("socket:s,missed=drop,missed=hold").drop_without_frame);
}

TEST_CASE("each socket begins a device, with the keys behind it as its own") {
  const auto settings = standin::parse_settings(
      "socket:/a,name=Left Device,ledger=/la,socket:/b,ledger=/lb,lockstep,socket:/c,device=omega,"
      "rate=4000,socket:/d,device=omega,program=/l,stop=drop");
  REQUIRE(settings.devices.size() == 4);
  const auto& [a, b, c, d] =
      std::tie(settings.devices[0], settings.devices[1], settings.devices[2], settings.devices[3]);
  CHECK((a.socket == "/a" && a.name == "Left Device" && a.ledger == "/la"));
  CHECK((b.socket == "/b" && b.name == "Default Device 2" && b.ledger == "/lb"));
  CHECK((c.kind == kerf::Personality::omega && c.rate_hz == 4000 && c.name == "omega.3"));
  CHECK((d.kind == kerf::Personality::omega && d.rate_hz == 1000 && d.name == "omega.3 2"));
  CHECK(settings.ledger == "/l");
  CHECK(settings.lockstep);
  CHECK(settings.drop_on_stop);
}

TEST_CASE("a device without a name gets the next that no device of its kind has") {
  const auto names = [](std::string_view text) {
    std::string all;
    for (const auto& device : standin::parse_settings(text).devices) all += device.name + ", ";
    return all;
  };
  CHECK(names("socket:a,name=Default Device 2,socket:b") == "Default Device 2, Default Device 3, ");
  CHECK(names("socket:a,socket:b,name=Default Device") == "Default Device 2, Default Device, ");
  CHECK(names("socket:a,socket:b,socket:c,name=Default Device 2") ==
        "Default Device, Default Device 3, Default Device 2, ");
  CHECK(names("socket:a,name=omega.3,socket:b,device=omega") == "omega.3, omega.3, ");
  CHECK(names("socket:a,device=omega,name=omega.3 2,socket:b,device=omega") ==
        "omega.3 2, omega.3 3, ");
}

TEST_CASE("devices that one program cannot have are refused by the part that says so") {
  CHECK(refusal_of("socket:a,socket:b,socket:c,socket:d") == "accepted");
  CHECK(refusal_of("socket:a,socket:b,socket:c,socket:d,socket:e") ==
        "KERF_STAND_IN: 'socket:e'; a program has at most 4 devices");
  const char* const twice =
      "KERF_STAND_IN: 'name=L'; two devices of a kind have it; give each its own";
  CHECK(refusal_of("socket:a,name=L,socket:b,name=L") == twice);
  CHECK(refusal_of("socket:a,name=L,socket:b,device=omega,name=L") == "accepted");
  CHECK(refusal_of("socket:a,name=L,socket:b,name=R,socket:c,name=L") == twice);
  CHECK(refusal_of("socket:a,rate=500,socket:b,rate=1000") ==
        "KERF_STAND_IN: 'rate=1000'; one servo thread serves all of a program");
  CHECK(refusal_of("socket:a,device=omega,rate=500,socket:b,device=omega") == "accepted");
}

TEST_CASE(
    "a switch alone is refused by the words and ranges of the list, and nothing else is one") {
  for (const char* word : {"missed=drop", "hand=pushed", "in-use=value", "ramp=0", "ramp=10",
                           "stall=1", "stall=60000"}) {
    CAPTURE(word);
    CHECK(standin::refusal_of_switch(word).empty());
    CHECK(refusal_of(std::string("socket:s,") + word) == "accepted");
  }
  CHECK(standin::refusal_of_switch("missed=keep") == "take hold or drop");
  CHECK(standin::refusal_of_switch("in-use=yes") == "take timer, value or pose");
  CHECK(standin::refusal_of_switch("missed") == "take hold or drop");
  CHECK(standin::refusal_of_switch("ramp=10.1") == "give a number from 0 to 10");
  CHECK(standin::refusal_of_switch("ramp=x'; y") == "give a number from 0 to 10");
  CHECK(standin::refusal_of_switch("stall=0.5") == "give a number from 1 to 60000");
  CHECK(standin::refusal_of_switch("stall=60001") == "give a number from 1 to 60000");
  for (const char* word : {"", "x", "lockstep", "rate=1000", "ledger=/l", "device=omega",
                           "missed=drop,lockstep", "socket:s"}) {
    CAPTURE(word);
    CHECK_FALSE(standin::refusal_of_switch(word).empty());
  }
  CHECK(standin::refusal_of_switch("x").starts_with("unknown; take one of missed=hold|drop, "));
  CHECK(standin::refusal_of_switch("x").ends_with(", ramp=0..10, stall=1..60000"));
}

TEST_CASE("wrong settings are refused in one line that names the part") {
  for (const char* text :
       {"", "udp:1", "socket:", "socket:s,", "socket:s,missed=keep", "socket:s,rate=0",
        "socket:s,rate=nan", "socket:s,device=falcon", "socket:s,ledger=", "socket:s,stall=1e9",
        "socket:s,what=ever",
        "socket:s,name=", "socket:s,program=", "socket:s,socket:", "socket:s,lockstep=1"}) {
    CAPTURE(text);
    const std::string line = refusal_of(text);
    CHECK(line.starts_with("KERF_STAND_IN: '"));
    CHECK(line.find('\n') == std::string::npos);
  }
}

}  // namespace kerf::settings_test
