// SPDX-License-Identifier: Apache-2.0
// The servo step under any device and any person: the input's first bytes choose a scene, each
// further byte begins a tick, in which the arm is led, its counters or pots jump, reports are lost,
// flags lie, or a command comes. Nothing is read outside of a volume; every output is a number, the
// tool keeps its size, and the force its limit.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>

#include "controller/input/load_error.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/kinematic_arm.hpp"

namespace {

using kerf::Density;

void require(bool holds) {
  if (!holds) std::abort();
}

/// The input, byte by byte; zeros after its end.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : left_(bytes) {}
  [[nodiscard]] bool empty() const { return left_.empty(); }
  std::uint8_t next() {
    if (left_.empty()) return 0;
    const std::uint8_t byte = left_[0];
    left_ = left_.subspan(1);
    return byte;
  }
  std::uint16_t wide() {
    const std::uint8_t low = next();
    return static_cast<std::uint16_t>(low | next() << 8);
  }
  template <class T, std::size_t kCount>
  T one_of(const T (&values)[kCount]) {
    return values[next() % kCount];
  }

 private:
  std::span<const std::uint8_t> left_;
};

/// A few voxels around `middle_mm`: solid at one side, everywhere, here and there, or noise.
kerf::SceneVolume volume_at(Bytes& in, std::array<double, 3> middle_mm) {
  kerf::SceneVolume volume;
  volume.name = "fuzz";
  const double voxel_mm = in.one_of({0.01, 0.125, 0.3, 2.0});
  kerf::VoxelGrid& grid = volume.image.grid;
  grid = {1 + in.next() % 16, 1 + in.next() % 16, 1 + in.next() % 16};
  for (double& spacing : volume.image.spacing_mm) {
    spacing = voxel_mm * in.one_of({1.0, 1.3, 4.0});
  }
  double square = 0;
  for (double& part : volume.pose.orientation) {
    part = in.next() - 127.5;
    square += part * part;
  }
  for (double& part : volume.pose.orientation) part /= std::sqrt(square);
  // Off the middle by as much as it is large, so that borders come near, too.
  const std::array<std::int32_t, 3> size{grid.nx, grid.ny, grid.nz};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double share = in.next() / 255.0;
    volume.pose.position_mm[axis] =
        middle_mm[axis] - share * size[axis] * volume.image.spacing_mm[axis];
  }
  volume.iso = in.one_of<Density>({1, 3000, 32768, 65535});
  const int kind = in.next() % 4;
  std::uint32_t state = in.next();
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    state = state * 1664525 + 1013904223;
    const auto noise = static_cast<Density>(state >> 16);
    const bool low = i < grid.voxel_count() / 2;
    volume.image.density.push_back(kind == 0   ? Density(low ? 65535 : 0)
                                   : kind == 1 ? Density(65535)
                                   : kind == 2 ? Density(noise > 60000 ? 65535 : 0)
                                               : noise);
  }
  return volume;
}

bool add_tool(Bytes& in, kerf::LoadedScene& scene) {
  const char* const shape = in.one_of({"ball", "cylinder", "cone", "pear", "wheel"});
  kerf::ToolSize size{.pitch_mm = scene.volumes[0].image.spacing_mm[0]};
  size.radius_mm = size.pitch_mm * (0.5 + in.next() / 32.0);
  if (kerf::tool_side_vox(shape, size) > kerf::kMaxToolSide) return false;
  scene.tools.push_back(kerf::make_tool("fuzz", shape, size));
  scene.tools.back().turns = in.next() % 4 != 0;
  if (in.next() % 4 == 0) {
    scene.tools.back().shaft = {.radius_mm = size.radius_mm, .end_mm = 8 * size.radius_mm};
  }
  return true;
}

