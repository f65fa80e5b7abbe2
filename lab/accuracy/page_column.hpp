// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"
#include "lab/rig/lab_run.hpp"

namespace kerf::accuracy {

/// What a table or a sentence shows: a metric of a shape, scaled to what the title says.
struct PageColumn {
  const char* title;
  const char* metric;
  double scale = 1;
  const char* shape = "all";

  /// Empty where the metric was not measured.
  [[nodiscard]] std::string cell(const Entry& entry) const {
    const double* figure = entry.find(metric, shape);
    return figure == nullptr ? "" : page_number(*figure * scale);
  }
};

namespace column {
inline constexpr double kPercent = 100, kPermille = 1000, kPpm = 1e6;
inline constexpr PageColumn kTheory{"force rms %", "force_vs_theory_rms", kPercent};
inline constexpr PageColumn kTheoryMax{"max %", "force_vs_theory_max", kPercent};
inline constexpr PageColumn kDirection{"direction rms deg", "force_direction_rms"};
inline constexpr PageColumn kDirectionMax{"max deg", "force_direction_max"};
inline constexpr PageColumn kDouble{"against double rms ppm", "force_vs_double_rms", kPpm};
inline constexpr PageColumn kDoubleMax{"max ppm", "force_vs_double_max", kPpm};
inline constexpr PageColumn kNormal{"normal rms deg", "normal_rms", 1, "ball"};
inline constexpr PageColumn kNormalMax{"max deg", "normal_max", 1, "ball"};
inline constexpr PageColumn kCorner{"corner rms", "interpolation_rms", 1, "corners"};
inline constexpr PageColumn kCornerMax{"max", "interpolation_max", 1, "corners"};
inline constexpr PageColumn kSampleLoop{"loop, sample", "loop_sample_rms"};
inline constexpr PageColumn kToolLoop{"loop, tool", "loop_tool_rms"};
inline constexpr PageColumn kStep{"step max permille", "step_max", kPermille};
inline constexpr PageColumn kNoise{"noise", "noise_gain", 1, "noise"};
inline constexpr PageColumn kMemory{"bytes a voxel", "memory", 1, "any"};
inline constexpr PageColumn kSamples{"samples", "samples", 1, "any"};
inline constexpr PageColumn kOrder{"order", "order"};
}  // namespace column

/// The page's part that says what to choose when: fixed sentences, figures of this run. Needs every
/// choice of a whole study.
[[nodiscard]] std::string page_advice(const std::vector<Entry>& entries);

}  // namespace kerf::accuracy
