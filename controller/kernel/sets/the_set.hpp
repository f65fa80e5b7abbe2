// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sets/cover_loops.hpp"
#include "controller/kernel/sets/splat_loops.hpp"

// The end of every set: its own functions and those that are one text for all, as a KernelSet.
// Included after all others; internal linkage, for the reason given at KernelSet.

namespace kerf {
namespace {

constexpr KernelSet the_set(const char* name, bool can_fuse) noexcept {
  return {name,
          kLanes,
          can_fuse,
          copy_box,
          correlate,
          press,
          cut,
          gather,
          place,
          splat,
          press_sums,
          cover,
          cover_sums,
          weigh_row,
          weigh_again,
          add_loads,
          take_steps,
          place_point_samples,
          sum_point_samples,
          read_point_samples,
          sum_close_samples};
}

}  // namespace
}  // namespace kerf
