// SPDX-License-Identifier: Apache-2.0
// The hand: plays a script, follows a user's target, is led by a window over a socket.
#include "hil/device/hand.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/wooden.hpp"
#include "hil/hil_error.hpp"
#include "hil/program/emulated_device.hpp"
#include "hil/script/hand_script_file.hpp"
#include "tests/hil/fake_host.hpp"
#include "tests/hil/model_runs.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::hand_test {
namespace {

using kerf::test::kSecond;
const DeviceVec<double> kDock{0, -70, -86};

/// The Omni's way, from another inkwell.
kerf::HandRoute from_dock() {
  kerf::HandRoute route = kerf::OmniModel().route();
  route.rest_tip_mm = kDock;
  return route;
}

HandMotion motion_of(const std::string& script) {
  HandMotion motion(kerf::parse_hand_script(script, "test"), from_dock());
  motion.leave();
  return motion;
}

HandGoal after(HandMotion& motion, int cycles) {
  HandGoal goal;
  for (int i = 0; i < cycles; ++i) goal = motion.next();
  return goal;
}

/// Its last target on the way to the start.
HandGoal reach(HandMotion& motion) {
  HandGoal goal;
  for (int i = 0; i < kSecond && !motion.arrived(); ++i) goal = motion.next();
  REQUIRE(motion.arrived());
  return goal;
}

}  // namespace

TEST_CASE("the hand rests in the inkwell until it leaves, then reaches for the start") {
  HandMotion motion(kerf::parse_hand_script("start_mm = [1, 4, 2]\n[[step]]\nhold = 1", "test"),
                    from_dock());
  CHECK(after(motion, 100).in_inkwell);
  motion.leave();
  const auto first = motion.next();
  CHECK_FALSE(first.in_inkwell);
  CHECK(norm(first.target_mm - kDock) < 0.01);
  CHECK_FALSE(motion.arrived());
  CHECK(norm(reach(motion).target_mm - DeviceVec<double>{1, 4, 2}) < 1e-12);
}

TEST_CASE("a smooth move is half way at half time, a linear one everywhere in proportion") {
  auto motion = motion_of(
      "start_mm = [0, 4, 0]\n"
      "[[step]]\nmove_mm = [0, 0, 8]\nseconds = 1\n"
      "[[step]]\nmove_mm = [8, 0, 8]\nseconds = 1\nease = 'linear'");
  reach(motion);
  CHECK(norm(after(motion, kSecond / 4).target_mm -
             DeviceVec<double>{0, 4 * (1 - 0.103515625), 8 * 0.103515625}) < 1e-9);
  CHECK(norm(after(motion, kSecond / 4).target_mm - DeviceVec<double>{0, 2, 4}) < 1e-9);
  after(motion, kSecond / 2);
  CHECK(norm(after(motion, kSecond / 4).target_mm - DeviceVec<double>{2, 0, 8}) < 1e-9);
}

TEST_CASE("patterns stay in their size, end at their start, and sink by their depth") {
  auto motion = motion_of(
      "start_mm = [0, 4, 0]\n"
      "[[step]]\ncircle_mm = 2\nturns = 3\nseconds = 1\nsink_mm = 1\n"
      "[[step]]\nzigzag_mm = [3, 4]\nturns = 5\nseconds = 1\nsink_mm = 0.5\n"
      "[[step]]\nhold = 1");
  reach(motion);
  double circle_mm = 0;
  HandGoal goal;
  for (int i = 0; i < kSecond; ++i) {
    goal = motion.next();
    circle_mm = std::max(circle_mm, std::hypot(goal.target_mm.x, goal.target_mm.z));
  }
  CHECK(circle_mm == doctest::Approx(2.0));
  CHECK(norm(goal.target_mm - DeviceVec<double>{0, 3, 0}) < 1e-9);
  double width = 0;
  double depth = 0;
  for (int i = 0; i < kSecond; ++i) {
    goal = motion.next();
    width = std::max(width, std::abs(goal.target_mm.x));
    depth = std::max(depth, std::abs(goal.target_mm.z));
  }
  CHECK(width == doctest::Approx(1.5).epsilon(1e-4));
  CHECK(depth == doctest::Approx(2.0).epsilon(1e-4));
  CHECK(norm(goal.target_mm - DeviceVec<double>{0, 2.5, 0}) < 1e-9);
  CHECK(norm(after(motion, 10 * kSecond).target_mm - DeviceVec<double>{0, 2.5, 0}) < 1e-9);
}

