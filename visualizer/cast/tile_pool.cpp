// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/tile_pool.hpp"

#include "shared/posix/cores.hpp"

namespace kerf {

int TilePool::default_workers() {
  return static_cast<int>(allowed_cores().size()) - 1;
}

TilePool::TilePool(int workers) {
  for (int i = 0; i < workers; ++i) workers_.emplace_back([this] { wait_for_work(); });
}

TilePool::~TilePool() {
  round_.fetch_add(1);
  round_.notify_all();
}

void TilePool::run(std::uint32_t count, const std::function<void(std::uint32_t)>& work) {
  work_ = &work;
  count_ = count;
  next_ = 0;
  busy_ = static_cast<std::uint32_t>(workers_.size());
  round_.fetch_add(2);
  round_.notify_all();
  take_pieces();
  for (std::uint32_t busy = busy_; busy != 0; busy = busy_) busy_.wait(busy);
}

void TilePool::wait_for_work() {
  std::uint32_t round = 0;
  while (true) {
    round_.wait(round);
    round = round_;
    if (round % 2 != 0) return;
    take_pieces();
    if (busy_.fetch_sub(1) == 1) busy_.notify_all();
  }
}

void TilePool::take_pieces() {
  for (std::uint32_t i = next_++; i < count_; i = next_++) (*work_)(i);
}

}  // namespace kerf
