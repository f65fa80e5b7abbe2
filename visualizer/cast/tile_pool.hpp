// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace kerf {

/// Threads that share out numbered pieces of work, as many as this process has cores when the pool
/// is made: `place_process` has taken the servo's core away by then. The caller works too, so one
/// core needs no thread.
class TilePool {
 public:
  /// `workers` beside the caller; by default one less than the cores.
  explicit TilePool(int workers = default_workers());
  TilePool(const TilePool&) = delete;
  TilePool& operator=(const TilePool&) = delete;
  ~TilePool();

  /// Calls `work(i)` once for each i in 0..count-1, on any thread, and returns after the last. One
  /// caller at a time; `work` must not throw.
  void run(std::uint32_t count, const std::function<void(std::uint32_t)>& work);

 private:
  [[nodiscard]] static int default_workers();
  void wait_for_work();
  void take_pieces();

  const std::function<void(std::uint32_t)>* work_ = nullptr;
  std::uint32_t count_ = 0;
  std::atomic<std::uint32_t> next_{0};
  std::atomic<std::uint32_t> round_{0};  ///< odd: the pool ends
  std::atomic<std::uint32_t> busy_{0};   ///< workers that have not finished this round
  std::vector<std::jthread> workers_;
};

}  // namespace kerf