TEST_CASE("the unit scales every length of the script and none of the way out") {
  kerf::HandScript script = kerf::parse_hand_script(
      "start_mm = [1, 2, 0]\n[[step]]\nmove_mm = [0, -1, 0]\nseconds = 1", "test");
  script.unit_mm = 3;
  HandMotion motion(script, from_dock());
  motion.leave();
  CHECK(norm(motion.next().target_mm - kDock) < 0.01);
  CHECK(norm(reach(motion).target_mm - DeviceVec<double>{3, 6, 0}) < 1e-9);
  CHECK(norm(after(motion, kSecond).target_mm - DeviceVec<double>{0, -3, 0}) < 1e-9);
}

TEST_CASE("a script's own unit is obeyed; --unit-mm is for one without, as a demo gives it") {
  const kerf::test::TemporaryFolder folder;
  const auto tip_mm = [&](const char* own_unit, std::optional<double> unit_mm) {
    kerf::EmulatorOptions options;
    options.hand = folder.write(
        "hand.toml", std::string(own_unit) + "\nstart_mm = [0, 8, 0]\n[[step]]\nhold = 9");
    options.unit_mm = unit_mm;
    kerf::EmulatedDevice device(options);
    device.receive(encode(kerf::OmniCommand{.light = kerf::OmniCommand::Light::steady}));
    device.advance(3 * kSecond);
    return device.model().tip_mm();
  };
  const DeviceVec<double> tripled = tip_mm("", 3);
  CHECK(norm(tip_mm("unit_mm = 3", std::nullopt) - tripled) == 0);
  CHECK(norm(tip_mm("unit_mm = 3", 0.5) - tripled) == 0);
  CHECK(norm(tip_mm("", std::nullopt) - tripled) > 10);
}

TEST_CASE("the repeated block comes again to the cycle, and the orientation is kept") {
  auto motion = motion_of(
      "[[step]]\nmove_mm = [0, 3, 0]\nseconds = 0.5\norientation_deg = [0, 30, 0]\n"
      "[[step]]\nrepeat = true\nmove_mm = [2, 3, 0]\nseconds = 0.25\nbutton = 2\n"
      "[[step]]\nmove_mm = [0, 3, 0]\nseconds = 0.25");
  reach(motion);
  after(motion, kSecond / 4);
  CHECK(motion.next().orientation_rad[1] > 0);
  after(motion, kSecond / 4 - 1);
  for (int round = 0; round < 100; ++round) {
    const auto out = after(motion, kSecond / 4);
    CHECK(norm(out.target_mm - DeviceVec<double>{2, 3, 0}) < 1e-9);
    CHECK(out.button2);
    CHECK(out.orientation_rad[1] == doctest::Approx(kerf::omni::kPi / 6));
    const auto back = after(motion, kSecond / 4);
    CHECK(norm(back.target_mm - DeviceVec<double>{0, 3, 0}) < 1e-9);
    CHECK_FALSE(back.button2);
  }
}

