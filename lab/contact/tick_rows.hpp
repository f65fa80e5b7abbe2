// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/geometry.hpp"

/// Search for the input that makes a tick of the swept contact cost most.
namespace kerf::extremes {

/// A body and a place at its surface, about which a hand looks for the tick that costs most.
struct WorstCase {
  std::string name;
  std::function<Body()> body;  ///< made while it is needed: tens of MB
  Point middle;
  Density iso;
};

/// Solids that cost a query or a sweep much: flat, sharp, hollow, hardly wider than the tool,
/// noisy, and tissue with contact everywhere and solid nowhere; and the tooth of a CT, if `data`
/// has it. Throws LoadError if that cannot be read.
[[nodiscard]] std::vector<WorstCase> worst_cases(const std::filesystem::path& data);

/// The costliest tick that was found.
struct WorstTick {
  double us = 0;
  int queries = 0;
  std::string at;            ///< name of the worst case
  std::int64_t samples = 0;  ///< as `QueryWork` counts
};

/// Ticks of `follow` from a proxy that is placed or looks for a place, for goals near and far;
/// those whose one run took longest are repeated, from the same state and so alike to the bit, and
/// of each the fastest repetition counts: time taken by other programs does not count, the cost of
/// the input does.
void find_worst_tick(const SceneTool& tool, const WorstCase& worst_case, const Body& body,
                     int ticks, WorstTick& worst);

}  // namespace kerf::extremes
