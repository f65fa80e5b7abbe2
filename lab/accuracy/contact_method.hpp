// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/sampling.hpp"
#include "lab/accuracy/subjects.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

/// Ways to compute the contact force, behind one interface: the choices of an accuracy study, and
/// the parts that their implementations share.
namespace kerf::accuracy {

enum class Arithmetic : std::uint8_t {
  q8,       ///< trilinear weights of 8 bits: less than kerf keeps
  q12,      ///< of 12 bits
  q15,      ///< of 15 bits: the servo's
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
/// `splat` run with their kernels, float64 is the servo's template; all else is plain
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

/// Whether it is code of the servo, its kernels or templates; if not, it is plain code of the lab.
[[nodiscard]] bool is_servos(const ContactChoice& choice);

/// A round tool, sampled as a scene's tool of this radius and pitch would be.
struct BallTool {
  double radius_mm;
  double pitch_mm;
  std::array<std::int32_t, 3> size_pitches;
  std::vector<ToolOffset> offsets;
};
[[nodiscard]] BallTool ball_tool(double radius_mm, double pitch_mm);

/// A choice applied to one volume, which must outlive it. Sums are of the density's gradient over
/// the samples, in full densities per voxel edge; positions in voxels.
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

/// Contact force at a position in mm, relative to p0 pi R^2, the largest force of the ball on a
/// flat: F = -p0 a^3 SUM grad_mm, a the pitch.
[[nodiscard]] Point force_share(const ContactMethod& method, const AnalyticVolume& volume,
                                const BallTool& tool, Point centre_mm);

// Parts that the methods share.

using Voxels = VoxelVec<double>;
using Offsets = std::span<const ToolOffset>;

inline constexpr std::array<ToolOffset, 1> kOneSample{};

/// Unturned.
template <class N>
ToolPose<N> pose_at(Voxels centre, double pitch_vox) {
  using Real = typename N::Real;
  ToolPose<N> pose;
  pose.centre_vox = {Real(centre.x), Real(centre.y), Real(centre.z)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = pitch_vox * double(N::kStepOne);
    if constexpr (N::kIsFixed) {
      pose.step[axis][axis] = static_cast<typename N::Step>(std::lround(step));
    } else {
      pose.step[axis][axis] = static_cast<typename N::Step>(step);
    }
  }
  return pose;
}

/// `unit`: the value of one density step per voxel in the sum.
template <class N>
Voxels full_densities(SumVec<N> sum, double unit) {
  const double scale = 1 / (unit * kDensityMax);
  return {double(sum.x) * scale, double(sum.y) * scale, double(sum.z) * scale};
}

template <class N>
std::vector<Gradient<N>> field_of(GradientKernel kernel, const AnalyticVolume& volume) {
  std::vector<Gradient<N>> field(volume.grid.voxel_count());
  GradientScratch scratch;
  refresh_gradients<N>(kernel, volume.grid, volume.density, volume.grid.box(), field, scratch);
  return field;
}

/// Q0.15 weights rounded half up to `Bits` fraction bits, still in Q0.15: the servo's lerp gives
/// with them the bits that a lerp of `Bits` would give.
template <int Bits>
[[nodiscard]] constexpr VoxelVec<FixedNumbers::Weight> coarse_weights(
    VoxelVec<FixedNumbers::Weight> w) noexcept {
  constexpr int kDropped = 15 - Bits;
  const auto coarse = [](FixedNumbers::Weight v) {
    return static_cast<FixedNumbers::Weight>(round_shift(v, kDropped)) * (1 << kDropped);
  };
  return {coarse(w.x), coarse(w.y), coarse(w.z)};
}

}  // namespace kerf::accuracy
