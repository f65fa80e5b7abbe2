// SPDX-License-Identifier: Apache-2.0
// One connection without its socket: proof, echo, bars, buttons and frame.
#include "arm/inverse3/session.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

#include <doctest/doctest.h>

#include "tests/support/errors.hpp"

namespace kerf::session_test {
namespace {

using namespace kerf::inverse3;
using kerf::test::error_of;
using kerf::test::has;

constexpr std::int64_t kMs = 1'000'000;

/// What a service may say of its device; a state in words.
struct Said {
  std::string id = "0A1C";
  std::string position = R"({"x":0,"y":-0.13,"z":0.28})";
  std::string echo = R"({"x":0,"y":0,"z":0})";
  std::string mode = R"("control_domain":"cartesian","control_mode":"force")";
  std::string status = R"("calibrated":true,"power_supply":true,"ready":true)";
  std::string config;
  std::string handles =
      R"("wireless_verse_grip":[{"device_id":"7","state":{"orientation":{"w":1,"x":0,"y":0,"z":0},)"
      R"("buttons":{"a":false,"b":false,"c":true}},"status":{"connected":true,"awake":true}}])";

  [[nodiscard]] ServiceState state() const {
    ServiceState read;
    const std::string text =
        R"({"inverse3":[{"device_id":")" + id + "\"," +
        (config.empty() ? "" : "\"config\":" + config + ",") + R"("state":{"cursor_position":)" +
        position + (echo.empty() ? "" : ",\"current_cursor_force\":" + echo) +
        (mode.empty() ? "" : "," + mode) + R"(},"status":{)" + status + "}}]," + handles + "}";
    REQUIRE(parse_state(text, read));
    return read;
  }
};

/// The same before kerf's first force.
Said idle(Said said = {}) {
  const bool is_old = said.mode.starts_with(R"("mode")");
  said.mode = is_old ? R"("mode":"idle")" : R"("control_domain":"undefined","control_mode":"idle")";
  return said;
}

CartesianCommand push(std::int16_t x_mn) {
  CartesianCommand command;
  command.force_on = true;
  command.force_mn = {x_mn, 0, 0};
  return command;
}

/// A session at 1 kHz.
struct Run {
  explicit Run(const Said& first = {}, ForceKey key = ForceKey::vector, const Wanted& wanted = {})
      : session(wanted, key, idle(first).state(), 0) {}

  /// One turn: the force that was sent, and the report of the reply.
  std::array<double, 3> turn(const Said& said, const CartesianCommand& command = {}) {
    now_ns += kMs;
    const auto force_n = session.force_n(command, now_ns, now_ns);
    report = session.take(said.state(), ++number, now_ns);
    return force_n;
  }
  void turns(int count, const Said& said, const CartesianCommand& command = {}) {
    for (int i = 0; i < count; ++i) turn(said, command);
  }
  /// Until the device may push.
  void arm(const Said& said = {}) {
    turns(80, said);
    REQUIRE(session.bar() == Bar::none);
  }

  Session session;
  std::int64_t now_ns = 0;
  std::uint32_t number = 0;
  std::optional<CartesianReport> report;
};

std::string newtons(double x, double y, double z) {
  char text[96];
  std::snprintf(text, sizeof text, R"({"x":%.4f,"y":%.4f,"z":%.4f})", x, y, z);
  return text;
}

}  // namespace

// ---- which device ----

