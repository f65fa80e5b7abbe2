// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/frame_report.hpp"

#include <ctime>

#include "shared/numeric/statistics.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"

namespace kerf {

namespace {

constexpr double kNsPerMs = 1e6;

std::int64_t process_cpu_ns() {
  std::timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  return std::int64_t{time.tv_sec} * kNsPerS + std::int64_t{time.tv_nsec};
}

Json spread(std::vector<double> values) {
  return {{"p50", percentile(values, 0.50)},
          {"p95", percentile(values, 0.95)},
          {"p99", percentile(values, 0.99)},
          {"max", percentile(values, 1.0)}};
}

}  // namespace

Stopwatch::Stopwatch() : wall_(std::chrono::steady_clock::now()), cpu_ns_(process_cpu_ns()) {}

double Stopwatch::wall_ms() const {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall_)
      .count();
}

double Stopwatch::cpu_ms() const {
  return static_cast<double>(process_cpu_ns() - cpu_ns_) / kNsPerMs;
}

void FrameReport::write(const std::filesystem::path& file) const {
  Json report{{"renderer", renderer},       {"gl_renderer", gl_renderer},
              {"context", context},         {"width", width},
              {"height", height},           {"frames", wall_ms.size()},
              {"cpu_ms", spread(cpu_ms)},   {"wall_ms", spread(wall_ms)},
              {"redrawn", spread(redrawn)}, {"latency_ms", spread(latency_ms)},
              {"rest_frames", rest_frames}, {"bricks_uploaded", bricks_uploaded},
              {"attach_ms", attach_ms},     {"late_join_ms", late_join_ms},
              {"clean_end", clean_end}};
  if (!pointer_ms.empty()) report["pointer_ms"] = spread(pointer_ms);
  write_new_file(file, report.document());
}

}  // namespace kerf
