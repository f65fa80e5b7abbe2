// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// The methods: ways to compute contact and cut of one tool in one volume. A method is a line here,
/// a step (as splat_step.cpp) and a file for load time (as
/// controller/plan/method/splat_method.cpp): two files, because the loop includes nothing that
/// allocates. All else comes from this list.
///
/// A line: the name, the class of the step, and for which numbers `N` it serves. The order is that
/// of preference: the first that serves is taken, and the last one serves always.
#define KERF_METHODS(METHOD)                                                               \
  /* The swept proxy feels, and nothing is cut. */                                         \
  METHOD(surface, SurfaceStep, true)                                                       \
  /* A correlation of the density with one table (controller/kernel/aligned_table.hpp). */ \
  METHOD(aligned, AlignedStep, N::kIsFixed)                                                \
  /* Weights added up in the volume (controller/kernel/splat_table.hpp). */                \
  METHOD(splat, SplatStep, N::kIsFixed)                                                    \
  /* Stored gradients, weighted at every sample (controller/kernel/contact.hpp). */        \
  METHOD(gather, GatherStep, true)

namespace kerf {

#define KERF_ENUMERATOR(name, Step, serves) name,
enum class Method : std::uint8_t { KERF_METHODS(KERF_ENUMERATOR) };
#undef KERF_ENUMERATOR

}  // namespace kerf
