// SPDX-License-Identifier: Apache-2.0
// The study, which lab/report makes a page and a plot of.
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "lab/accuracy/proxy_study.hpp"
#include "lab/accuracy/study.hpp"

namespace kerf::accuracy_study_test {

using namespace kerf::accuracy;

namespace {

Scope small() {
  return {.effort = {.sample_loop_steps = 50, .tool_loop_steps = 8, .line_steps = 4, .normals = 50},
          .contacts = 4,
          .walks = 1,
          .side_mm = 5,
          .ticks = 3};
}

/// A whole study of a few contacts; made once.
const std::vector<Entry>& small_study() {
  static const std::vector<Entry> entries = study(small(), [](double, const std::string&) {});
  return entries;
}

const Entry& entry(std::string_view knob, std::string_view value) {
  const auto& entries = small_study();
  const auto found = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) {
    return e.knob == knob && e.value == value;
  });
  REQUIRE(found != entries.end());
  return *found;
}

std::size_t count_of(const std::string& what, const std::string& text) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("a study gives the same figures every time, whatever the times") {
  const auto untimed = [](std::vector<Entry> entries) {
    for (Entry& e : entries) e.times = {};
    return csv(entries);
  };
  const std::string first = untimed(small_study());
  CHECK(count_of("\n", first) > 500);
  CHECK(first == untimed(study(small(), [](double, const std::string&) {})));
}

TEST_CASE("the standard is one measurement that every knob shows") {
  const Entry& q15 = entry("arithmetic", "Q15");
  for (const auto& [knob, value] : {std::array{"pitch", "1"},
                                    {"kernel", "farid"},
                                    {"storage", "int16 gradients"},
                                    {"interpolation", "trilinear"},
                                    {"voxel", "0.125 mm"}}) {
    const Entry& same = entry(knob, value);
    CHECK(same.standard);
    CHECK(same.times.p50_ns == q15.times.p50_ns);
    CHECK(*same.find("force_vs_theory_rms") == *q15.find("force_vs_theory_rms"));
  }
  CHECK_FALSE(entry("storage", "aligned").standard);
}

TEST_CASE("all is the worst of the shapes, and times grow to their largest") {
  for (const Entry& e : small_study()) {
    double worst = 0;
    for (const char* shape : {"plane", "ball", "torus", "plate", "crease", "layered ball"}) {
      REQUIRE(e.find("force_vs_theory_max", shape) != nullptr);
      worst = std::max(worst, *e.find("force_vs_theory_max", shape));
    }
    CHECK(*e.find("force_vs_theory_max") == worst);
    CHECK(e.times.p50_ns > 0);
    CHECK(e.times.p50_ns <= e.times.p99_ns);
    CHECK(e.times.p99_ns <= e.times.max_ns);
  }
}

TEST_CASE("what is timed by plain loops of the lab is marked, and nothing else") {
  for (const char* plain : {"Q8", "Q12"}) CHECK(entry("arithmetic", plain).plain);
  CHECK_FALSE(entry("arithmetic", "double").plain);
  CHECK(entry("storage", "spline 3").plain);
  CHECK(entry("interpolation", "nearest").plain);
  CHECK_FALSE(entry("storage", "aligned 0.0625 mm").plain);
}

TEST_CASE("the default contact is near its truth on every shape, and nearer in finer voxels") {
  const auto of_scope = [](const ProxySubject& subject) {
    Scope scope = small();
    scope.contacts = 12;
    return proxy_study(scope, subject, [](double, const std::string&) {});
  };
  const std::vector<Entry> entries = of_scope(ProxySubject::standard());
  const auto one = [&](std::string_view knob, std::size_t nth) -> const Entry& {
    for (const Entry& entry : entries) {
      if (entry.knob == knob && nth-- == 0) return entry;
    }
    FAIL("no such entry");
    return entries.front();
  };
  const Entry& standard = one("proxy voxel", 1);
  CHECK(standard.standard);
  for (const char* shape : {"plane", "ball", "torus", "plate", "crease", "layered ball"}) {
    CAPTURE(std::string(shape));
    // The limits of docs/contact.md; a curved face is pushed in by the ramp's width squared.
    CHECK(*standard.find("depth_max", shape) < 0.05);
    CHECK(*standard.find("depth_max", shape) > 0);
    CHECK(*standard.find("force_direction_max", shape) < 1);
    CHECK(*standard.find("force_vs_theory_max", shape) < 0.1);
    CHECK(*standard.find("step_max", shape) < 0.01);
    for (const Entry& entry : entries) {  // all kernels give the same bits
      if (entry.knob != "proxy kernels") continue;
      CHECK(*entry.find("depth_max", shape) == *standard.find("depth_max", shape));
      CHECK(*entry.find("step_max", shape) == *standard.find("step_max", shape));
    }
  }
  // In millimetres: a voxel half as wide has half of an equal figure.
  CHECK(*one("proxy voxel", 0).find("depth_rms") > *standard.find("depth_rms"));
  CHECK(*one("proxy voxel", 2).find("depth_rms") < *standard.find("depth_rms"));
  CHECK(*one("proxy numbers", 1).find("depth_max") ==
        doctest::Approx(*standard.find("depth_max")).epsilon(0.02));
  CHECK(*one("proxy spacing", 2).find("samples", "any") > 2 * *standard.find("samples", "any"));

  const SceneTool fissure =
      make_tool("fissure", "cylinder", {.pitch_mm = 0.1, .radius_mm = 0.5, .length_mm = 4});
  const std::vector<Entry> of_tool = of_scope({fissure, 0.1});
  CHECK(of_tool.front().find("depth_max", "plane") != nullptr);
  CHECK(of_tool.front().find("depth_max", "ball") == nullptr);
  CHECK(*of_tool.front().find("depth_max") < 0.075);  // docs/contact.md, a cylinder in any pose
}

}  // namespace kerf::accuracy_study_test
