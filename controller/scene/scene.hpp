// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/tool_offset.hpp"
#include "controller/scene/tool_mesh.hpp"
#include "controller/scene/volume_image.hpp"
#include "controller/servo/personality.hpp"

namespace kerf {

/// Position in mm and orientation as a quaternion x, y, z, w of unit length.
struct Pose {
  std::array<double, 3> position_mm{0, 0, 0};
  std::array<double, 4> orientation{0, 0, 0, 1};
};

/// Removal rate of enamel per newton at the reference speed, mm^3/(s N): 0.067 to 0.108 of human
/// enamel under a diamond bur at 50 to 80 g (haptics-science 1.5).
inline constexpr double kEnamelMm3PerSN = 0.083;
inline constexpr double kReferenceSpeedKrpm = 300;

struct Material {
  std::string name;
  double iso = 0.5;                              ///< density, 0..1
  std::optional<double> felt_iso{};              ///< where its surface lies; none: volume's iso
  double machinability = 1.0;                    ///< removal rate over that of enamel
  bool forbidden = false;                        ///< never cut by force, and told when pressed upon
  std::array<double, 3> colour{0.9, 0.87, 0.8};  ///< linear RGB, 0..1
};

/// One [[volume]] after loading, windowing and cropping. `pose` takes volume-frame mm (voxel
/// (0,0,0) at the origin, axes along the voxel axes) to world.
struct SceneVolume {
  std::string name;
  std::string file;
  VolumeImage image;
  Pose pose;
  Density iso = 32768;
  bool solid = true;
};

/// One [[tool]]: voxel-offset list in the tool frame (tip at the centre of the cutting head, shaft
/// along +y). `round` tools feel and cut the same in every orientation.
struct SceneTool {
  std::string name;
  std::string shape;
  double pitch_mm = 0.125;
  double radius_mm = 1.0;
  double length_mm = 2.0;
  bool round = false;
  bool turns = true;  ///< with the stylus; else it keeps the world's axes
  std::array<std::int32_t, 3> size_vox{};
  std::vector<ToolOffset> offsets;
  ToolMesh mesh;  ///< of the shape "stl"; else empty, and the shape says all
};

enum class NumericKind : std::uint8_t { fixed, float32, float64 };
enum class ForceModel : std::uint8_t {
  paper,  ///< sum of gradients over the tool's samples
  proxy   ///< swept contact of the tool's surface, coupled to the hand
};
enum class CutModel : std::uint8_t { none, overlap, overlap_exact, preston };

/// A scene after loading: everything the controller needs, in double, checked. Load time only.
struct Scene {
  std::string path;
  std::vector<SceneVolume> volumes;
  std::vector<SceneTool> tools;
  std::size_t active_tool = 0;
  std::vector<Material> materials;

  struct Device {
    Personality personality = Personality::omni;
    double workspace_scale = 1.0;              ///< x_scene = scale * x_device
    std::array<double, 3> offset_mm{0, 0, 0};  ///< scene point under the device origin
    std::optional<std::array<double, 3>>
        torque_scale;  ///< N mm at the joint per motor count; none: off
    std::array<double, 3> dock_rad{0.0, 0.23, -0.37};  ///< of the Omni: joint angles in the inkwell
  } device;
  struct Force {
    ForceModel model = ForceModel::proxy;
    double p0_n_per_mm2 = 0.06;        ///< of the paper's force
    double stiffness_n_per_mm = 0.4;   ///< of the coupling to the proxy, at the device port
    double damping_ns_per_mm = 0.002;  ///< the same
    double friction = 0.0;             ///< Coulomb coefficient of the proxy on the surface
  } force;
  struct Cut {
    CutModel model = CutModel::preston;
    double rate_per_s = 20.0;  ///< k; 1/T is the paper's own step
    double p1_n_per_mm2 = 0.06;
    // Of the model preston:
    double machinability_mm3_per_s_n = kEnamelMm3PerSN;  ///< of what has no label, too
    double threshold_n = 0.05;                           ///< force that cuts nothing yet
    double friction = 0.5;                               ///< tangential over normal force
  } cut;
  /// Turns the tool in the model preston; an air turbine.
  struct Spindle {
    double speed_krpm = kReferenceSpeedKrpm;  ///< without load
    double stall_torque_n_mm = 3.0;  ///< tuned: a turbine loses a tenth of its speed in a deep cut
    double inertia_g_mm2 = 4.5;      ///< of rotor and bur
  } spindle;
  struct Limits {
    double force_n = 3.3;
    double continuous_force_n = 0.88;  ///< RMS budget
    double slew_n_per_ms = 0.5;
    double speed_mm_per_s = 10000.0;
  } limits;
  struct Servo {
    int rate_hz = 1000;
    NumericKind numeric = NumericKind::fixed;
    GradientKernel kernel = GradientKernel::farid;
  } servo;
  std::string hand_script;  ///< [hand] script, for the demo; empty: none
};

}  // namespace kerf
