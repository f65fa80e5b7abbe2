// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "lab/ranges/combination.hpp"
#include "lab/ranges/interrupted.hpp"

namespace kerf::ranges {

/// `work(i, file)` for all i below `count` on so many threads, each with a scene file of its own;
/// then `done(i, share of all)`, one thread at a time. Throws Interrupted after a signal that asks
/// for the end.
inline void in_parallel(std::size_t count, std::size_t jobs, const SceneFolder& folder,
                        const std::function<void(std::size_t, const std::filesystem::path&)>& work,
                        const std::function<void(std::size_t, double share)>& done) {
  std::atomic<std::size_t> next{0};
  std::size_t ended = 0;
  std::mutex telling;
  const auto run = [&](std::size_t worker) {
    const auto file = folder.path() / ("scene" + std::to_string(worker) + ".toml");
    for (std::size_t i = next++; i < count && !stop_requested(); i = next++) {
      work(i, file);
      const std::lock_guard lock(telling);
      done(i, static_cast<double>(++ended) / static_cast<double>(count));
    }
  };
  {
    std::vector<std::jthread> workers;
    for (std::size_t worker = 1; worker < jobs; ++worker) workers.emplace_back(run, worker);
    run(0);
  }
  end_if_asked();
}

}  // namespace kerf::ranges
