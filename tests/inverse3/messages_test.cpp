// SPDX-License-Identifier: Apache-2.0
// Messages of the Inverse Service, read and written.
#include "arm/inverse3/messages.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

#include <doctest/doctest.h>

namespace kerf::messages_test {
namespace {

using namespace kerf::inverse3;

ServiceState read(std::string_view text) {
  ServiceState state;
  REQUIRE(parse_state(text, state));
  return state;
}
bool is_read(std::string_view text) {
  ServiceState state;
  return parse_state(text, state);
}
std::string message(const std::array<double, 3>& force_n, Extra extra = Extra::none,
                    ForceKey key = ForceKey::vector) {
  MessageBuffer buffer;
  return std::string(force_message(ShortText("0A1C"), key, force_n, extra, buffer));
}

constexpr std::string_view kState = R"({
 "inverse3": [{"device_id": "0A1C", "state": {"cursor_position": {"x": 0.0213, "y": -0.1338, "z": 0.0871},
    "current_cursor_force": {"x": -0.6, "y": 0, "z": 1.2}, "control_domain": "cartesian", "control_mode": "force"},
  "status": {"calibrated": true, "in_use": true, "power_supply": true, "ready": true, "started": true}}],
 "verse_grip": [{"device_id": "51877", "state": {"button": true, "hall": 9, "orientation": {"w": 0.92, "x": 0.38, "y": 0, "z": 0}}, "status": {"error": 0}}],
 "wireless_verse_grip": [{"device_id": "40213", "state": {"orientation": {"w": 1, "x": 0, "y": 0, "z": 0},
    "buttons": {"a": false, "b": true, "c": false}, "battery_level": 0.8}, "status": {"connected": true, "awake": false}}]})";

}  // namespace

TEST_CASE("a state of 3.5 is read, whatever else it has") {
  const ServiceState state = read(kState);
  REQUIRE(state.arm_count == 1);
  const ArmState& arm = state.arms[0];
  CHECK(arm.id == "0A1C");
  CHECK(arm.position_m[0] == 0.0213);
  CHECK(arm.position_m[1] == -0.1338);
  CHECK(arm.position_m[2] == 0.0871);
  CHECK(arm.echoed_n[2] == 1.2);
  CHECK(arm.mode == "force");
  CHECK(arm.domain == "cartesian");
  CHECK(arm.calibrated == true);
  CHECK(arm.power_supply == true);
  CHECK_FALSE(arm.has_config);
  REQUIRE(state.handle_count == 2);
  CHECK(state.handles[0].group == 0);
  REQUIRE(state.handles[0].button_count == 1);
  CHECK(state.handles[0].buttons[0].name == "button");
  CHECK(state.handles[0].buttons[0].pressed);
  CHECK(state.handles[0].orientation_xyzw[3] == 0.92);
  CHECK(state.handles[1].group == 1);
  REQUIRE(state.handles[1].button_count == 3);
  CHECK(state.handles[1].buttons[1].pressed);
  CHECK(state.handles[1].awake == false);
}

TEST_CASE("what a service leaves out is empty, down to an empty object") {
  CHECK(read("{}").arm_count == 0);
  const ServiceState state = read(R"({"session_id":1,"inverse3":[{"device_id":"1"},{}]})");
  REQUIRE(state.arm_count == 2);
  CHECK_FALSE(state.arms[0].position_m[0]);
  CHECK_FALSE(state.arms[0].power_supply);
  CHECK(state.arms[1].id.view().empty());
}

TEST_CASE("the configuration shows what would turn or weaken a force") {
  const auto arm = [](std::string_view config) {
    return read(R"({"inverse3":[{"config":)" + std::string(config) + "}]}").arms[0];
  };
  const ArmState fine = arm(
      R"({"basis":{"permutation":"XYZ"},"mount":{"position":{"x":0,"y":0,"z":0},"rotation":{"w":1,"x":0,"y":0,"z":0},
          "scale":{"x":1,"y":1,"z":1}},"filters":{"force_gate":{"gain":0.3},"damping":{"scalar":0}}})");
  CHECK(fine.has_config);
  CHECK(fine.basis == "XYZ");
  CHECK(fine.damping == 0.0);
  CHECK(fine.force_gate == 0.3);
  CHECK_FALSE(fine.mount_moves);
  CHECK(arm(R"({"basis":{"permutation":"XZ-Y"}})").basis == "XZ-Y");
  CHECK(arm(R"({"mount":{"position":{"x":0,"y":0.01,"z":0}}})").mount_moves);
  CHECK(arm(R"({"mount":{"transform":{"position":{"z":-0.01}}}})").mount_moves);
  CHECK(arm(R"({"mount":{"rotation":{"w":0.7,"x":0.7}}})").mount_moves);
  CHECK(arm(R"({"mount":{"scale":{"x":2}}})").mount_moves);
  CHECK(arm(R"({"filters":{"damping":{"scalar":1.5}}})").damping == 1.5);
}

