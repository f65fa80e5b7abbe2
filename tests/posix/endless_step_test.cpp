// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <thread>

#include <doctest/doctest.h>

#include "shared/posix/threads.hpp"

namespace kerf::endless_step_test {
namespace {

/// Whether a step of a thread that does `work` over and over seems endless, in so many looks.
template <class Work>
bool seems_endless(const Work& work, int looks) {
  std::atomic<std::uint64_t> steps{0};
  std::jthread thread([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) work(steps);
  });
  kerf::StepWatchdog step(thread.native_handle(), steps, 1);
  for (int i = 0; i < looks; ++i) {
    if (step.look()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

}  // namespace

TEST_CASE("a step that only computes is told from many steps and from a wait") {
  CHECK(seems_endless([](auto&) {}, 100'000));
  CHECK_FALSE(seems_endless([](auto& steps) { ++steps; }, 80));
  CHECK_FALSE(
      seems_endless([](auto&) { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }, 80));
}

}  // namespace kerf::endless_step_test
