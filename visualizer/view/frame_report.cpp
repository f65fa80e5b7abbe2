// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/frame_report.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "shared/text/json.hpp"
#include "visualizer/view/file_out.hpp"

namespace kerf {

namespace {

constexpr double kNsPerMs = 1e6;

std::int64_t process_cpu_ns() {
  std::timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  return std::int64_t{time.tv_sec} * kNsPerS + std::int64_t{time.tv_nsec};
}

Json spread(const std::vector<double>& values) {
  return {{"p50", percentile(values, 0.50)},
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

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  constexpr double kRounding = 1e-9;  // 0.28 * 25 is a hair above 7
  const double rank = std::ceil(share * static_cast<double>(values.size()) - kRounding);
  const std::size_t at = std::min(static_cast<std::size_t>(std::max(rank, 1.0)), values.size()) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

void FrameReport::write(const std::filesystem::path& file) const {
  const Json report{{"renderer", renderer},       {"gl_renderer", gl_renderer},
                    {"context", context},         {"width", width},
                    {"height", height},           {"frames", wall_ms.size()},
                    {"cpu_ms", spread(cpu_ms)},   {"wall_ms", spread(wall_ms)},
                    {"redrawn", spread(redrawn)}, {"latency_ms", spread(latency_ms)},
                    {"rest_frames", rest_frames}, {"bricks_uploaded", bricks_uploaded},
                    {"attach_ms", attach_ms},     {"late_join_ms", late_join_ms},
                    {"clean_end", clean_end}};
  const std::string text = report.document();
  write_file(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace kerf
