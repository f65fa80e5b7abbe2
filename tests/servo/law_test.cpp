// SPDX-License-Identifier: Apache-2.0
// Laws of a test's own file in the whole servo step: what they see, what holds whatever they give.
#include "controller/law/law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/law/registry/law_registry.hpp"
#include "tests/servo/support.hpp"

namespace kerf::law_test {

using namespace kerf::test;

namespace {

constexpr std::array kEveryNumber{NumericKind::fixed, NumericKind::float64};

/// What a law saw in the last tick, for the cases below.
struct Seen {
  std::array<double, 3> spring_mm, normal, moved_mm;
  std::uint32_t ticks = 0;
  std::uint32_t age = 0;  ///< steps since its state began anew
} seen;

template <class V>
std::array<double, 3> doubles(V v) {
  return {double(v.x), double(v.y), double(v.z)};
}

/// The spring alone, stiff as it is told; 0: nothing but NaN, and in fixed point, which has none,
/// nothing but a failure.
template <class N>
class PlainSpring {
 public:
  static constexpr const char* kName = "plain_spring";
  static constexpr const char* kMeaning = "a spring without a damper";
  static constexpr std::array<LawSetting, 1> kSettings{{{"k", "N/mm", 0, 100, 0.4, "stiffness"}}};
  struct State {
    std::uint32_t age = 0;
  };
  explicit PlainSpring(const LawSetup& setup) : k_(typename N::Ratio(setup["k"])) {}
  LawForce<typename N::Real> step(const ForceInput<N>& in, State& state) const noexcept {
    using Real = typename N::Real;
    seen.spring_mm = doubles(in.spring_mm);
    seen.normal = doubles(in.normal);
    seen.age = ++state.age;
    if (!(k_ > typename N::Ratio(0))) {
      if constexpr (N::kIsFixed) return LawForce<Real>::failed();
      return DeviceVec<Real>{Real(std::numeric_limits<double>::quiet_NaN()), {}, {}};
    }
    return DeviceVec<Real>{multiply<Real>(k_, in.spring_mm.x), multiply<Real>(k_, in.spring_mm.y),
                           multiply<Real>(k_, in.spring_mm.z)};
  }

 private:
  typename N::Ratio k_;
};
KERF_REGISTER_FORCE_LAW(PlainSpring)

/// Gives no force up to 0.2 mm, and beyond no number.
template <class N>
class Breaker {
 public:
  static constexpr const char* kName = "breaker";
  static constexpr const char* kMeaning = "fails in a press";
  static constexpr std::array<LawSetting, 0> kSettings{};
  struct State {};
  explicit Breaker(const LawSetup&) {}
  DeviceVec<typename N::Real> step(const ForceInput<N>& in, State&) const noexcept {
    using Real = typename N::Real;
    if (norm(in.spring_mm) < Real(0.2)) return {};
    return {Real(std::numeric_limits<double>::quiet_NaN()), {}, {}};
  }
};
KERF_REGISTER_FORCE_LAW(Breaker)

/// Gives the wanted force times `share`, and `push_n` along x.
template <class N>
class Changer {
 public:
  static constexpr const char* kName = "changer";
  static constexpr const char* kMeaning = "changes the force";
  static constexpr std::array<LawSetting, 2> kSettings{
      {{"push_n", "N", -1e4, 1e4, 0, "added along x"}, {"fails", "", 0, 1, 0, "gives NaN"}}};
  struct State {
    std::uint32_t age = 0;
  };
  explicit Changer(const LawSetup& setup)
      : push_n_(typename N::Real(setup["push_n"])), fails_(setup["fails"] > 0) {}
  DeviceVec<typename N::Real> step(const StabiliserInput<N>& in, State& state) const noexcept {
    seen.moved_mm = doubles(in.moved_mm);
    seen.ticks = in.ticks;
    seen.age = ++state.age;
    if (fails_) return {in.wanted_n.x, typename N::Real(std::nan("")), {}};
    return {in.wanted_n.x + push_n_, in.wanted_n.y, in.wanted_n.z};
  }

