// SPDX-License-Identifier: Apache-2.0
// Laws that do what no law may: each is told in one line, and the lab goes on.
#include "controller/run/law_trial.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "tests/lab/lab_line.hpp"

namespace kerf::law_trial_test {
namespace {

std::vector<double>* g_kept = nullptr;  // what a law allocates; else the compiler leaves it out
volatile bool g_for_ever = true;

void raise_error() {
  if (g_for_ever) throw std::runtime_error("never");
}

/// Which of its sins a law commits in double.
enum class Sin { none, no_number, allocates, loops, throws, exits };

template <class N, Sin kSin>
struct Sinner {
  static constexpr const char* kMeaning = "for a test";
  static constexpr std::array<LawSetting, 1> kSettings{{{"gain", "", 0, 4, 1, "of the spring"}}};
  struct State {};
  explicit Sinner(const LawSetup& setup) : gain(setup["gain"]) {}
  DeviceVec<typename N::Real> step(const ForceInput<N>& in, State&) const noexcept {
    if (!std::is_same_v<N, DoubleNumbers>) return in.spring_mm;
    if (kSin == Sin::no_number && gain > 3) {
      return {typename N::Real(std::sqrt(double(in.spring_mm.x))), {}, {}};
    }
    if (kSin == Sin::allocates) g_kept = new std::vector<double>(3);
    while (kSin == Sin::loops && g_for_ever) continue;
    if (kSin == Sin::throws) raise_error();
    if (kSin == Sin::exits) std::_Exit(3);
    return in.spring_mm;
  }
  double gain;
};
template <class N>
struct Fine : Sinner<N, Sin::none> {
  static constexpr const char* kName = "fine";
  using Sinner<N, Sin::none>::Sinner;
};
template <class N>
struct Rooter : Sinner<N, Sin::no_number> {
  static constexpr const char* kName = "rooter";
  using Sinner<N, Sin::no_number>::Sinner;
};
template <class N>
struct Hoarder : Sinner<N, Sin::allocates> {
  static constexpr const char* kName = "hoarder";
  using Sinner<N, Sin::allocates>::Sinner;
};
template <class N>
struct Looper : Sinner<N, Sin::loops> {
  static constexpr const char* kName = "looper";
  using Sinner<N, Sin::loops>::Sinner;
};
template <class N>
struct Thrower : Sinner<N, Sin::throws> {
  static constexpr const char* kName = "thrower";
  using Sinner<N, Sin::throws>::Sinner;
};
template <class N>
struct Leaver : Sinner<N, Sin::exits> {
  static constexpr const char* kName = "leaver";
  using Sinner<N, Sin::exits>::Sinner;
};
KERF_REGISTER_FORCE_LAW(Fine)
KERF_REGISTER_FORCE_LAW(Rooter)
KERF_REGISTER_FORCE_LAW(Hoarder)
KERF_REGISTER_FORCE_LAW(Looper)
KERF_REGISTER_FORCE_LAW(Thrower)
KERF_REGISTER_FORCE_LAW(Leaver)

/// Of the trial in double; the one in fixed point has no flaw.
std::string fault_of(const char* law) {
  const auto trials = try_law(find_law(LawKind::force, law));
  REQUIRE(trials.size() == 2);
  CHECK(trials[0].fault.empty());
  CHECK(trials[1].fault.find('\n') == std::string::npos);
  return trials[1].fault;
}

}  // namespace

TEST_CASE("a law that does what it may passes its trial, with every set of settings") {
  for (const auto& trial : try_law(find_law(LawKind::force, "fine"))) {
    CHECK(trial.fault.empty());
    CHECK(trial.steps == 5 * 20'000);
  }
  for (const LawKind kind : {LawKind::velocity, LawKind::stabiliser}) {
    for (const LawRow* row : known_laws(kind)) {
      CAPTURE(row->name);
      for (const auto& trial : try_law(*row)) CHECK(trial.fault.empty());
    }
  }
}

TEST_CASE("a law that gives no number is told with settings and input") {
  const std::string fault = fault_of("rooter");
  CHECK(fault.find("gave something that is no finite number with gain = 4 at spring_mm [-") == 0);
  CHECK(fault.ends_with("; look for a division by 0 and for sums that overflow"));
}

TEST_CASE("a law that loops for ever ends in its trial") {
  const std::string fault = fault_of("looper");
  CHECK(fault.find("did not end its steps in 2 s with its defaults at spring_mm [") == 0);
}

TEST_CASE("a law that throws ends its own process alone") {
  CHECK(fault_of("thrower").find("ended the program by signal 6 with its defaults at ") == 0);
}

TEST_CASE("a law that ends the program is told so") {
  CHECK(fault_of("leaver").find("ended the program with exit code 3 with its defaults at ") == 0);
}

#ifndef KERF_SANITIZED
TEST_CASE("a law that allocates is told") {
  CHECK(fault_of("hoarder").find("allocates with its defaults at spring_mm [") == 0);
}
#endif

TEST_CASE("a scene's own law is tried before it runs: what would hang is refused, the rest told") {
  LoadedScene scene;
  scene.path = "mine.toml";
  const auto tried = [&](const char* law, std::vector<std::pair<std::string, double>> settings) {
    scene.force.law = {LawKind::force, law, std::move(settings)};
    return try_own_laws(scene);
  };
  scene.servo.numeric = NumericKind::float64;
  CHECK(tried("fine", {}).empty());
  CHECK(tried("rooter", {{"gain", 2}}).empty());  // as the scene sets it
  const auto told = tried("rooter", {{"gain", 4}});
  REQUIRE(told.size() == 1);
  CHECK(told[0].find("mine.toml: force law rooter gave something that is no finite number with "
                     "gain = 4 at spring_mm [-") == 0);
  CHECK_THROWS_WITH_AS(
      tried("looper", {}),
      doctest::Contains("mine.toml: force law looper did not end its steps in 2 s"),
      std::runtime_error);
  CHECK_THROWS_WITH_AS(tried("thrower", {}), doctest::Contains("ended the program by signal 6"),
                       std::runtime_error);
  scene.servo.numeric = NumericKind::fixed;  // in which they do nothing wrong
  CHECK(tried("looper", {}).empty());
  scene.force.law = {};
  scene.force.stabiliser = {LawKind::stabiliser, "passivity", {}};
  CHECK(try_own_laws(scene).empty());
}

TEST_CASE("the lab tries one law by its name, and knows all of them") {
  const auto lab = [](const char* name) {
    const test::LabAnswer answer = test::lab(std::string("laws ") + name);
    return std::to_string(answer.code) + " " + answer.out + answer.err;
  };
  CHECK(lab("fine").find("0 force law fine (fixed): fine in 100000 steps of ") == 0);
  CHECK(lab("rooter").find("1 force law rooter (fixed): fine in ") == 0);
  CHECK(lab("foaw").find("0 velocity estimator foaw (fixed): fine in ") == 0);
  CHECK(lab("roter").find(
            "2 kerf-lab: law roter is unknown; did you mean rooter? known: fine, hoarder") == 0);
}

}  // namespace kerf::law_trial_test
