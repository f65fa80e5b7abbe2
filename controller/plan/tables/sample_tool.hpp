// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/kernel/splat_table.hpp"
#include "controller/kernel/tool_pose.hpp"

namespace kerf {

/// In which order kernels meet a tool's samples; exact sums do not depend on it.
enum class SampleOrder {
  as_given,   ///< neighbours follow each other: good for reading
  scattered,  ///< neighbours are far apart: no addition waits for the one before it
};

/// Owner of one tool's samples for the methods `gather` and `splat`. Load time; moving it keeps the
/// table valid.
class SampleTool {
 public:
  SampleTool(std::span<const ToolOffset> offsets, SampleOrder order);

  [[nodiscard]] SampleTable table() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  std::array<std::vector<std::int32_t>, 3> offset_;
  std::int32_t count_;
};

}  // namespace kerf
