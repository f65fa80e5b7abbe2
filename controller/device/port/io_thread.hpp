// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/posix/cores.hpp"

namespace kerf {

/// Where the threads of a port run that does its input and output by itself: on the servo's core
/// and above the servo, since the hand comes first.
struct IoThread {
  int core = -1;      ///< -1: the last one, as the servo has by default
  int priority = 81;  ///< SCHED_FIFO
};

/// Takes the calling thread there. Without the right to either, packets come and leave later; the
/// servo's own start tells the user.
inline void become(const IoThread& io) noexcept {
  static_cast<void>(pin_to_core(io.core >= 0 ? io.core : allowed_cores().back()));
  static_cast<void>(set_fifo(io.priority));
}

}  // namespace kerf
