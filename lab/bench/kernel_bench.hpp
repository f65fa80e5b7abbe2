// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace kerf {

/// One tick of one kind, by one way of computing it.
struct KernelRow {
  std::string name;     ///< contact/ball16/any
  std::string numeric;  ///< float (the paper) or fixed
  std::string isa;  ///< paper, reference (method `gather`, plain templates), scalar, avx2, avx512
  double p50_ns = 0, p99_ns = 0;
  double baseline_p50_ns = 0;  ///< in this run, the same tick: the paper's form where it has one
  std::size_t bytes = 0;       ///< memory of the tick beyond two bytes a voxel

  [[nodiscard]] double ratio() const noexcept { return baseline_p50_ns / p50_ns; }
};

/// Times the servo's kernels against the paper's form on 256 x 256 x 161 voxels, in this process on
/// this core. `told` hears each row as it is ready. Takes about a minute.
[[nodiscard]] std::vector<KernelRow> bench_kernels(
    const std::function<void(const KernelRow&)>& add_row);

}  // namespace kerf
