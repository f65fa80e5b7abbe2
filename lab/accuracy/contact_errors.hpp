// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "lab/accuracy/contact_method.hpp"
#include "lab/accuracy/subjects.hpp"

namespace kerf::accuracy {

/// Errors of many cases: their root mean square and the largest.
class ErrorStats {
 public:
  void add(double error) noexcept {
    square_ += error * error;
    worst_ = std::max(worst_, std::abs(error));
    ++count_;
  }
  void add(const ErrorStats& other) noexcept {
    square_ += other.square_;
    worst_ = std::max(worst_, other.worst_);
    count_ += other.count_;
  }
  [[nodiscard]] double rms() const noexcept {
    return count_ == 0 ? 0 : std::sqrt(square_ / static_cast<double>(count_));
  }
  [[nodiscard]] double worst() const noexcept { return worst_; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

 private:
  double square_ = 0, worst_ = 0;
  std::size_t count_ = 0;
};

/// Errors of a method. Forces are relative to p0 pi R^2. Loop work is |SUM dW| relative to
/// SUM |dW| along the loop.
struct ContactErrors {
  ErrorStats theory;         ///< |F - F_theory|
  ErrorStats direction_deg;  ///< between the two, if theory has at least a tenth of full scale
  ErrorStats normal_deg;     ///< of one sample at the voxels on the face, against the true normal
  ErrorStats sample_loop;    ///< closed loops of one sample about a point on the face
  ErrorStats tool_loop;      ///< closed loops of the whole tool about the contact
  ErrorStats step;           ///< |dF| per kStepMm along the face
};

inline constexpr double kLoopMm = 0.375;    ///< radius of the loops: 3 voxels of 0.125 mm
inline constexpr double kStepMm = 0.00125;  ///< 0.01 of such a voxel

/// How far the measurement goes.
struct ErrorCases {
  int sample_loop_steps = 2000;
  int tool_loop_steps = 500;
  int line_steps = 300;
  std::size_t normals = 4000;  ///< voxels of a case, at most
};

void add_errors(const ContactMethod& method, const ContactCase& at, const BallTool& tool,
                const ErrorCases& effort, ContactErrors& errors);

/// |F - F_double| of the same contacts.
void add_difference(const ContactMethod& method, const ContactMethod& truth, const ContactCase& at,
                    const BallTool& tool, ErrorStats& errors);

using ForceAt = std::function<Point(Point)>;

/// A circle that is tilted to the face: it rises along the normal as it goes along the face.
struct TiltedLoop {
  Point centre_mm, normal;

  [[nodiscard]] Point place_mm(double turn) const;  ///< `turn` 0..1
  /// |SUM dW| / SUM |dW|: zero for a force with a potential (haptics: no energy from nothing).
  [[nodiscard]] double work(const ForceAt& force, int steps) const;
};

/// Standard deviation of the gradient, per axis, for white noise of deviation one in every voxel.
[[nodiscard]] double noise_gain(const ContactChoice& choice, const BallTool& tool);

/// One trilinear interpolation of random 16-bit corners against double, in steps of the corners;
/// 8 bits of the result are kept. Not for float64, which is the truth.
[[nodiscard]] ErrorStats interpolation_error(Arithmetic arithmetic);

}  // namespace kerf::accuracy