TEST_CASE("a reach keeps its bounds, and no lighter or stiffer hand than the bounds' is faster") {
  const kerf::HandRoute routes[] = {kerf::OmniModel().route(), kerf::FalconModel().route(),
                                    kerf::WoodenModel().route()};
  for (const kerf::HandRoute& route : routes) {
    const kerf::ReachCurve way = kerf::reach_curve(route, route.rest_tip_mm, {0, 5, 0});
    CHECK(norm(way.at(0) - route.rest_tip_mm) < 1e-12);
    CHECK(norm(way.at(1) - DeviceVec<double>{0, 5, 0}) < 1e-12);
    CHECK(way.least_seconds(1000) == way.least_seconds(10'000));
    CHECK(way.least_seconds(5) == doctest::Approx(2 * way.least_seconds(10)));
  }
}

TEST_CASE("along a line the reach's duration is the closed form of minimum jerk") {
  kerf::HandRoute route;
  for (const double mm : {0.0, 0.5, 50.0, 200.0, 800.0}) {
    CAPTURE(mm);
    const kerf::ReachCurve way = kerf::reach_curve(route, {0, mm, 0}, {});
    for (const double w : {3.0, 30.0, 60.0, 1000.0}) {
      // Flash and Hogan: the peaks of speed, acceleration and jerk are 15/8, 10/sqrt(3) and 60.
      const double expected =
          std::max({15.0 / 8 * mm / 1000, std::sqrt(10 / std::sqrt(3.0) * mm / 10'000),
                    std::cbrt(60 * mm / 2) / w});
      CHECK(way.least_seconds(w) == doctest::Approx(expected).epsilon(0.02));
    }
  }
}

TEST_CASE("the tip of a soft and heavy hand swings past its start by no more than the bound") {
  for (const auto& [stiffness, mass] :
       {std::pair{0.5, 0.145}, {0.1, 0.145}, {0.05, 0.6}, {2.0, 0.1}}) {
    kerf::HandRoute route = from_dock();
    route.hand_rad_per_s = std::sqrt(1000 * stiffness / mass);
    HandMotion motion(kerf::parse_hand_script("start_mm = [0, 5, 0]\n[[step]]\nhold = 1", "test"),
                      route);
    motion.leave();
    DeviceVec<double> tip = kDock, velocity{};
    double lowest = 5;
    for (int i = 0; i < 6 * kSecond; ++i) {
      const DeviceVec<double> pull = motion.next().target_mm - tip;
      velocity = velocity + pull * (route.hand_rad_per_s * route.hand_rad_per_s / kSecond);
      tip = tip + velocity * (1.0 / kSecond);
      if (motion.arrived()) lowest = std::min(lowest, tip.y);
    }
    CAPTURE(stiffness);
    CHECK(lowest > 5 - kerf::ReachCurve::kSwingMm);
  }
}

namespace {

constexpr double kStiffness = 0.5;  // N/mm

const HandGoal kStart = kerf::test::at({0, 5, 0});

GuidedHand hand_at_start() {
  return {kStiffness, kerf::OmniModel().route(), kStart.target_mm};
}

/// A tip that goes wherever the hand wants it, for so long; the fastest it moved in a cycle.
double follow(GuidedHand& hand, DeviceVec<double>& tip_mm, double seconds) {
  double fastest = 0;
  for (auto left = kerf::cycles_of(seconds); left > 0; --left) {
    const DeviceVec<double> goal = hand.next(kStart, tip_mm).target_mm;
    fastest = std::max(fastest, norm(goal - tip_mm) / kerf::kCycleS);
    tip_mm = goal;
  }
  return fastest;
}

/// The same of a user that sends its target 50 times a second.
void lead(GuidedHand& hand, DeviceVec<double>& tip_mm, const HandTarget& target, double seconds) {
  for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
    hand.set_target(target);
    follow(hand, tip_mm, 0.02);
  }
}

}  // namespace

TEST_CASE("a guided hand follows a target with its lag, and a far one no faster than a stroke") {
  GuidedHand hand = hand_at_start();
  hand.release();
  DeviceVec<double> tip = kStart.target_mm;
  follow(hand, tip, 3);
  CHECK(tip == kStart.target_mm);  // without a target it stays
  hand.set_target({.tip_mm = {1, 5, 0}});
  follow(hand, tip, GuidedHand::kLagS);
  CHECK(tip.x == doctest::Approx(1 - std::exp(-1.0)).epsilon(0.01));
  hand.set_target({.tip_mm = {40, 5, 0}});
  CHECK(follow(hand, tip, 0.1) == doctest::Approx(GuidedHand::kMaxSpeedMmPerS));
}

TEST_CASE("a guided hand pulls at a tip that is held with a bounded force") {
  GuidedHand hand = hand_at_start();
  const DeviceVec<double> held = kStart.target_mm;
  HandGoal goal;
  for (int frame = 0; frame < 50; ++frame) {
    hand.set_target({.tip_mm = {0, -100, 0}});
    for (int i = 0; i < 160; ++i) goal = hand.next(kStart, held);
  }
  CHECK(norm(goal.target_mm - held) * kStiffness == doctest::Approx(GuidedHand::kMaxPullN));
}

TEST_CASE(
    "without targets a guided hand presses no more, then withdraws to its start: straight up "
    "first") {
  for (const bool released : {false, true}) {
    CAPTURE(released);
    GuidedHand hand = hand_at_start();
    DeviceVec<double> tip = kStart.target_mm;
    lead(hand, tip, {.tip_mm = {6, -2, 0}, .button1 = true}, 1);
    CHECK(hand.next(kStart, tip).button1);
    // The tooth holds the tip 1 mm above the target.
    DeviceVec<double> held{6, -1, 0};
    if (released) hand.release();
    HandGoal goal;
    const auto hold = [&](double seconds) {
      for (auto left = kerf::cycles_of(seconds); left > 0; --left) goal = hand.next(kStart, held);
    };
    hold((released ? 0 : GuidedHand::kStaleS) + 0.2);
    CHECK(norm(goal.target_mm - held) < 0.01);
    CHECK_FALSE(goal.button1);
    hold(GuidedHand::kPatienceS - 0.3);
    tip = held;
    follow(hand, tip, 0.2);
    CHECK(tip.x == doctest::Approx(6).epsilon(0.01));
    CHECK(tip.y > -1);
    follow(hand, tip, 2);
    CHECK(norm(tip - kStart.target_mm) < 0.1);
    // And a target moves it from there.
    lead(hand, tip, {.tip_mm = {2, 3, 1}}, 1);
    CHECK(norm(tip - DeviceVec<double>{2, 3, 1}) < 0.01);
    // Who parks presses no pedal on the way.
    hand.set_target({.tip_mm = {2, 3, 1}, .button1 = true, .park = true});
    CHECK_FALSE(hand.next(kStart, tip).button1);
  }
  // On a Falcon the first button parks; the pedal is the driver's first.
  GuidedHand falcon{kStiffness, kerf::FalconModel().route(), kStart.target_mm};
  falcon.set_target({.tip_mm = kStart.target_mm, .button1 = true});
  const HandGoal pressed = falcon.next(kStart, kStart.target_mm);
  CHECK_FALSE(pressed.button1);
  CHECK(pressed.button2);
}

TEST_CASE("a target is decoded as it was encoded, within its limits; other bytes are none") {
  const HandTarget target{.tip_mm = {1.5, -2.25, 499},
                          .orientation_rad = {0.5, -0.25, 0},
                          .button2 = true,
                          .park = true};
  const auto bytes = encode(target);
  CHECK(kerf::decode_hand_target(bytes) == target);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double huge = std::numeric_limits<double>::infinity();
  const auto odd = kerf::decode_hand_target(
      encode(HandTarget{.tip_mm = {nan, huge, -huge}, .orientation_rad = {nan, 9, -9}}));
  REQUIRE(odd);
  CHECK(odd->tip_mm == DeviceVec<double>{0, kerf::kMaxTargetMm, -kerf::kMaxTargetMm});
  CHECK(odd->orientation_rad[1] == doctest::Approx(kerf::kMaxTargetRad));
  auto far = bytes;
  far[11] = 0x80;  // -2147 m
  CHECK(kerf::decode_hand_target(far)->tip_mm.x == -kerf::kMaxTargetMm);
  CHECK_FALSE(kerf::decode_hand_target(std::span(bytes).first(35)));
  CHECK_FALSE(kerf::decode_hand_target({}));
  auto other = bytes;
  other[7] = 2;
  CHECK_FALSE(kerf::decode_hand_target(other));
  other = bytes;
  other[32] = 8;
  CHECK_FALSE(kerf::decode_hand_target(other));
}

TEST_CASE("an emulated hand moves to its start, and only then to the target") {
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const kerf::OmniCommand on{.motors_on = true};
  const auto run = [&](double seconds) {
    for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
      emulator.set_target({.tip_mm = {10, 8, -5}, .orientation_rad = {0, 0.3, 0}});
      emulator.receive(encode(on));
      emulator.advance(160);
    }
  };
  run(0.04);
  CHECK(emulator.model().docked());
  run(0.16);
  CHECK_FALSE(emulator.model().docked());
  CHECK(emulator.model().tip_mm().z < -20);
  run(1.7);
  CHECK(norm(emulator.model().tip_mm() - DeviceVec<double>{10, 8, -5}) < 0.5);
}

TEST_CASE(
    "a hand that parks rests in the inkwell, whatever targets come meanwhile, and comes back") {
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const DeviceVec<double> target{4, -3, 2};
  int docked = 0;
  const auto run = [&](double seconds, bool park) {
    for (int frames = static_cast<int>(seconds * 50); frames > 0; --frames) {
      emulator.set_target({.tip_mm = target, .park = park});
      emulator.receive(encode(kerf::OmniCommand{.motors_on = true}));
      emulator.advance(160);
      docked += emulator.model().docked() ? 1 : 0;
    }
  };
  run(2.5, false);
  CHECK(norm(emulator.model().tip_mm() - target) < 0.5);
  docked = 0;
  run(0.1, true);
  run(4, false);
  CHECK(docked * 0.02 >= GuidedHand::kParkedS - 0.05);
  run(2, false);
  CHECK_FALSE(emulator.model().docked());
  CHECK(norm(emulator.model().tip_mm() - target) < 0.5);
}

namespace {

constexpr int kAccept = kSecond / 20;  // cycles until a window is accepted

/// A hand at its start.
class Ready {
 public:
  Ready() {
    const kerf::OmniCommand on{.motors_on = true};
    emulator.receive(encode(on));
    emulator.advance(2 * kerf::kCyclesPerSecond);
    REQUIRE(emulator.accepts_target());
  }
  kerf::Emulator emulator{kerf::OmniParams{}, kerf::HandScript{}};
};

/// The window.
class FakeWindow {
 public:
  explicit FakeWindow(const std::string& path) : fd_(socket(AF_UNIX, SOCK_SEQPACKET, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    REQUIRE(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  FakeWindow(const FakeWindow&) = delete;
  FakeWindow& operator=(const FakeWindow&) = delete;
  ~FakeWindow() { close(fd_); }

  [[nodiscard]] std::optional<HandGreeting> greeting() const {
    std::array<std::uint8_t, 64> bytes{};
    const ssize_t size = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size <= 0) return std::nullopt;
    return kerf::decode_hand_greeting({bytes.data(), static_cast<std::size_t>(size)});
  }
  void send(std::span<const std::uint8_t> bytes) const {
    static_cast<void>(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }

 private:
  int fd_;
};

}  // namespace

TEST_CASE("one window leads the hand; a second gets `taken`, until the first has gone") {
  const kerf::test::TemporaryFolder folder;
  const std::string path = folder / "hand";
  kerf::HandServer server(path);
  Ready hand;
  kerf::Emulator& emulator = hand.emulator;
  std::optional<FakeWindow> first(path);
  server.lead(emulator, kAccept);
  CHECK(first->greeting() == HandGreeting::yours);
  const FakeWindow second(path);
  server.lead(emulator, kAccept);
  CHECK(second.greeting() == HandGreeting::taken);
  first->send(encode(HandTarget{}));
  server.lead(emulator, 1);
  CHECK(server.targets() == 1);
  first.reset();
  server.lead(emulator, 1);
  const FakeWindow third(path);
  server.lead(emulator, kAccept);
  CHECK(third.greeting() == HandGreeting::yours);
}

TEST_CASE("a packet that is no target is dropped and counted, and a flood is taken in parts") {
  const kerf::test::TemporaryFolder folder;
  const std::string path = folder / "hand";
  kerf::HandServer server(path);
  Ready hand;
  kerf::Emulator& emulator = hand.emulator;
  const FakeWindow window(path);
  server.lead(emulator, kAccept);
  const auto target = encode(HandTarget{});
  std::array<std::uint8_t, 200> noise{};
  window.send(noise);
  window.send(std::span(target).first(20));
  window.send(target);
  server.lead(emulator, 1);
  CHECK(server.targets() == 1);
  CHECK(server.refused() == 2);
  for (int i = 0; i < 40; ++i) window.send(target);
  server.lead(emulator, 1);
  CHECK(server.targets() == 17);
  for (int i = 0; i < 3; ++i) server.lead(emulator, 1);
  CHECK(server.targets() > 17);
}

TEST_CASE("a window waits until the hand is at its start") {
  const kerf::test::TemporaryFolder folder;
  const std::string path = folder / "hand";
  kerf::HandServer server(path);
  kerf::Emulator emulator(kerf::OmniParams{}, kerf::HandScript{});
  const FakeWindow window(path);
  server.lead(emulator, kAccept);
  CHECK_FALSE(window.greeting());
  emulator.receive(encode(kerf::OmniCommand{.motors_on = true}));
  emulator.advance(2 * kerf::kCyclesPerSecond);
  server.lead(emulator, kAccept);
  CHECK(window.greeting() == HandGreeting::yours);
}

TEST_CASE("a hand socket in no folder is refused by the name of its option") {
  CHECK(kerf::test::error_of<kerf::HilError>([] {
          kerf::HandServer("/nowhere/at/all");
        }).starts_with("--hand-socket: /nowhere/at/all"));
}

}  // namespace kerf::hand_test
