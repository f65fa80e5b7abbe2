// SPDX-License-Identifier: Apache-2.0
// What is made of the measurements: the study, its page and its plot.
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "lab/accuracy/page.hpp"
#include "lab/accuracy/study.hpp"

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

const Entry& entry(const std::string& knob, const std::string& value) {
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

TEST_CASE(
    "the page tells its command, has a row for each choice and no empty figure in a sentence") {
  const std::string text = page(small_study(), "accuracy.svg");
  CHECK(text.find("./kerf lab accuracy --page docs/accuracy.md") != std::string::npos);
  CHECK(text.find("](accuracy.svg)") != std::string::npos);
  for (const Entry& e : small_study()) {
    const std::string name = e.standard ? "**" + e.value + "**" : e.value;
    CHECK(text.find("\n| " + name + " | ") != std::string::npos);
  }
  for (const char* gap : {"  us", " at  ", "rms ()", " is  ", "nan", "inf"}) {
    CHECK(text.find(gap) == std::string::npos);
  }
}

TEST_CASE("times of the lab's own text stand in brackets, and no others") {
  const std::string text = page(small_study(), "accuracy.svg");
  for (const Entry& e : small_study()) {
    const std::string name = e.standard ? "**" + e.value + "**" : e.value;
    const bool of_lab = count_of("\n| " + name + " | (", text) > 0;
    CHECK(of_lab == e.plain);
  }
  for (const char* plain : {"Q8", "Q12"}) CHECK(entry("arithmetic", plain).plain);
  CHECK_FALSE(entry("arithmetic", "double").plain);
  CHECK(entry("storage", "spline 3").plain);
  CHECK(entry("interpolation", "nearest").plain);
  CHECK_FALSE(entry("storage", "aligned 0.0625 mm").plain);
}

TEST_CASE("the plot's front leaves out what another choice beats in time and error") {
  const auto choice = [](const char* value, double us, double error) {
    return Entry{
        "kernel", value, false, {.p50_ns = us * 1e3}, {{"all", "loop_tool_rms", error, ""}}};
  };
  const std::string script =
      plot_script({choice("slow", 20, 1e-5), choice("fast", 1, 1e-3), choice("beaten", 10, 2e-3),
                   choice("hardly better", 15, 0.995e-3)});
  CHECK(script.find("$front << EOD\n1 0.001\n20 1e-05\nEOD\n") != std::string::npos);
  for (const char* label : {"slow", "fast", "beaten"}) {
    CHECK(count_of("set label '" + std::string(label) + "'", script) == 1);
  }
}

TEST_CASE("labels cover neither each other nor marks, and stay in the panel") {
  LabelPlaces places(200, 60);
  places.keep_mark_free(100, 30);
  CHECK(places.place("first", 100, 30)->align == std::string("left"));
  CHECK(places.place("second", 100, 30)->align == std::string("right"));
  CHECK(places.place("third", 100, 30)->y > 30);
  CHECK_FALSE(places.place(std::string(40, 'x'), 100, 30));  // wider than the panel
}