TEST_CASE("the only device is taken; of several, the named one") {
  Said two;
  two.id = R"(0B2D"},{"device_id":"0A1C)";
  const auto open = [](const Said& first, const char* wanted) {
    return error_of(
        [&] { Session({.device_id = ShortText(wanted)}, ForceKey::vector, first.state(), 0); });
  };
  CHECK(open(idle(), "").empty());
  CHECK(open(idle(), "0A1C").empty());
  CHECK(has(open(idle(), "0B2D"), "no device 0B2D but 0A1C; name one of these with device=ID"));
  CHECK(has(error_of([&] {
              Session({.device_id = ShortText("0B2D"), .is_again = true}, ForceKey::vector,
                      idle().state(), 0);
            }),
            "no device 0B2D but 0A1C; connect that one again, or start kerf again for another"));
  CHECK(has(open(two, ""), "several devices are there: 0B2D, 0A1C; name one with device=ID"));
  CHECK(open(idle(two), "0A1C").empty());
  ServiceState none;
  CHECK(has(error_of([&] { Session({}, ForceKey::vector, none, 0); }), "no Inverse3; connect one"));
  Said odd;
  odd.id = "a b";
  CHECK(has(open(odd, ""), "no usable device_id"));
}

TEST_CASE("a device that another program drives proves nothing, and is refused with its state") {
  struct {
    const char* mode;
    const char* says;
  } const cases[] = {
      {R"("control_domain":"cartesian","control_mode":"force")", "0A1C is not idle (force)"},
      {R"("control_domain":"angular","control_mode":"position")", "0A1C is not idle (position)"},
      {R"("mode":"force")", "0A1C is not idle (force)"},
      {R"("control_domain":"cartesian")", "0A1C is not idle (cartesian)"},
      {R"("mode":"a\nb")", "0A1C is not idle (?)"},
      {R"("control_domain":"undefined","control_mode":"idle")", ""},
      {R"("mode":"idle")", ""},
      {"", ""}};
  for (const auto& [mode, says] : cases) {
    CAPTURE(mode);
    Said said;
    said.mode = mode;
    const std::string error = error_of([&] { Session({}, ForceKey::vector, said.state(), 0); });
    CHECK(error.empty() == (*says == 0));
    CHECK(has(error, says));
    CHECK((error.empty() || has(error, "; end that program")));
  }
}

namespace {

/// Handles by id, group "wireless_verse_grip"; a button is held, and `c` parks.
std::string handles_of(std::initializer_list<std::pair<const char*, bool>> handles,
                       const char* status = "") {
  std::string list;
  for (const auto& [id, is_held] : handles) {
    list += std::string(list.empty() ? "" : ",") + R"({"device_id":")" + id +
            R"(","state":{"buttons":{"c":)" + (is_held ? "true" : "false") + R"(}},"status":{)" +
            status + "}}";
  }
  return R"("wireless_verse_grip":[)" + list + "]";
}

}  // namespace

TEST_CASE("of several handles the named one counts; without a name they are listed and refused") {
  Said two = idle();
  two.handles = handles_of({{"7", false}, {"8", true}});
  const auto open = [&](const Wanted& wanted) {
    return error_of([&] { Session(wanted, ForceKey::vector, two.state(), 0); });
  };
  CHECK(
      has(open({}), "several handles are there: 7, 8; name the one of this device with handle=ID"));
  CHECK(open({.handle_id = ShortText("8")}).empty());
  CHECK(open({.handle_id = ShortText("9")}).empty());  // it may wake up
  two.handles = handles_of({{"7", false}, {"8", true}}, R"("connected":false)");
  CHECK(open({}).empty());
  for (const auto& [id, parked] : {std::pair{"7", false}, {"8", true}}) {
    CAPTURE(id);
    Said said;
    said.handles = handles_of({{"7", false}, {"8", true}});
    Run run(said, ForceKey::vector, {.handle_id = ShortText(id)});
    run.turns(80, said);
    CHECK(run.report->parked == parked);
    CHECK((run.session.bar() == Bar::none) == parked);
  }
  Said said;
  said.handles = handles_of({{"7", true}});
  Run absent(said, ForceKey::vector, {.handle_id = ShortText("9")});
  absent.turns(80, said);
  CHECK(absent.session.bar() == Bar::no_handle);
}

