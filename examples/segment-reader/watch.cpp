// SPDX-License-Identifier: Apache-2.0
// A reader of a running controller, ten times a second until it ends.    watch [NAME]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <thread>

#include <kerf/segment.hpp>

int main(int argc, char** argv) try {
  auto running = kerf::Segment::open(argc > 1 ? argv[1] : "kerf");
  while (running.alive()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    std::size_t bricks = 0;
    running.volume(0, &bricks);  // the densities of the first one: what has changed is copied
    const auto last = running.latest();
    if (!last) continue;
    const auto& [x, y, z] = last->position_mm;
    const auto& [fx, fy, fz] = last->commanded_force_n;
    std::printf("tick %ju: tip %.2f %.2f %.2f mm, force %.2f N, %zu bricks new\n",
                std::uintmax_t{last->tick}, x, y, z, std::hypot(fx, fy, fz), bricks);
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "watch: %s\n", error.what()), 2;
}
