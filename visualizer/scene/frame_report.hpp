// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kerf {

/// Wall and processor time of one stretch of work. Processor time is summed over all threads of the
/// process: the steady figure if a software GL draws on several cores that others use too.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] double wall_ms() const;
  [[nodiscard]] double cpu_ms() const;

 private:
  std::chrono::steady_clock::time_point wall_;
  std::int64_t cpu_ns_;
};

/// What a run measured; times in ms, per drawn frame. A frame in which nothing had changed is a
/// rest frame: nothing is drawn for it.
struct FrameReport {
  std::string renderer{};
  std::string gl_renderer{};
  std::string context{};
  int width = 0;
  int height = 0;
  std::uint64_t bricks_uploaded = 0;
  double attach_ms = 0.0;     ///< from asking for the controller to its first complete volumes
  double late_join_ms = 0.0;  ///< from there to the first picture: textures, shaders, drawing
  bool clean_end = false;
  std::uint64_t rest_frames = 0;
  std::vector<double> cpu_ms{};
  std::vector<double> wall_ms{};
  std::vector<double> redrawn{};  ///< fraction of the picture whose volumes were drawn again

  /// From the oldest tick that removed material which a frame was the first to show, to the end of
  /// drawing that frame; of frames that showed none, nothing.
  std::vector<double> latency_ms{};

  /// From the begin of the frame that saw the pointer move a hand whose tool rested, to the end of
  /// drawing the first one with the tool elsewhere. The event itself came up to a frame earlier.
  std::vector<double> pointer_ms{};

  /// Writes the report as JSON, whole or not at all; throws FileError.
  void write(const std::filesystem::path& file) const;
};

}  // namespace kerf
