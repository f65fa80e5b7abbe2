// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "lab/accuracy/analytic_shapes.hpp"

namespace kerf::accuracy {

// What an accuracy study varies.

enum class Arithmetic : std::uint8_t {
  q8,       ///< trilinear weights of 8 bits: less than kerf keeps
  q12,      ///< of 12 bits
  q15,      ///< of 15 bits: what the servo runs
  float32,  ///< the servo's float
  float64,  ///< the servo's double, the truth of the others
};
enum class Interpolation : std::uint8_t { nearest, trilinear, quadratic, cubic };
enum class Storage : std::uint8_t {
  gradients,  ///< kept for every voxel, as in the method `gather`
  aligned,    ///< none: the method `aligned`
  splat,      ///< none: the method `splat`
  spline,     ///< none: the derivative of the density's B-spline, quadratic or cubic
};

/// One way to compute the contact force. In fixed point the servo's methods `gather`, `aligned` and
/// `splat` run with their kernels, float32 and float64 are the servo's templates; all else is plain
/// text of the lab: the interpolations in double, the coarse weights through the servo's own lerp.
struct ContactChoice {
  Arithmetic arithmetic = Arithmetic::q15;
  double pitch_vox = 1;  ///< of the tool's samples
  GradientKernel kernel = GradientKernel::farid;
  Storage storage = Storage::gradients;
  Interpolation interpolation = Interpolation::trilinear;
  double voxel_mm = 0.125;

  friend bool operator==(const ContactChoice&, const ContactChoice&) = default;
};

/// Whether the servo has it, in its kernels or templates; else it is the lab's plain text.
[[nodiscard]] bool is_servos(const ContactChoice& choice);

/// A round tool, sampled as a scene's tool of this radius and pitch would be.
struct BallTool {
  double radius_mm;
  double pitch_mm;
  std::array<std::int32_t, 3> size_pitches;
  std::vector<ToolOffset> offsets;
};
[[nodiscard]] BallTool ball_tool(double radius_mm, double pitch_mm);

/// A choice at work on one volume, which it refers to. Sums are of the density's gradient over the
/// samples, in full densities per voxel edge; places in voxels.
class ContactMethod {
 public:
  ContactMethod() = default;
  virtual ~ContactMethod() = default;
  ContactMethod(const ContactMethod&) = delete;
  ContactMethod& operator=(const ContactMethod&) = delete;

  [[nodiscard]] virtual VoxelVec<double> tool_sum(VoxelVec<double> centre) const = 0;
  /// Of a tool that is one sample.
  [[nodiscard]] virtual VoxelVec<double> sample(VoxelVec<double> at) const = 0;
  /// Memory beyond the density's two bytes.
  [[nodiscard]] virtual std::size_t bytes_per_voxel() const = 0;
};

[[nodiscard]] std::unique_ptr<ContactMethod> contact_method(const ContactChoice& choice,
                                                            const AnalyticVolume& volume,
                                                            const BallTool& tool);

/// Contact force at a place in mm over p0 pi R^2, the largest that the ball can feel on a flat:
/// F = -p0 a^3 SUM grad_mm, a the pitch.
[[nodiscard]] Point force_share(const ContactMethod& method, const AnalyticVolume& volume,
                                const BallTool& tool, Point centre_mm);

}  // namespace kerf::accuracy