TEST_CASE("a handle that comes later changes nothing; without the first one several are refused") {
  Said one, two, others;
  one.handles = handles_of({{"7", true}});
  two.handles = handles_of({{"6", false}, {"7", true}, {"8", false}});
  others.handles = handles_of({{"6", true}, {"8", true}});
  Run run(one);
  run.arm(one);
  run.turns(100, two);
  CHECK(run.session.bar() == Bar::none);
  CHECK(run.report->parked);
  run.turns(100, others);
  CHECK(run.session.bar() == Bar::several_handles);
  CHECK_FALSE(run.report->homed);
  run.turns(100, two);
  CHECK(run.session.bar() == Bar::none);
}

// ---- arming ----

TEST_CASE("nothing is pushed before the force command is proven and the parking button was held") {
  Run run;
  Said waiting;
  waiting.handles = R"("wireless_verse_grip":[{"device_id":"7","state":{"buttons":{"c":false}}}])";
  run.turns(200, waiting, push(1000));
  CHECK(run.session.is_proven());
  CHECK(run.session.bar() != Bar::none);
  CHECK_FALSE(run.report->homed);
  CHECK(run.turn(waiting, push(1000)) == std::array{0.0, 0.0, 0.0});
  run.turn({});  // held
  CHECK(run.report->homed);
  CHECK(run.report->powered);
  CHECK(run.report->parked);
  run.turn(waiting);
  CHECK(run.report->homed);
  CHECK_FALSE(run.report->parked);
  CHECK(run.turn(waiting, push(1000)) == std::array{1.0, 0.0, 0.0});
}

TEST_CASE("a service that ignores the force command never arms, by the words of any version") {
  for (const char* mode :
       {R"("control_domain":"undefined","control_mode":"idle")", R"("mode":"idle")",
        R"("control_domain":"undefined","control_mode":"force")",
        R"("control_domain":"cartesian","control_mode":"idle")", ""}) {
    CAPTURE(mode);
    Run run;
    Said deaf;
    deaf.mode = mode;
    run.turns(Session::kProofTurns - 1, deaf);
    CHECK(run.session.bar() == Bar::proving);
    run.turn(deaf);
    CHECK(run.session.bar() == Bar::unproven);
    run.turns(1000, {}, push(1000));  // for good
    CHECK(run.session.bar() == Bar::unproven);
    CHECK_FALSE(run.report->homed);
  }
}

TEST_CASE("the proof waits for a device that is well, and then takes ten turns") {
  Run run;
  Said off;
  off.status = R"("calibrated":true,"power_supply":false)";
  off.mode = R"("control_mode":"idle")";
  run.turns(100, off);
  CHECK(run.session.bar() == Bar::unpowered);
  CHECK_FALSE(run.report->powered);
  Said idle;
  idle.mode = off.mode;
  run.turns(Session::kProofTurns - 1, idle);
  CHECK_FALSE(run.session.is_proven());
  run.turn({});
  CHECK(run.session.is_proven());
}

TEST_CASE("what the service does not say of its device does not count as well") {
  struct {
    const char* status;
    Bar bar;
  } const cases[] = {{"", Bar::unpowered},
                     {R"("power_supply":true)", Bar::uncalibrated},
                     {R"("power_supply":false,"calibrated":true)", Bar::unpowered},
                     {R"("power_supply":true,"calibrated":false)", Bar::uncalibrated},
                     {R"("power_supply":true,"calibrated":true,"ready":false)", Bar::not_ready},
                     {R"("power_supply":true,"calibrated":true)", Bar::none}};
  for (const auto& [status, bar] : cases) {
    CAPTURE(status);
    Run run;
    run.arm();
    Said said;
    said.status = status;
    run.turn(said, push(500));
    CHECK(run.session.bar() == bar);
    CHECK(run.report->homed == (bar == Bar::none));
  }
}

