// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "controller/plan/tables/sample_tables.hpp"
#include "tests/kernel/exact_field.hpp"

/// The contact force of an unturned tool of the volume's pitch by each method: SUM_i grad(rho /
/// rho_max) per voxel, so minus it is F / p0 in voxel^2. One test body then serves all methods.
namespace kerf::test {

/// Stored gradients and eight weights a sample.
template <class N>
class Gathered {
 public:
  using Numbers = N;
  static std::string name() { return std::string("gather, ") + N::kName; }

  Gathered(GradientKernel kernel, const TestVolume& volume)
      : volume_(&volume), field_(gradients<N>(kernel, volume)) {}

  [[nodiscard]] std::array<double, 3> at(std::span<const ToolOffset> tool,
                                         const ToolPose<N>& pose) const {
    return contact_gradient<N>(*volume_, field_, tool, pose);
  }

 private:
  const TestVolume* volume_;
  std::vector<Gradient<N>> field_;
};

/// No stored gradients: exact sums at the eight corners of one cell.
class Aligned {
 public:
  using Numbers = FixedNumbers;
  static std::string name() { return "aligned, fixed"; }

  Aligned(GradientKernel kernel, const TestVolume& volume)
      : taps_(exact_taps(kernel)), field_(taps_, volume) {}

  [[nodiscard]] std::array<double, 3> at(std::span<const ToolOffset> tool,
                                         const ToolPose<FixedNumbers>& pose) const {
    const SumVec<FixedNumbers> sum = aligned_contact_sum(taps_, field_, tool, pose);
    constexpr double kScale = 1.0 / (256.0 * kDensityMax);  // 8 kept bits
    return {double(sum.x) * kScale, double(sum.y) * kScale, double(sum.z) * kScale};
  }

 private:
  ExactTaps taps_;
  ExactField field_;
};

}  // namespace kerf::test
