// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/proxy_errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace kerf::accuracy {
namespace {

template <class N>
class Presser {
 public:
  Presser(const ProxyTool& tool, const KernelSet& kernels, const ContactCase& at)
      : at_(at), rig_(tool.samples, kernels) {
    rig_.add(at.volume, plain_frame<N>());
    plan_.rotation_step = rig_.rotation_step();
    plan_.ramp_per_tick = Real(kFarUnits);  // at once
  }

  void lift() { state_ = {}; }

  /// The spring in mm after one tick with the hand at a place; keeps the proxy's.
  Point tick(Point hand_mm) {
    const auto hand = at_.volume.voxel_from_mm(hand_mm);
    rig_.field().begin_tick();
    const ProxyContact<N> contact =
        rig_.follow(plan_, state_, {{Real(hand.x), Real(hand.y), Real(hand.z)}, {}});
    if (contact.status != ProxyStatus::placed) {
      proxy_mm_ = hand_mm;
      return {};
    }
    const auto& centre = contact.pose.centre;
    proxy_mm_ = at_.volume.mm_from_voxel({double(centre.x), double(centre.y), double(centre.z)});
    const Point spring{double(contact.spring.x), double(contact.spring.y),
                       double(contact.spring.z)};
    return at_.volume.voxel_mm * spring;
  }
  [[nodiscard]] Point proxy_mm() const { return proxy_mm_; }

 private:
  using Real = typename N::Real;
  static constexpr double kFarUnits = 1000;

  const ContactCase& at_;
  ContactRig<N> rig_;
  ProxyPlan<N> plan_;
  ProxyState<N> state_;
  Point proxy_mm_;
};

/// Where the tool's centre should rest.
Point rest_of(const ProxyTool& tool, const Contact& contact) {
  const double to_face_mm = kToolMm - contact.depth_mm;
  const Point face = contact.centre_mm - to_face_mm * contact.normal;
  return face + tool.support_mm(contact.normal) * contact.normal;
}

double degrees_between(Point a, Point b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

template <class N>
void add_errors(const ProxyTool& tool, const KernelSet& kernels, const ContactCase& at,
                int line_steps, ProxyErrors& errors) {
  constexpr int kDown = 40, kStill = 20;
  constexpr double kAboveVox = 3, kLeast = 0.1;  // of the radius: shorter springs have no direction
  Presser<N> presser(tool, kernels, at);
  std::size_t walks = 0;
  for (const Contact& contact : at.contacts) {
    const Point n = contact.normal, rest = rest_of(tool, contact);
    // A contact that also reaches another face rests elsewhere.
    if (at.shape.distance_mm(rest) < kToolMm - 1e-6 && tool.samples.round) continue;
    const Point above = rest + kAboveVox * at.volume.voxel_mm * n;
    const Point hand = rest - contact.depth_mm * n;
    presser.lift();
    Point spring;
    for (int tick = 0; tick <= kDown + kStill; ++tick) {
      const double part = std::min(1.0, double(tick) / kDown);
      spring = presser.tick(above + part * (hand - above));
    }
    errors.depth_vox.add(dot(presser.proxy_mm() - rest, n) / at.volume.voxel_mm);
    if (contact.depth_mm < kLeast * kToolMm) continue;
    errors.force.add(norm(spring) / contact.depth_mm - 1);
    errors.direction_deg.add(degrees_between(spring, n));
    if (walks++ >= at.walks) continue;
    const Point along = unit(cross(n, std::abs(n.x) < 0.7 ? Point{1, 0, 0} : Point{0, 1, 0}));
    for (int step = 1; step <= line_steps; ++step) {
      const Point next = presser.tick(hand + step * kStepMm * along);
      errors.step.add(norm(next - spring) / contact.depth_mm);
      spring = next;
    }
  }
}

template <class N>
TickTimes time_of(const ProxyTool& tool, const KernelSet& kernels, const ContactCase& at,
                  int ticks) {
  Presser<N> presser(tool, kernels, at);
  const Contact& contact = at.contacts.front();
  const TiltedLoop loop{rest_of(tool, contact) - kToolMm / 2 * contact.normal, contact.normal};
  return time_ticks(
      ticks, [] {}, [&](int i) { presser.tick(loop.place_mm(static_cast<double>(i) / ticks)); });
}

}  // namespace

ProxyTool proxy_tool(const SceneTool& tool, double voxel_mm, double spacing) {
  SampledTool samples(tool, voxel_mm * tool.radius_mm / kToolMm, spacing);
  if (tool.round) return {std::move(samples), [](Point) { return kToolMm; }};
  const auto support = [close = samples.close, voxel_mm](Point n) {
    double farthest = 0;
    for (const auto& [at, normal] : close) {
      farthest = std::max(farthest, -(at[0] * n.x + at[1] * n.y + at[2] * n.z));
    }
    return farthest * voxel_mm;
  };
  return {std::move(samples), support};
}

void add_proxy_errors(const ProxyTool& tool, NumericKind numeric, const KernelSet& kernels,
                      const ContactCase& at, int line_steps, ProxyErrors& errors) {
  if (numeric == NumericKind::fixed) {
    add_errors<FixedNumbers>(tool, kernels, at, line_steps, errors);
  } else {
    add_errors<DoubleNumbers>(tool, kernels, at, line_steps, errors);
  }
}

TickTimes time_proxy(const ProxyTool& tool, NumericKind numeric, const KernelSet& kernels,
                     const ContactCase& at, int ticks) {
  return numeric == NumericKind::fixed ? time_of<FixedNumbers>(tool, kernels, at, ticks)
                                       : time_of<DoubleNumbers>(tool, kernels, at, ticks);
}

}  // namespace kerf::accuracy