TEST_CASE("a bar shows for 50 ms, and lasts until the parking button is held afterwards") {
  Run run;
  run.arm();
  run.session.raise(Bar::event, run.now_ns);
  const std::int64_t since_ns = run.now_ns;
  while (!run.report->homed || run.now_ns == since_ns)
    run.turn({});  // the button is held all along
  CHECK(run.now_ns - since_ns == Session::kBarNs);
  run.session.raise(Bar::event, run.now_ns);
  Said away;
  away.handles = R"("wireless_verse_grip":[{"device_id":"7","state":{"buttons":{"c":false}}}])";
  run.turns(1000, away);
  CHECK(run.session.bar() == Bar::event);
}

// ---- forces ----

TEST_CASE("a force goes out in the service's frame: X right, Y away, Z up") {
  Run run;
  run.arm();
  CartesianCommand command = push(0);
  command.force_mn = {100, 200, 300};
  CHECK(run.turn({}, command) == std::array{0.1, -0.3, 0.2});
}

TEST_CASE("a force is at most the device's peak, and none if its command is 20 ms old") {
  Run run;
  run.arm();
  CartesianCommand command = push(32767);
  const auto force_n = run.turn({}, command);
  CHECK(force_n[0] == doctest::Approx(10.0));
  const auto at = [&](std::int64_t age_ns) {
    return run.session.force_n(push(1000), run.now_ns - age_ns, run.now_ns)[0];
  };
  CHECK(at(Session::kCommandNs - 1) == 1.0);
  CHECK(at(Session::kCommandNs) == 0.0);
  command = push(1000);
  command.force_on = false;
  CHECK(run.turn({}, command)[0] == 0.0);
}

// ---- echo ----

TEST_CASE("an echo that follows within 20 ms, in steps of 14 mN, is fine") {
  Run run;
  run.arm();
  std::array<double, 20> sent{};
  for (int i = 0; i < 2000; ++i) {
    const double now = 2 * std::sin(i * 0.02);
    const double echoed = std::round(sent[static_cast<std::size_t>(i) % 20] / 0.014) * 0.014;
    Said said;
    said.echo = newtons(echoed, 0, 0);
    run.turn(said, push(static_cast<std::int16_t>(1000 * now)));
    sent[static_cast<std::size_t>(i) % 20] = now;
    REQUIRE(run.session.bar() == Bar::none);
  }
}

TEST_CASE("an echo that is off by more than 50 mN for more than 20 ms bars the device") {
  for (const double off_n : {0.04, 0.06, 1.0, -1.0}) {
    for (const int axis : {0, 1, 2}) {
      CAPTURE(off_n);
      CAPTURE(axis);
      Run run;
      run.arm();
      run.turns(50, {});
      Said said;
      std::array<double, 3> echo{};
      echo[static_cast<std::size_t>(axis)] = off_n;
      said.echo = newtons(echo[0], echo[1], echo[2]);
      run.turns(21, said);
      CHECK(run.session.bar() == Bar::none);
      run.turn(said);
      CHECK(run.session.bar() == (std::abs(off_n) > 0.05 ? Bar::echo : Bar::none));
    }
  }
}

TEST_CASE("without an echo a state that falls idle bars the device") {
  Said old;
  old.echo = "";
  old.mode = R"("mode":"force")";
  Run run(old, ForceKey::values);
  run.arm(old);
  old.mode = R"("mode":"idle")";
  run.turns(21, old, push(500));
  CHECK(run.session.bar() == Bar::none);
  run.turn(old, push(500));
  CHECK(run.session.bar() == Bar::idle);
}

// ---- configuration ----

TEST_CASE("a frame or a damping that is not ours ends the session for good") {
  struct {
    const char* config;
    Bar bar;
  } const cases[] = {{R"({"basis":{"permutation":"XZ-Y"}})", Bar::moved_frame},
                     {R"({"mount":{"position":{"x":0.001}}})", Bar::moved_frame},
                     {R"({"filters":{"damping":{"scalar":0.1}}})", Bar::damped},
                     {R"({"filters":{"force_gate":{"gain":0.3}}})", Bar::none}};
  for (const auto& [config, bar] : cases) {
    CAPTURE(config);
    Run run;
    run.arm();
    Said said;
    said.config = config;
    run.turn(said);
    CHECK(run.session.bar() == bar);
    run.turns(100, {});
    CHECK(run.session.bar() == bar);
    CHECK(is_final(bar) == (bar != Bar::none));
  }
}