 private:
  typename N::Real push_n_;
  bool fails_;
};
KERF_REGISTER_STABILISER(Changer)

/// 1 mm/s in every direction; after 300 reports NaN.
template <class N>
class Sleeper {
 public:
  static constexpr const char* kName = "sleeper";
  static constexpr const char* kMeaning = "fails late";
  static constexpr std::array<LawSetting, 0> kSettings{};
  struct State {
    std::uint32_t age = 0;
  };
  explicit Sleeper(const LawSetup&) {}
  DeviceVec<typename N::Real> step(const VelocityInput<N>& in, State& state) const noexcept {
    using Real = typename N::Real;
    REQUIRE(in.first == (state.age == 0));
    const bool fails = ++state.age > 300;
    return {Real(1), Real(fails ? std::nan("") : 1.0), Real(1)};
  }
};
KERF_REGISTER_VELOCITY_ESTIMATOR(Sleeper)

/// Reads a setting that it does not list.
template <class N>
struct Reader {
  static constexpr const char* kName = "reader";
  static constexpr const char* kMeaning = "is wrong";
  static constexpr std::array<LawSetting, 0> kSettings{};
  struct State {};
  explicit Reader(const LawSetup& setup) { static_cast<void>(setup["gain"]); }
  DeviceVec<typename N::Real> step(const VelocityInput<N>&, State&) const noexcept { return {}; }
};
KERF_REGISTER_VELOCITY_ESTIMATOR(Reader)

LoadedScene with_force_law(NumericKind numeric, double k) {
  LoadedScene scene = half_space_scene();
  scene.servo.numeric = numeric;
  scene.force.law = {LawKind::force, "plain_spring", {{"k", k}}};
  return scene;
}
LoadedScene with_stabiliser(NumericKind numeric, double push_n, double fails) {
  LoadedScene scene = half_space_scene();
  scene.servo.numeric = numeric;
  scene.force.stabiliser = {LawKind::stabiliser, "changer", {{"push_n", push_n}, {"fails", fails}}};
  return scene;
}

/// A press of 0.3 mm, a slide, a lift: the hash of all that was sent.
std::uint64_t hash_of_a_touch(LoadedScene scene) {
  ArmedServo armed(scene);
  ServoOutput out;
  for (int tick = 0; tick < 400; ++tick) {
    const double t = tick / 400.0;
    out = armed.step(2 * t, 1.2 - 1.5 * std::sin(6 * t), 0.3 * t);
  }
  return out.output_hash;
}

}  // namespace

TEST_CASE("a spring as a law of its own is the coupling without its damper, bit by bit") {
  for (const NumericKind numeric : kEveryNumber) {
    LoadedScene coupling = half_space_scene();
    coupling.servo.numeric = numeric;
    coupling.force.damping_ns_per_mm = 0;
    LoadedScene law = with_force_law(numeric, 0.4);
    ArmedServo a(coupling), b(law);
    for (int tick = 0; tick < 300; ++tick) {
      const double y_mm = 1.2 - tick * 0.005;
      const ServoOutput out = a.step(0.1, y_mm, 0.2), own = b.step(0.1, y_mm, 0.2);
      for (std::size_t i = 0; i < 3; ++i) {
        REQUIRE(std::abs(out.contact_force_n[i] - own.contact_force_n[i]) <
                1e-4);  // each rounds its own way
      }
    }
    CHECK(seen.spring_mm[1] > 0.5);
    CHECK(seen.normal[1] == doctest::Approx(1).epsilon(1e-3));
    CHECK(length(b.settled(0.1, 3, 0.2).commanded_force_n) == 0);
    CHECK(seen.spring_mm == std::array<double, 3>{});
    CHECK(seen.normal == std::array<double, 3>{});
  }
}

TEST_CASE(
    "a law that gives no number: motors off in that tick, its kind latched, parking clears it") {
  LoadedScene force = with_force_law(NumericKind::float64, 0),
              fixed_force = with_force_law(NumericKind::fixed, 0),
              stabiliser = with_stabiliser(NumericKind::float64, 0, 1);
  for (auto* scene : {&force, &fixed_force, &stabiliser}) {
    const Fault fault = scene == &stabiliser ? Fault::stabiliser : Fault::force_law;
    auto servo = compile(*scene);
    KinematicOmni arm;
    for (int round = 0; round < 2; ++round) {
      arm_at(*servo, arm, 0, 5, 0);
      const ServoOutput out = servo->step(arm.at(0, 5, 0));
      CHECK(out.fault == fault);
      CHECK_FALSE(out.motors_on);
      CHECK(out.commanded_force_n == std::array<double, 3>{});
      CHECK(out.contact_force_n == std::array<double, 3>{});
      CHECK(out.dac_counts == std::array<std::int16_t, 3>{});
    }
  }
}

TEST_CASE("what the overlap removes in the tick in which a law fails is counted, and comes back") {
  LoadedScene scene = half_space_scene();
  scene.servo.numeric = NumericKind::float64;
  scene.force.law = {LawKind::force, "breaker", {}};
  scene.cut.model = CutModel::overlap;
  scene.cut.rate_per_s = 500;
  ArmedServo armed(scene);
  const std::span<const Density> density = armed.servo->density(0);
  const std::vector<Density> before(density.begin(), density.end());
  static_cast<void>(armed.settled(0, 1.2, 0));
  const ServoOutput out = armed.step(0, 0.6, 0);
  REQUIRE(out.fault == Fault::force_law);
  CHECK(length(out.contact_force_n) == 0);  // of what the law gave nothing is told
  CHECK(length(out.proxy_offset_mm) == 0);
  CHECK(armed.servo->penetration_mm() == 0);
  std::uint64_t gone = 0;
  for (std::size_t i = 0; i < before.size(); ++i) gone += before[i] - density[i];
  CHECK(gone > 0);
  CHECK(out.removed_by_volume[0] == gone);
  CHECK_FALSE(out.changed[0].empty());
  armed.servo->apply({.kind = ServoCommand::Kind::reset});
  for (int tick = 0; tick < 2000; ++tick) static_cast<void>(armed.step(0, 5, 0));
  CHECK(std::ranges::equal(before, density));
}

TEST_CASE("a velocity that is no number is told as 0 and latches a fault of its own") {
  LoadedScene scene = half_space_scene();
  scene.servo.numeric = NumericKind::float64;
  scene.servo.velocity = {LawKind::velocity, "sleeper", {}};
  auto servo = compile(scene);
  KinematicOmni arm;
  arm_at(*servo, arm, 0, 5, 0);
  ServoOutput out;
  int ticks = 0;
  do {
    out = servo->step(arm.at(0, 5, 0));
    if (out.fault == Fault::none) CHECK(out.velocity_mm_per_s == std::array<double, 3>{1, 1, 1});
  } while (out.fault == Fault::none && ++ticks < 400);
  CHECK(out.fault == Fault::velocity_estimator);
  CHECK_FALSE(out.motors_on);
  CHECK(out.velocity_mm_per_s == std::array<double, 3>{});
  CHECK(servo->step(arm.at(0, 5, 0)).velocity_mm_per_s == std::array<double, 3>{1, 1, 1});  // anew
}

TEST_CASE("a stabiliser that changes nothing changes no bit") {
  for (const NumericKind numeric : kEveryNumber) {
    LoadedScene plain = half_space_scene();
    plain.servo.numeric = numeric;
    CHECK(hash_of_a_touch(plain) == hash_of_a_touch(with_stabiliser(numeric, 0, 0)));
    CHECK(hash_of_a_touch(plain) != hash_of_a_touch(with_stabiliser(numeric, 0.01, 0)));
  }
}

TEST_CASE("whatever a stabiliser gives, peak, slope and budget of the motors hold") {
  for (const NumericKind numeric : kEveryNumber) {
    for (const double push_n : {-1e4, -5.0, 5.0, 1e4}) {
      LoadedScene scene = with_stabiliser(numeric, push_n, 0);
      scene.limits.force_n = 2;
      ArmedServo armed(scene);
      double last_n = length(armed.step(0, 5, 0).commanded_force_n), most_n = 0;
      for (int tick = 0; tick < 30000; ++tick) {
        const double now_n = length(armed.step(0, 5, 0).commanded_force_n);
        REQUIRE(now_n <= 2);
        REQUIRE(now_n <= last_n + 0.5 + 1e-4);
        last_n = now_n;
        most_n = std::max(most_n, now_n);
      }
      CHECK(most_n > 1.9);
      CHECK(last_n < 1.1);  // 0.88 N root mean square for ever
    }
  }
}

TEST_CASE("a limit that acted is told, and what a stabiliser did is none") {
  for (const NumericKind numeric : kEveryNumber) {
    const auto settled = [&](double push_n) {
      LoadedScene scene = with_stabiliser(numeric, push_n, 0);
      ArmedServo armed(scene);
      return armed.settled(0, 5, 0);  // in the air
    };
    const ServoOutput within = settled(0.05), beyond = settled(5);
    CHECK(length(within.commanded_force_n) == doctest::Approx(0.05).epsilon(1e-3));
    CHECK_FALSE(within.clamped);
    CHECK(beyond.clamped);
  }
}

TEST_CASE("a stabiliser sees the motion over a gap, and nothing while reports are missing") {
  LoadedScene scene = with_stabiliser(NumericKind::fixed, 0, 0);
  ArmedServo armed(scene);
  const std::array<double, 3> before = armed.settled(0, 5, 0).position_mm;
  const std::uint32_t age = seen.age;
  for (int tick = 0; tick < 3; ++tick) static_cast<void>(armed.servo->step({}));
  CHECK(seen.age == age);
  const std::array<double, 3> after = armed.step(0, 5.4, 0).position_mm;
  CHECK(seen.ticks == 4);
  for (std::size_t i = 0; i < 3; ++i) CHECK(seen.moved_mm[i] == after[i] - before[i]);
}

TEST_CASE("a law begins anew where the hand was not felt") {
  for (LoadedScene scene :
       {with_force_law(NumericKind::fixed, 0.4), with_stabiliser(NumericKind::fixed, 0, 0)}) {
    ArmedServo armed(scene);
    static_cast<void>(armed.settled(0, 5, 0));
    CHECK(seen.age > 20);
    armed.servo->apply({.kind = ServoCommand::Kind::hold, .argument = 1});
    static_cast<void>(armed.settled(0, 5, 0));
    armed.servo->apply({.kind = ServoCommand::Kind::hold, .argument = 0});
    static_cast<void>(armed.step(0, 5, 0));
    CHECK(seen.age == 1);
  }
}

TEST_CASE("two laws of one name are refused, whoever asks") {
  LawRow twin = find_law(LawKind::velocity, "sleeper");
  twin.next = std::exchange(first_own_law, &twin);
  CHECK_THROWS_WITH(static_cast<void>(known_laws(LawKind::velocity)),
                    "two laws of this program are the velocity estimator \"sleeper\"; give one "
                    "another kName");
  first_own_law = twin.next;
  CHECK(known_laws(LawKind::velocity).size() == 4);
}

TEST_CASE(
    "a backward difference is exact on a line, over gaps too, and its filter is of first order") {
  for (const NumericKind numeric : kEveryNumber) {
    for (const double tau_ms : {0.0, 5.0, 1000.0}) {
      LoadedScene scene = half_space_scene();
      scene.servo.numeric = numeric;
      scene.servo.velocity = {LawKind::velocity, "difference", {{"tau_ms", tau_ms}}};
      ArmedServo armed(scene);
      ServoOutput last = armed.step(0, 5, 0);
      std::array<double, 3> y = last.velocity_mm_per_s;
      for (const int gap : {1, 1, 3, 1, 7, 1, 1}) {
        for (int missed = 1; missed < gap; ++missed) last = armed.servo->step({});
        CHECK(last.velocity_mm_per_s == y);  // it stands
        const ServoOutput out = armed.step(0.3 * gap, 5 + 0.2 * gap, 0);
        const double kept = std::pow(tau_ms / (tau_ms + 1), gap);
        for (std::size_t i = 0; i < 3; ++i) {
          const double v = (out.position_mm[i] - last.position_mm[i]) * 1000 / gap;
          CHECK(out.velocity_mm_per_s[i] == doctest::Approx(v + kept * (y[i] - v)).epsilon(1e-3));
        }
        last = out;
        y = out.velocity_mm_per_s;
      }
    }
  }
}

TEST_CASE("a law that a scene names and the program has not is refused with the known ones") {
  const auto refusal = [](const LawChoice& law) -> std::string {
    LoadedScene scene = half_space_scene();
    scene.force.law = law;
    try {
      static_cast<void>(compile(scene));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  CHECK(refusal({LawKind::force, "plane_spring", {}}) ==
        "test: force.law \"plane_spring\" is unknown; did you mean \"plain_spring\"? known: "
        "breaker, plain_spring");
  CHECK(refusal({LawKind::force, "plain_spring", {{"k", 101}}}) ==
        "test: force.law \"plain_spring\".k = 101 is out of range; use 0 to 100");
  LoadedScene scene = half_space_scene();
  scene.servo.velocity.name = "reader";
  CHECK_THROWS_WITH(
      static_cast<void>(compile(scene)),
      "test: servo.velocity \"reader\" reads a setting gain that its kSettings do not "
      "list; add it there");
  CHECK(refusal({LawKind::force, "plain_spring", {{"b", 1}}}) ==
        "test: force.law \"plain_spring\".b = 1 is unknown; known: k");
}

}  // namespace kerf::law_test
