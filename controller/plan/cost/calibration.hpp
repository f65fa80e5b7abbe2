// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "controller/plan/scene_costs.hpp"

namespace kerf {

/// What an operation of each stage costs on this machine, for predictions that a person reads. It
/// never decides anything.
struct Calibration {
  std::string machine;                     ///< name of the processor
  std::map<std::string, double> price_ns;  ///< by "way/stage": "aligned/avx512/copy"

  /// Predicted us of a stage of the plan `way`; nothing where a price is missing.
  [[nodiscard]] std::optional<double> stage_us(const std::string& variant,
                                               const StageCost& stage) const;
};

/// Measures anew, on the calling thread's core: the median over tools of several shapes and sizes
/// in a solid block, timed as a scene's tools are. Takes a few seconds.
[[nodiscard]] Calibration measure_calibration();

/// $XDG_CACHE_HOME/kerf/calibration.json, else below ~/.cache; empty where there is neither.
[[nodiscard]] std::filesystem::path calibration_path();

/// JSON text of a calibration, and back. `parse_calibration` throws std::runtime_error with one
/// line for text that is none: every price is a finite positive number.
[[nodiscard]] std::string calibration_json(const Calibration& calibration);
[[nodiscard]] Calibration parse_calibration(const std::string& text);

/// The stored one where it is sound, of this version and of this machine, and has a price for every
/// stage of `costs`; else measured and stored. What is wrong with a stored one, or with the place,
/// is told in one line and is no error.
[[nodiscard]] Calibration calibration_of_machine(const std::filesystem::path& path, bool renew,
                                                 const SceneCosts& costs);

}  // namespace kerf
