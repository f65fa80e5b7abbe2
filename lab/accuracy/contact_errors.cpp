// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/contact_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "controller/kernel/sampling.hpp"
#include "lab/accuracy/contact_method.hpp"

namespace kerf::accuracy {
namespace {

double angle_deg(Point a, Point b) {
  const double cosine = dot(a, b) / (norm(a) * norm(b));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

/// Two directions along the face, at right angles.
std::array<Point, 2> along_face(Point normal) {
  const Point away = std::abs(normal.x) < 0.5 ? Point{1, 0, 0} : Point{0, 1, 0};
  const Point a = unit(cross(normal, away));
  return {a, cross(normal, a)};
}

/// At most `count` voxels whose centre is within half a voxel of the outer face, away from the
/// border of the volume.
std::vector<VoxelVec<double>> face_voxels(const ContactCase& at, std::size_t count) {
  constexpr std::int32_t kGuard = 4;
  const VoxelGrid& grid = at.volume.grid;
  std::vector<VoxelVec<double>> found;
  for (std::int32_t z = kGuard; z < grid.nz - kGuard; ++z) {
    for (std::int32_t y = kGuard; y < grid.ny - kGuard; ++y) {
      for (std::int32_t x = kGuard; x < grid.nx - kGuard; ++x) {
        // A voxel on the face of full density is neither empty nor full.
        const Density rho = at.volume.density[grid.index(x, y, z)];
        if (rho == 0 || rho == kDensityMax) continue;
        const VoxelVec<double> voxel{double(x), double(y), double(z)};
        const double distance = at.shape.distance_mm(at.volume.mm_from_voxel(voxel));
        if (std::abs(distance) <= at.volume.voxel_mm / 2) found.push_back(voxel);
      }
    }
  }
  if (found.size() <= count) return found;
  std::vector<VoxelVec<double>> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(found[i * found.size() / count]);
  return some;
}

void add_normals(const ContactMethod& method, const ContactCase& at, std::size_t count,
                 ErrorStats& errors) {
  for (const VoxelVec<double>& voxel : face_voxels(at, count)) {
    const Point inward = relabel<WorldSpace>(method.sample(voxel));
    errors.add(angle_deg(-inward, at.shape.normal(at.volume.mm_from_voxel(voxel))));
  }
}

/// Steps along the face: if only the sampling changes the force, all of the change is error.
void add_steps(const ForceAt& force, const Contact& contact, int count, ErrorStats& errors) {
  const Point step = along_face(contact.normal)[0] * kStepMm;
  Point before = force(contact.centre_mm);
  for (int i = 1; i <= count; ++i) {
    const Point now = force(contact.centre_mm + i * step);
    errors.add(norm(now - before));
    before = now;
  }
}

template <class N>
double interpolated(const std::array<std::int16_t, 8>& corner, VoxelVec<typename N::Weight> w) {
  std::array<typename N::Sample, 8> kept{};
  for (std::size_t c = 0; c < 8; ++c) {
    kept[c] = static_cast<typename N::Sample>(corner[c]) * N::kSampleOne;
  }
  return double(trilinear<N>(kept, w)) / double(N::kSampleOne);
}

}  // namespace

Point TiltedLoop::place_mm(double turn) const {
  const auto [a, b] = along_face(normal);
  const Point rising = (normal + a) * std::numbers::sqrt2 * 0.5;
  const double angle = 2 * std::numbers::pi * turn;
  return centre_mm + kLoopMm * (std::cos(angle) * rising + std::sin(angle) * b);
}

double TiltedLoop::work(const ForceAt& force, int steps) const {
  double sum = 0, to_and_fro = 0;
  for (int i = 0; i < steps; ++i) {
    const auto place = [&](double step) { return place_mm((i + step) / steps); };
    const double work = dot(force(place(0.5)), place(1) - place(0));
    sum += work;
    to_and_fro += std::abs(work);
  }
  return to_and_fro > 0 ? std::abs(sum) / to_and_fro : 0;
}

void add_errors(const ContactMethod& method, const ContactCase& at, const BallTool& tool,
                const ErrorCases& effort, ContactErrors& errors) {
  const ForceAt force = [&](Point centre) { return force_share(method, at.volume, tool, centre); };
  const ForceAt sample = [&](Point place) {
    return relabel<WorldSpace>(method.sample(at.volume.voxel_from_mm(place)));
  };
  for (const Contact& contact : at.contacts) {
    const Point felt = force(contact.centre_mm);
    errors.theory.add(norm(felt - contact.force));
    if (norm(contact.force) >= 0.1) errors.direction_deg.add(angle_deg(felt, contact.force));
  }
  for (std::size_t i = 0; i < at.walks; ++i) {
    const Contact& contact = at.contacts[i];
    const Point face = contact.centre_mm - (tool.radius_mm - contact.depth_mm) * contact.normal;
    errors.sample_loop.add(TiltedLoop{face, contact.normal}.work(sample, effort.sample_loop_steps));
    errors.tool_loop.add(
        TiltedLoop{contact.centre_mm, contact.normal}.work(force, effort.tool_loop_steps));
    add_steps(force, contact, effort.line_steps, errors.step);
  }
  add_normals(method, at, effort.normals, errors.normal_deg);
}

void add_difference(const ContactMethod& method, const ContactMethod& truth, const ContactCase& at,
                    const BallTool& tool, ErrorStats& errors) {
  for (const Contact& contact : at.contacts) {
    errors.add(norm(force_share(method, at.volume, tool, contact.centre_mm) -
                    force_share(truth, at.volume, tool, contact.centre_mm)));
  }
}

double noise_gain(const ContactChoice& choice, const BallTool& tool) {
  constexpr std::int32_t kSide = 64, kGuard = 3;
  // Any white noise does, for a gradient is linear in the densities: here all values alike.
  constexpr double kDeviation = 0.28867513459481287;  // 1 / sqrt(12) of full density
  AnalyticVolume noise{{kSide, kSide, kSide}, choice.voxel_mm, {}};
  std::mt19937 random(1);
  for (std::size_t i = 0; i < noise.grid.voxel_count(); ++i) {
    noise.density.push_back(static_cast<Density>(random() >> 16));
  }
  const auto method = contact_method(choice, noise, tool);
  ErrorStats spread;
  for (std::int32_t z = kGuard; z < kSide - kGuard; ++z) {
    for (std::int32_t y = kGuard; y < kSide - kGuard; ++y) {
      for (std::int32_t x = kGuard; x < kSide - kGuard; ++x) {
        const VoxelVec<double> g = method->sample({double(x), double(y), double(z)});
        for (const double component : {g.x, g.y, g.z}) spread.add(component / kDeviation);
      }
    }
  }
  return spread.rms();
}

ErrorStats interpolation_error(Arithmetic arithmetic) {
  constexpr int kCases = 6000;
  std::mt19937 random(5);
  ErrorStats spread;
  for (int n = 0; n < kCases; ++n) {
    std::array<std::int16_t, 8> corner{};
    for (std::int16_t& value : corner) value = static_cast<std::int16_t>(random() >> 16);
    const auto fraction = [&] { return static_cast<double>(random()) * 0x1p-32; };
    VoxelVec<double> t;
    t.x = fraction();
    t.y = fraction();
    t.z = fraction();
    const auto fine = [](double w) {
      return static_cast<FixedNumbers::Weight>(std::lround(w * FixedNumbers::kWeightOne));
    };
    const VoxelVec<FixedNumbers::Weight> w{fine(t.x), fine(t.y), fine(t.z)};
    const double truth = interpolated<DoubleNumbers>(corner, t);
    switch (arithmetic) {
      case Arithmetic::q8:
        spread.add(interpolated<FixedNumbers>(corner, coarse_weights<8>(w)) - truth);
        break;
      case Arithmetic::q12:
        spread.add(interpolated<FixedNumbers>(corner, coarse_weights<12>(w)) - truth);
        break;
      case Arithmetic::q15:
        spread.add(interpolated<FixedNumbers>(corner, w) - truth);
        break;
      case Arithmetic::float64:
        break;
    }
  }
  return spread;
}

}  // namespace kerf::accuracy
