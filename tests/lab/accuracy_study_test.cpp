// SPDX-License-Identifier: Apache-2.0
// The study, which lab/report makes a page and a plot of.
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

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

}  // namespace kerf::accuracy_study_test