// ---- pose ----

TEST_CASE("the pose is turned into kerf's frame and moved to our origin") {
  Run run;
  Said said;
  said.position = R"({"x":0.01,"y":-0.11,"z":0.23})";
  said.handles =
      R"("wireless_verse_grip":[{"device_id":"7","state":{"orientation":{"w":0.5,"x":0.5,"y":0.5,"z":-0.5},"buttons":{"c":false}}}])";
  run.turn(said);
  CHECK(run.report->position_um == std::array<std::int32_t, 3>{10'000, 30'000, -20'000});
  CHECK(run.report->orientation == std::array<std::int16_t, 4>{16384, -16384, -16384, 16384});
}

TEST_CASE("a position that no arm has is not read: farther than 1 m, millimetres, a part missing") {
  Run run;
  run.turn({});
  for (const char* position : {R"({"x":1.01,"y":0,"z":0})", R"({"x":21.3,"y":-133.8,"z":87.1})",
                               R"({"x":1e308,"y":0,"z":0})", R"({"x":0,"y":0})", "{}"}) {
    CAPTURE(position);
    Said said;
    said.position = position;
    run.turn(said);
    CHECK_FALSE(run.report);
  }
  Said wrong;
  wrong.position = R"({"x":21.3,"y":-133.8,"z":87.1})";
  run.turn(wrong);
  CHECK(has(run.session.why_unread(),
            "is 133.8 m away, and no arm reaches 1 m: is it in millimetres?"));
  wrong.position = "{}";
  run.turn(wrong);
  CHECK(has(run.session.why_unread(), "its state has no position of the device"));
  Said far;
  far.position = R"({"x":0.99,"y":-0.13,"z":0.2})";
  run.turn(far);
  CHECK(run.report);
}

TEST_CASE("an orientation that is none leaves the last one") {
  Run run;
  const auto with = [](const char* orientation) {
    Said said;
    said.handles =
        std::string(R"("verse_grip":[{"device_id":"7","state":{"button":false,"orientation":)") +
        orientation + "}}]";
    return said;
  };
  run.turn(with(R"({"w":0,"x":0,"y":0,"z":1})"));
  const auto first = run.report->orientation;
  CHECK(first == std::array<std::int16_t, 4>{0, 32767, 0, 0});
  for (const char* wrong : {R"({"w":0,"x":0,"y":0,"z":0})", R"({"w":1.02,"x":0,"y":0,"z":0})",
                            R"({"w":0.98,"x":0,"y":0,"z":0})", R"({"w":1})"}) {
    CAPTURE(wrong);
    run.turn(with(wrong));
    CHECK(run.report->orientation == first);
  }
  run.turn(with(R"({"w":1.009,"x":0,"y":0,"z":0})"));
  CHECK(run.report->orientation == std::array<std::int16_t, 4>{0, 0, 0, 32767});
}

// ---- handle ----

TEST_CASE("buttons by name: c parks, a and b are the first and second; a wired one's only parks") {
  const auto seen = [](const char* handles, const char* park = "", const char* handle = "") {
    Said said;
    said.handles = handles;
    Run run(said, ForceKey::vector, {.park = ShortText(park), .handle_id = ShortText(handle)});
    run.turns(12, said);
    const CartesianReport& r = *run.report;
    return std::string(r.parked ? "p" : "-") + (r.button1 ? "1" : "-") + (r.button2 ? "2" : "-") +
           (run.session.bar() == Bar::no_button ? "!" : "");
  };
  const auto wireless = [](const char* buttons) {
    return std::string(R"("wireless_verse_grip":[{"device_id":"7","state":{"buttons":{)") +
           buttons + "}}}]";
  };
  CHECK(seen(wireless(R"("a":true,"b":false,"c":false)").c_str()) == "-1-");
  CHECK(seen(wireless(R"("a":false,"b":true,"c":false)").c_str()) == "--2");
  CHECK(seen(wireless(R"("a":false,"b":false,"c":true)").c_str()) == "p--");
  CHECK(seen(wireless(R"("c":false,"b":true,"a":false,"home":true)").c_str()) == "--2");
  CHECK(seen(wireless(R"("a":true,"b":false,"c":false,"home":true)").c_str(), "home") == "p1-");
  CHECK(seen(wireless(R"("a":true,"b":false,"c":false)").c_str(), "a") == "p--");
  CHECK(seen(wireless(R"("button_0":true,"button_1":true,"button_2":false)").c_str(), "button_1") ==
        "p1-");
  CHECK(seen(wireless(R"("button_0":true,"button_1":true)").c_str()) == "-12!");
  CHECK(seen(R"("verse_grip":[{"device_id":"5","state":{"button":true}}])") == "p--");
  CHECK(seen(R"("verse_grip":[{"device_id":"5","state":{"button":true}}],
                "wireless_verse_grip":[{"device_id":"7","state":{"buttons":{"c":false}}}])",
             "", "7") == "---");
  CHECK(seen(R"("verse_grip":[{"device_id":"5","state":{"button":true}}],
                "wireless_verse_grip":[{"device_id":"7","state":{"buttons":{"c":false}}}])",
             "", "5") == "p--");
}