bool make_scene(Bytes& in, kerf::LoadedScene& scene) {
  using kerf::CutModel, kerf::ForceModel, kerf::NumericKind;
  scene.path = "fuzz";
  scene.device.workspace_scale = in.one_of({1.0, 0.01, 100.0});
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  for (int count = 1 + in.next() % 2; count > 0; --count) {
    scene.volumes.push_back(volume_at(in, {0, 5 * scene.device.workspace_scale, 0}));
  }
  for (int count = 1 + in.next() % 2; count > 0; --count) {
    if (!add_tool(in, scene)) return false;
  }
  scene.force.model = in.one_of({ForceModel::proxy, ForceModel::proxy, ForceModel::paper});
  scene.force.friction = in.one_of({0.0, 0.5});
  scene.cut.model = in.one_of({CutModel::none, CutModel::preston, CutModel::overlap_exact});
  scene.servo.numeric = in.one_of({NumericKind::fixed, NumericKind::fixed, NumericKind::float64});
  scene.servo.rate_hz = in.one_of({1000, 250, 2000});
  return true;
}

/// What the device says next.
void change(Bytes& in, kerf::KinematicOmni& arm, kerf::DeviceReport& report) {
  const std::uint8_t how = in.next();
  switch (how % 5) {
    case 0:  // led anywhere near
      report = arm.at(in.next() / 16.0 - 8, in.next() / 16.0 - 3, in.next() / 16.0 - 8);
      break;
    case 1:
      for (std::int16_t& counts : report.counts) {
        counts = static_cast<std::int16_t>(counts + static_cast<std::int8_t>(in.next()));
      }
      break;
    case 2:
      for (std::int16_t& counts : report.counts) counts = static_cast<std::int16_t>(in.wide());
      break;
    case 3:
      for (std::uint16_t& wiper : report.wiper_a) wiper = in.wide();
      for (std::uint16_t& wiper : report.wiper_b) wiper = in.wide();
      for (std::int16_t& part : report.orientation) part = static_cast<std::int16_t>(in.wide());
      break;
    default:  // the same again
      break;
  }
  report.fresh = how < 240;
  report.parked = how % 16 == 15;
  report.homed = how % 64 != 63;
  report.button1 = (how & 0x10) != 0;
}

void check(const kerf::ServoOutput& out, double limit_n) {
  const auto finite = [](std::span<const double> values) {
    return std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
  };
  require(finite(out.position_mm) && finite(out.velocity_mm_per_s) &&
          finite(out.commanded_force_n) && finite(out.contact_force_n) && finite(out.torque_n_mm) &&
          finite(out.proxy_offset_mm) && finite(out.tip_torque_n_mm) &&
          std::isfinite(out.absorbed_mj));
  const auto& f = out.commanded_force_n;
  require(f[0] * f[0] + f[1] * f[1] + f[2] * f[2] <= limit_n * limit_n);
  const auto& r = out.rotation;
  for (std::size_t a = 0; a < 9; a += 3) {
    for (std::size_t b = 0; b < 9; b += 3) {
      const double product = r[a] * r[b] + r[a + 1] * r[b + 1] + r[a + 2] * r[b + 2];
      require(std::abs(product - (a == b ? 1 : 0)) < 1e-5);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes in({data, size});
  kerf::LoadedScene scene;
  if (!make_scene(in, scene)) return 0;
  std::unique_ptr<kerf::CompiledScene> servo;
  try {
    servo = kerf::plan_scene(scene);
    // As the controller refuses it, before any memory of its volumes is taken.
    if (!kerf::budget_error(scene, servo->costs()).empty()) return 0;
    servo->take(scene);
  } catch (const kerf::LoadError&) {
    return 0;
  }
  kerf::KinematicOmni arm;
  kerf::arm_at(*servo, arm, 0, 5, 0, std::max(1, scene.servo.rate_hz / 1000));
  kerf::DeviceReport report = arm.at(0, 5, 0);
  constexpr int kMostTicks = 200;  // one costs up to 5 ms here
  for (int tick = 0; tick < kMostTicks && !in.empty(); ++tick) {
    if (const std::uint8_t command = in.next(); command >= 250) {
      static_cast<void>(
          servo->apply({static_cast<kerf::ServoCommand::Kind>(command - 250), in.next() % 4U}));
    }
    change(in, arm, report);
    check(servo->step(report), scene.limits.force_n);
  }
  return 0;
}
