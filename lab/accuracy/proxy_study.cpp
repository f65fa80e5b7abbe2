// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/proxy_study.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/scene/scene.hpp"
#include "lab/accuracy/proxy_errors.hpp"
#include "shared/text/text.hpp"

namespace kerf::accuracy {
namespace {

/// Of a scanned face (docs/theory.md 2.1).
constexpr double kRampVox = 2;

struct ProxyVariant {
  const char* knob;
  std::string value;
  double voxel = 1, spacing = 1;  ///< over the standard's
  NumericKind numeric = NumericKind::fixed;
  const KernelSet* kernels = kernel_sets()[0];
  bool standard = false;
};

/// Each knob from coarse to fine. Other voxels come last: each edge has its own volumes.
std::vector<ProxyVariant> proxy_variants(double voxel_mm) {
  const auto mm = [&](double share) { return format("%g mm", share * voxel_mm); };
  std::vector<ProxyVariant> list{
      {.knob = "proxy numbers", .value = "fixed", .standard = true},
      {.knob = "proxy numbers", .value = "double", .numeric = NumericKind::float64},
      {.knob = "proxy spacing", .value = "1", .standard = true},
      {.knob = "proxy spacing", .value = "1/2", .spacing = 0.5},
      {.knob = "proxy spacing", .value = "1/4", .spacing = 0.25}};
  for (const KernelSet* const* set = kernel_sets(); *set != nullptr; ++set) {
    list.push_back({.knob = "proxy kernels",
                    .value = (*set)->name,
                    .kernels = *set,
                    .standard = set == kernel_sets()});
  }
  list.push_back({.knob = "proxy voxel", .value = mm(2), .voxel = 2});
  list.push_back({.knob = "proxy voxel", .value = mm(1), .standard = true});
  list.push_back({.knob = "proxy voxel", .value = mm(0.5), .voxel = 0.5});
  return list;
}

void add(std::vector<Figure>& figures, const std::string& shape, const ProxyErrors& errors) {
  const auto add_one = [&](const std::string& metric, const ErrorStats& stats, const char* unit) {
    if (stats.count() == 0) return;
    figures.push_back({shape, metric + "_rms", stats.rms(), unit});
    figures.push_back({shape, metric + "_max", stats.worst(), unit});
  };
  add_one("depth", errors.depth_vox, "voxel");
  add_one("force_vs_theory", errors.force, "force");
  add_one("force_direction", errors.direction_deg, "deg");
  add_one("step", errors.step, "force");
}

Entry proxy_entry(const ProxyVariant& variant, const ProxySubject& subject,
                  const std::vector<TestShape>& shapes, double voxel_mm, const Scope& scope) {
  const ProxyTool tool = proxy_tool(subject.tool, voxel_mm, variant.spacing);
  Entry entry;
  ProxyErrors all;
  for (const TestShape& shape : shapes) {
    ProxyErrors errors;
    for (const ContactCase& at : shape.cases) {
      add_proxy_errors(tool, variant.numeric, *variant.kernels, at, scope.effort.line_steps,
                       errors);
    }
    add(entry.figures, shape.name, errors);
    all.depth_vox.add(errors.depth_vox);
    all.force.add(errors.force);
    all.direction_deg.add(errors.direction_deg);
    all.step.add(errors.step);
    if (shape.name == (subject.tool.round ? "ball" : "plane")) {
      entry.times =
          time_proxy(tool, variant.numeric, *variant.kernels, shape.cases.front(), scope.ticks);
    }
  }
  add(entry.figures, "all", all);
  entry.figures.push_back(
      {"any", "samples", static_cast<double>(tool.samples.samples.size()), "1"});
  return entry;
}

/// A tool that is no ball may be long: the planes' side holds it, whichever way they are tilted.
std::vector<TestShape> shapes_of(const Subjects& touched, const ProxySubject& subject,
                                 double voxel_mm, const Scope& scope) {
  if (subject.tool.round) return touched.in_voxels(voxel_mm, scope.side_mm, kRampVox);
  const double unit_mm = voxel_mm * subject.tool.radius_mm / kToolMm;
  double reach = 0;
  for (const SurfaceSample& sample : SampledTool(subject.tool, unit_mm).close) {
    reach = std::max(reach, std::hypot(sample.at[0], sample.at[1], sample.at[2]));
  }
  constexpr double kAroundVox = 8;
  return {touched.planes_in_voxels(voxel_mm, 2 * (reach + kAroundVox) * voxel_mm, kRampVox)};
}

}  // namespace

ProxySubject ProxySubject::standard() {
  return {make_tool("ball", "ball", {.pitch_mm = kVoxelMm, .radius_mm = kToolMm}), kVoxelMm};
}

std::vector<Entry> proxy_study(
    const Scope& scope, const ProxySubject& subject,
    const std::function<void(double share, const std::string& what)>& progress) {
  progress(0, "contacts");
  const Subjects touched(scope.contacts, scope.walks);
  const std::vector<ProxyVariant> list = proxy_variants(subject.voxel_mm);
  std::optional<double> voxel;
  std::vector<TestShape> shapes;
  std::optional<Entry> standard;
  std::vector<Entry> entries;
  for (const ProxyVariant& variant : list) {
    progress(static_cast<double>(entries.size()) / static_cast<double>(list.size()),
             std::string(variant.knob) + " " + variant.value);
    Entry entry;
    bool too_fine = false;
    if (variant.standard && standard) {
      entry = *standard;
    } else {
      const double voxel_mm = variant.voxel * subject.voxel_mm * kToolMm / subject.tool.radius_mm;
      if (voxel != variant.voxel) {
        shapes = {};  // one set in memory at a time
        shapes = shapes_of(touched, subject, voxel_mm, scope);
        voxel = variant.voxel;
      }
      try {
        entry = proxy_entry(variant, subject, shapes, voxel_mm, scope);
      } catch (const LoadError&) {
        too_fine = true;
      }
    }
    entry.knob = variant.knob;
    entry.value = variant.value + (too_fine ? ", too many" : "");
    entry.standard = variant.standard;
    if (variant.standard) standard = entry;
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace kerf::accuracy