TEST_CASE("a handle that sleeps, goes or is another one bars the device; its pose is kept") {
  const auto handle = [](const char* id, const char* status) {
    return R"("wireless_verse_grip":[{"device_id":")" + std::string(id) +
           R"(","state":{"orientation":{"w":0,"x":1,"y":0,"z":0},"buttons":{"c":true}},"status":{)" +
           status + "}}]";
  };
  struct {
    std::string handles;
    Bar bar;
  } const cases[] = {{handle("7", R"("awake":false)"), Bar::handle_asleep},
                     {handle("7", R"("connected":false)"), Bar::handle_asleep},
                     {handle("8", R"("awake":true)"), Bar::handle_asleep},
                     {R"("verse_grip":[])", Bar::no_handle}};
  for (const auto& [handles, bar] : cases) {
    CAPTURE(handles);
    Run run;
    Said awake;
    awake.handles = handle("7", R"("awake":true)");
    run.arm(awake);
    Said said;
    said.handles = handles;
    run.turn(said, push(500));
    CHECK(run.session.bar() == bar);
    CHECK_FALSE(run.report->homed);
    CHECK(run.report->orientation == std::array<std::int16_t, 4>{32767, 0, 0, 0});
  }
}

// ---- gone ----

TEST_CASE("a device that is not listed gives one last report without power, then none") {
  Run run;
  run.arm();
  const auto pose = run.report->position_um;
  Said other;
  other.id = "0B2D";
  run.turn(other, push(500));
  REQUIRE(run.report);
  CHECK_FALSE(run.report->homed);
  CHECK_FALSE(run.report->powered);
  CHECK(run.report->position_um == pose);
  run.turn(other, push(500));
  CHECK_FALSE(run.report);
  CHECK(run.session.bar() == Bar::replaced);
  ServiceState none;
  REQUIRE(parse_state(R"({"inverse3":[]})", none));
  CHECK_FALSE(run.session.take(none, 1000, run.now_ns));
  CHECK(run.session.bar() == Bar::gone);
  CHECK(run.turn({}, push(500)) == std::array{0.0, 0.0, 0.0});  // back, and barred
  CHECK_FALSE(run.report->homed);
}

}  // namespace kerf::session_test