TEST_CASE("text that is no message of a service is refused") {
  for (const char* text : {"",
                           "x",
                           "[]",
                           "1",
                           "null",
                           "\"inverse3\"",
                           "{",
                           R"({"inverse3":[)",
                           R"({"a":1}x)",
                           R"({"a":NaN})",
                           R"({"a":1e999})",
                           R"({"a":-1e999})",
                           R"({"a":Infinity})",
                           "{\"a\":\"\xff\"}",
                           R"({"inverse3":1})",
                           R"({"inverse3":null})",
                           R"({"inverse3":["0A1C"]})",
                           R"({"inverse3":[{"device_id":12}]})",
                           R"({"inverse3":[{"state":[]}]})",
                           R"({"inverse3":[{"state":{"cursor_position":[0,0,0]}}]})",
                           R"({"inverse3":[{"state":{"cursor_position":{"x":"0.1"}}}]})",
                           R"({"inverse3":[{"state":{"cursor_position":{"x":null}}}]})",
                           R"({"inverse3":[{"status":{"calibrated":1}}]})",
                           R"({"verse_grip":[{"state":{"button":1}}]})",
                           R"({"wireless_verse_grip":[{"state":{"buttons":{"a":"no"}}}]})"}) {
    CAPTURE(text);
    CHECK_FALSE(is_read(text));
  }
}

TEST_CASE("of a member that is there twice the last one counts") {
  const ServiceState state = read(
      R"({"inverse3":[{"device_id":"1"},{"device_id":"2"}],
          "inverse3":[{"device_id":"3","state":{"cursor_position":{"x":1,"y":1,"z":1},"cursor_position":{"x":2}}}],
          "verse_grip":[{"state":{"button":true,"button":false}}]})");
  REQUIRE(state.arm_count == 1);
  CHECK(state.arms[0].id == "3");
  CHECK(state.arms[0].position_m[0] == 2.0);
  CHECK_FALSE(state.arms[0].position_m[1]);
  REQUIRE(state.handles[0].button_count == 1);
  CHECK_FALSE(state.handles[0].buttons[0].pressed);
}

TEST_CASE("a message has at most 16 levels, 8 devices and 64 KiB") {
  const auto nested = [](std::size_t lists) {
    return R"({"a":)" + std::string(lists, '[') + std::string(lists, ']') + "}";
  };
  CHECK(is_read(nested(kMostLevels - 1)));
  CHECK_FALSE(is_read(nested(kMostLevels)));
  CHECK_FALSE(is_read(nested(1000)));
  const auto devices = [](int count) {
    std::string text = R"({"inverse3":[{})";
    for (int i = 1; i < count; ++i) text += ",{}";
    return text + "]}";
  };
  CHECK(is_read(devices(8)));
  CHECK_FALSE(is_read(devices(9)));
  const auto long_one = [](std::size_t size) {
    std::string text = R"({"a":")";
    text.resize(size - 2, 'x');
    return text + "\"}";
  };
  CHECK(is_read(long_one(kMostMessageBytes)));
  CHECK_FALSE(is_read(long_one(kMostMessageBytes + 1)));
}

TEST_CASE("one member with slashes is not taken for the members of members") {
  const ServiceState state =
      read(R"({"inverse3":[{"state/cursor_position":{"x":5},"state":{"cursor_position/x":5}}]})");
  CHECK_FALSE(state.arms[0].position_m[0]);
}

TEST_CASE("a force is written with four decimals under the word of the version") {
  CHECK(
      message({0, -0.4, 1.1}) ==
      R"({"inverse3":[{"device_id":"0A1C","commands":{"set_cursor_force":{"vector":{"x":0.0000,"y":-0.4000,"z":1.1000}}}}]})");
  CHECK(message({}, Extra::none, ForceKey::values).find("\"values\":{\"x\"") != std::string::npos);
  CHECK(message({}, Extra::profile).starts_with(R"({"session":{"configure":{"profile":)"));
  CHECK(
      message({}, Extra::full_state).starts_with(R"({"session":{"force_render_full_state":{}},)"));
}

TEST_CASE("what is no force never leaves") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double wrong : {kNan, kInfinity, -kInfinity, 1e308, 100.01}) {
    CHECK(message({wrong, wrong, wrong}) == message({0, 0, 0}));
  }
  CHECK(message({100, -100, 0}).find("100.0000") != std::string::npos);
}

TEST_CASE("the longest message fits its buffer") {
  MessageBuffer buffer;
  const ShortText longest(std::string(ShortText::kMost, 'x'));
  const auto text =
      force_message(longest, ForceKey::vector, {-100, -100, -100}, Extra::profile, buffer);
  CHECK(text.ends_with("}}}}]}"));
  CHECK(text.size() < buffer.size());
}

TEST_CASE("an identifier is plain if it needs no escapes and was not cut") {
  CHECK(ShortText("0A1C").is_plain());
  CHECK(ShortText("a-b_c.d:1").is_plain());
  CHECK_FALSE(ShortText("").is_plain());
  CHECK_FALSE(ShortText("a\"b").is_plain());
  CHECK_FALSE(ShortText("a b").is_plain());
  CHECK(ShortText(std::string(ShortText::kMost, 'x')).is_plain());
  CHECK_FALSE(ShortText(std::string(ShortText::kMost + 1, 'x')).is_plain());
}

TEST_CASE("an event has its name, its device and its safety type") {
  ServiceEvent event;
  REQUIRE(parse_event(
      R"({"name":"device-safety-triggered","level":"error","data":{"device_id":"0A1C","safety_type":"ebrake_triggered"}})",
      event));
  CHECK(event.name == "device-safety-triggered");
  CHECK(event.device_id == "0A1C");
  CHECK(event.safety_type == "ebrake_triggered");
  REQUIRE(parse_event("{}", event));
  CHECK(event.name.view().empty());
  CHECK_FALSE(parse_event("[1]", event));
  CHECK_FALSE(parse_event(R"({"name":1})", event));
}

}  // namespace kerf::messages_test
