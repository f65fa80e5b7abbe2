// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <system_error>
#include <thread>
#include <utility>

namespace kerf {

/// A thread that shares in a work; where the system has none left the work is done here, at once,
/// and the thread that is returned is none.
template <class Work>
[[nodiscard]] std::jthread helper_thread(const Work& work) {
  try {
    return std::jthread(work);
  } catch (const std::system_error&) {
    work();
    return {};
  }
}

}  // namespace kerf
