// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/study.hpp"

#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "lab/accuracy/subjects.hpp"
#include "shared/text/json.hpp"

namespace kerf::accuracy {
namespace {

struct Variant {
  const char* knob;
  const char* value;
  ContactChoice choice;
  bool against_double = false;
};

/// Each knob from coarse to fine. Other voxels come last: each edge has its own volumes.
std::vector<Variant> variants() {
  using enum Arithmetic;
  using K = GradientKernel;
  using S = Storage;
  using I = Interpolation;
  return {
      {"arithmetic", "Q8", {.arithmetic = q8}, true},
      {"arithmetic", "Q12", {.arithmetic = q12}, true},
      {"arithmetic", "Q15", {}, true},
      {"arithmetic", "double", {.arithmetic = float64}},
      {"pitch", "2", {.pitch_vox = 2}},
      {"pitch", "1", {}},
      {"pitch", "1/2", {.pitch_vox = 0.5}},
      {"pitch", "1/4", {.pitch_vox = 0.25}},
      {"kernel", "central", {.kernel = K::central}},
      {"kernel", "sobel5", {.kernel = K::sobel5}},
      {"kernel", "farid", {}},
      {"storage", "int16 gradients", {}, true},
      {"storage", "aligned", {.storage = S::aligned}, true},
      {"storage", "splat", {.storage = S::splat}, true},
      {"storage", "spline 2", {.storage = S::spline, .interpolation = I::quadratic}},
      {"storage", "spline 3", {.storage = S::spline, .interpolation = I::cubic}},
      {"interpolation", "nearest", {.interpolation = I::nearest}},
      {"interpolation", "trilinear", {}},
      {"interpolation", "quadratic", {.interpolation = I::quadratic}},
      {"interpolation", "cubic", {.interpolation = I::cubic}},
      {"voxel", "0.25 mm", {.voxel_mm = 2 * kVoxelMm}},
      {"voxel", "0.125 mm", {}},
      {"voxel", "0.0625 mm", {.voxel_mm = kVoxelMm / 2}},
      {"storage", "aligned 0.0625 mm", {.storage = S::aligned, .voxel_mm = kVoxelMm / 2}},
  };
}

using Figures = std::vector<Figure>;

void add(Figures& figures, const std::string& shape, const std::string& metric,
         const ErrorStats& spread, const char* unit) {
  if (spread.count() == 0) return;
  figures.push_back({shape, metric + "_rms", spread.rms(), unit});
  figures.push_back({shape, metric + "_max", spread.worst(), unit});
}

void add(Figures& figures, const std::string& shape, const ContactErrors& errors) {
  add(figures, shape, "force_vs_theory", errors.theory, "full scale");
  add(figures, shape, "force_direction", errors.direction_deg, "deg");
  add(figures, shape, "normal", errors.normal_deg, "deg");
  add(figures, shape, "loop_sample", errors.sample_loop, "work share");
  add(figures, shape, "loop_tool", errors.tool_loop, "work share");
  add(figures, shape, "step", errors.step, "full scale");
}

/// Ticks on the ball along a loop, as a hand moves: from place to near place.
TickTimes time_contact(const ContactMethod& method, const ContactCase& at, int ticks) {
  const TiltedLoop loop{at.contacts.front().centre_mm, at.contacts.front().normal};
  volatile double sink = 0;  // so that the compiler keeps the sum
  return time_ticks(
      ticks, [] {},
      [&](int i) {
        const Point place = loop.place_mm(static_cast<double>(i) / ticks);
        sink = method.tool_sum(at.volume.voxel_from_mm(place)).x;
      });
}

Entry measured(const Variant& variant, const std::vector<TestShape>& subjects, const Scope& scope) {
  const ContactChoice& choice = variant.choice;
  const BallTool tool = ball_tool(kToolMm, choice.pitch_vox * choice.voxel_mm);
  Entry entry;
  Figures& figures = entry.figures;
  ContactErrors all;
  ErrorStats all_differences;
  for (const TestShape& subject : subjects) {
    ContactErrors errors;
    ErrorStats differences;
    for (const ContactCase& at : subject.cases) {
      const auto method = contact_method(choice, at.volume, tool);
      add_errors(*method, at, tool, scope.effort, errors);
      if (variant.against_double) {
        const auto truth = contact_method({.arithmetic = Arithmetic::float64}, at.volume, tool);
        add_difference(*method, *truth, at, tool, differences);
      }
      if (subject.name == "ball") {
        entry.times = time_contact(*method, at, scope.ticks);
        figures.push_back(
            {"any", "memory", static_cast<double>(method->bytes_per_voxel()), "bytes a voxel"});
        figures.push_back({"any", "samples", static_cast<double>(tool.offsets.size()), "1"});
      }
    }
    add(figures, subject.name, errors);
    add(figures, subject.name, "force_vs_double", differences, "full scale");
    all.theory.add(errors.theory);
    all.direction_deg.add(errors.direction_deg);
    all.normal_deg.add(errors.normal_deg);
    all.sample_loop.add(errors.sample_loop);
    all.tool_loop.add(errors.tool_loop);
    all.step.add(errors.step);
    all_differences.add(differences);
  }
  add(figures, "all", all);
  add(figures, "all", "force_vs_double", all_differences, "full scale");
  figures.push_back({"noise", "noise_gain", noise_gain(choice, tool), "1/voxel"});
  if (choice.storage == Storage::gradients && choice.interpolation == Interpolation::trilinear) {
    add(figures, "corners", "interpolation", interpolation_error(choice.arithmetic), "steps");
  }
  return entry;
}

/// log2 of how much smaller the error of theory gets with each halving of the voxel.
void add_orders(std::vector<Entry>& entries) {
  const Entry* coarser = nullptr;
  for (Entry& entry : entries) {
    if (entry.knob != "voxel") continue;
    std::vector<Figure> orders;
    for (const Figure& fine : entry.figures) {
      if (coarser == nullptr || fine.metric != "force_vs_theory_rms") continue;
      const double* coarse = coarser->find(fine.metric, fine.shape);
      orders.push_back({fine.shape, "order", std::log2(*coarse / fine.figure), "1"});
    }
    entry.figures.insert(entry.figures.end(), orders.begin(), orders.end());
    coarser = &entry;
  }
}

}  // namespace

const double* Entry::find(std::string_view metric, std::string_view shape) const {
  for (const Figure& figure : figures) {
    if (figure.metric == metric && figure.shape == shape) return &figure.figure;
  }
  return nullptr;
}

std::vector<Entry> study(
    const Scope& scope,
    const std::function<void(double share, const std::string& what)>& progress) {
  progress(0, "contacts");
  const Subjects touched(scope.contacts, scope.walks);
  const std::vector<Variant> list = variants();
  std::optional<double> voxel_mm;
  std::vector<TestShape> subjects;
  std::optional<Entry> standard;  // the one that every knob has
  std::vector<Entry> entries;
  for (const Variant& variant : list) {
    progress(static_cast<double>(entries.size()) / static_cast<double>(list.size()),
             std::string(variant.knob) + " " + variant.value);
    const bool is_standard = variant.choice == ContactChoice{};
    Entry entry;
    if (is_standard && standard) {
      entry = *standard;
    } else {
      if (voxel_mm != variant.choice.voxel_mm) {
        subjects = {};  // one set in memory at a time
        subjects = touched.in_voxels(variant.choice.voxel_mm, scope.side_mm);
        voxel_mm = variant.choice.voxel_mm;
      }
      entry = measured(variant, subjects, scope);
    }
    entry.knob = variant.knob;
    entry.value = variant.value;
    entry.standard = is_standard;
    entry.plain = !is_servos(variant.choice);
    if (is_standard) standard = entry;
    entries.push_back(std::move(entry));
  }
  add_orders(entries);
  return entries;
}

std::string csv(const std::vector<Entry>& entries) {
  std::string text = "knob,value,shape,metric,figure,unit,us_p50,us_p99,us_max\n";
  for (const Entry& entry : entries) {
    char times[64];
    std::snprintf(times, sizeof times, "%.3f,%.3f,%.3f\n", entry.times.p50_ns / 1e3,
                  entry.times.p99_ns / 1e3, entry.times.max_ns / 1e3);
    for (const Figure& figure : entry.figures) {
      char value[32];
      std::snprintf(value, sizeof value, "%.6g", figure.figure);
      text += entry.knob + ',' + entry.value + ',' + figure.shape + ',' + figure.metric + ',' +
              value + ',' + figure.unit + ',' + times;
    }
  }
  return text;
}

std::string json(const std::vector<Entry>& entries, int core) {
  Json report;
  report["core"] = core;
  report["provenance"] = lab_provenance();
  report["rows"] = Json::List{};
  for (const Entry& entry : entries) {
    for (const Figure& figure : entry.figures) {
      report["rows"].push_back({{"knob", entry.knob},
                                {"value", entry.value},
                                {"standard", entry.standard},
                                {"plain", entry.plain},
                                {"shape", figure.shape},
                                {"metric", figure.metric},
                                {"figure", figure.figure},
                                {"unit", figure.unit},
                                {"us_p50", entry.times.p50_ns / 1e3},
                                {"us_p99", entry.times.p99_ns / 1e3},
                                {"us_max", entry.times.max_ns / 1e3}});
    }
  }
  return report.document();
}

}  // namespace kerf::accuracy
