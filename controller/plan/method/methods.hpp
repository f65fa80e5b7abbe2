// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/plan/method/tool_method.hpp"
#include "controller/servo/method_list.hpp"

namespace kerf {

// One file each, as the list says (method_list.hpp).
#define KERF_DECLARE(name, Step, serves) [[nodiscard]] const ToolMethod& name##_method() noexcept;
KERF_METHODS(KERF_DECLARE)
#undef KERF_DECLARE

struct MethodChoice {
  const ToolMethod* method;
  std::string why;  ///< one reason for a person
};

/// The first method of the list that serves. Throws SceneError for a tool that no method of
/// fixed-point numbers can hold. Load time.
[[nodiscard]] MethodChoice choose_method(const ToolCase& in);

/// What the operations of the method's tick depend on.
[[nodiscard]] TickShape tick_shape(const ToolCase& in, const AlignedTable* table);

/// Entries of the list of a cut by force, at most: groups of voxels for kernels, else voxels.
/// Closer where the method `aligned` has its table.
[[nodiscard]] std::size_t most_listed(const ToolCase& in, const AlignedTable* table);

/// All stages of a tick in the order in which they run: queries, where the proxy is felt, the
/// method's own, and the cut by force, where there is one.
[[nodiscard]] std::vector<StageCost> tick_stages(const ToolMethod& method, const TickShape& shape,
                                                 VoxelIndex box, std::uint64_t queried,
                                                 std::uint64_t covered);

/// Of every stage the most that it does in any pose, at any speed, whatever the content.
[[nodiscard]] std::vector<StageCost> most_stages(const ToolMethod& method, const TickShape& shape,
                                                 const ToolCase& in, std::uint64_t queried);

}  // namespace kerf
