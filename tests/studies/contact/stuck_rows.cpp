// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "controller/load/loaded_scene.hpp"
#include "controller/scene/scene_presets.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "controller/volume/crop_resample.hpp"
#include "controller/volume/phantom.hpp"
#include "tests/rig/cutting_hand.hpp"
#include "tests/rig/exact_contact.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {
namespace {

/// A scene of the search for traps: matter about the device's origin, in voxels of 0.125 mm, and
/// tools of every shape that cut it by force.
struct TrapScene {
  LoadedScene scene;
  std::string what;  ///< matter, numbers and rate, for a person
  int presses = 0;   ///< of about the same work in all scenes
};

constexpr double kVoxelMm = 0.125, kIsoShare = 0.45;

/// Numbers of the loop, its rate, and how many presses take the work of 24 in fixed point at 1 kHz.
struct Loop {
  NumericKind numeric;
  int rate_hz, presses;
  const char* name;
};
constexpr Loop kCommon{NumericKind::fixed, 1000, 24, "fixed, 1 kHz"};
constexpr Loop kSlow{NumericKind::fixed, 250, 24, "fixed, 250 Hz"};
constexpr std::array<Loop, 4> kRare{{{NumericKind::fixed, 8000, 6, "fixed, 8 kHz"},
                                     {NumericKind::float64, 250, 24, "double, 250 Hz"},
                                     {NumericKind::float64, 1000, 6, "double, 1 kHz"},
                                     {NumericKind::float64, 8000, 1, "double, 8 kHz"}}};

const Loop& loop_of(std::uint64_t number) {
  const std::size_t turn = number % 16;
  if (turn % 2 == 0) return kCommon;
  return turn % 4 == 1 ? kSlow : kRare[turn / 4];
}

/// Density by place in mm: 0..1, and the fraction of soft material.
struct Matter {
  const char* name;
  std::function<double(Point)> hard;  ///< share of full density
  std::function<double(Point)> soft;  ///< 0..1: how much of the place is soft; none: nothing
};

double filled(double distance_mm) {
  return std::clamp(0.5 - distance_mm / (2 * kVoxelMm), 0.0, 1.0);
}

Matter crown() {
  double top_mm = 12;
  while (phantom_signed_distance(1, 1, top_mm) > 0) top_mm -= 0.01;
  return {"crown",
          [top_mm](Point at) {
            return filled(phantom_signed_distance(at[0] + 1, 1 - at[2], at[1] + top_mm));
          },
          {}};
}

/// Hard, less hard, and a chamber.
Matter layers() {
  return {"layers", [](Point at) { return filled(at[1]) * (1 - 0.35 * filled(at[1] + 0.8)); },
          [](Point at) {
            return filled(length(at - Point{0, -2.5, 0}) - 1.5);
          }};
}

/// Bits that touch and overlap, each third of them soft.
Matter rubble(RandomNumbers& random) {
  std::array<std::pair<Point, double>, 24> bits;
  for (auto& [place, radius] : bits) {
    place = {random.uniform(-3, 3), random.uniform(-3.5, -0.5), random.uniform(-3, 3)};
    radius = random.uniform(0.3, 1.2);
  }
  const auto nearest = [bits](Point at, std::size_t from, std::size_t to) {
    double nearest_mm = 9;
    for (std::size_t i = from; i < to; ++i) {
      nearest_mm = std::min(nearest_mm, length(at - bits[i].first) - bits[i].second);
    }
    return filled(nearest_mm);
  };
  return {"rubble", [nearest](Point at) { return nearest(at, 0, 24); },
          [nearest](Point at) { return nearest(at, 16, 24); }};
}

/// A groove and a hole, as from earlier milling; soft material fills them.
Matter pit(RandomNumbers& random) {
  const double radius_mm = random.uniform(0.3, 1.2);
  const auto hollow = [radius_mm](Point at) {
    return std::min(std::hypot(at[0] - 0.5, at[2]), std::hypot(at[0] + 0.7, at[1])) - radius_mm;
  };
  return {"pit", [hollow](Point at) { return filled(std::max(at[1], -hollow(at))); },
          [hollow](Point at) { return filled(std::max(at[1], hollow(at))); }};
}

/// Nested shells of 1.2 to 3 voxels, with tissue in them.
Matter shells(RandomNumbers& random) {
  const double wall_mm = random.uniform(1.2, 3) * kVoxelMm, gap_mm = random.uniform(0.4, 1.2);
  const auto depth = [](Point at) { return 3.5 - length(at + Point{0, 3.5, 0}); };
  return {"shells",
          [=](Point at) {
            const double within = std::fmod(depth(at) + gap_mm, wall_mm + gap_mm) - gap_mm;
            return filled(std::max(-depth(at), std::max(-within, within - wall_mm)));
          },
          [=](Point at) { return filled(0.3 - depth(at)); }};
}

/// Parallel thin walls that stand on a floor.
Matter plates(RandomNumbers& random) {
  const double wall_mm = random.uniform(1.2, 4) * kVoxelMm, gap_mm = random.uniform(0.2, 1.5);
  return {"plates",
          [=](Point at) {
            const double along = std::fmod(at[0] + 100 * (wall_mm + gap_mm), wall_mm + gap_mm);
            const double wall = std::max(at[1], std::max(-along, along - wall_mm));
            return filled(std::min(wall, at[1] + 2));
          },
          [](Point at) { return filled(at[1] + 0.4); }};
}

Matter block() {
  return {"block at the border", [](Point) { return 1.0; },
          [](Point at) { return filled(std::hypot(at[0], at[2]) - 0.4); }};
}

Matter matter_of(RandomNumbers& random) {
  switch (static_cast<int>(random.uniform(0, 8))) {
    case 0:
      return crown();
    case 1:
      return layers();
    case 2:
      return rubble(random);
    case 3:
      return pit(random);
    case 4:
      return shells(random);
    case 5:
      return plates(random);
    case 6:
      return block();
    default:
      return {"flat", [](Point at) { return filled(at[1]); }, {}};
  }
}

/// Voxels about `middle_mm` of this matter; soft voxels below the iso are labelled as pulp.
VolumeImage image_of(VoxelGrid grid, const Matter& matter, Point middle_mm, double softness) {
  VolumeImage image;
  image.grid = grid;
  image.spacing_mm = {kVoxelMm, kVoxelMm, kVoxelMm};
  const Point first =
      middle_mm - 0.5 * kVoxelMm * Point{grid.nx - 1.0, grid.ny - 1.0, grid.nz - 1.0};
  const bool some = softness > 0 && matter.soft;
  image.density = body_of(grid, [&](Point p) {
                    const Point at = first + kVoxelMm * p;
                    const double soft = some ? matter.soft(at) : 0;
                    const double density = (1 - soft) * matter.hard(at) + soft * softness;
                    if (some) {
                      const bool pulp = soft > 0.5 && density < kIsoShare;
                      image.labels.push_back(pulp ? kLabelPulp : kLabelEnamel);
                    }
                    return density;
                  }).density;
  return image;
}

/// A scene around this image, whose middle is at `middle_mm` before all is turned about the origin.
LoadedScene scene_around(VolumeImage image, Point middle_mm, const Loop& loop,
                         RandomNumbers& random) {
  LoadedScene scene;
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "matter";
  volume.iso = static_cast<Density>(std::lround(kIsoShare * kDensityMax));
  volume.image = enclosed_in_air(std::move(image), volume.iso);
  const Point axis = std::sin(random.uniform(0, 0.5)) * random.direction();
  const double w = std::sqrt(std::max(0.0, 1 - dot(axis, axis)));
  const Matrix3 turn = rotation_of(std::array{axis[0], axis[1], axis[2], w});
  Point middle{};
  for (std::size_t i = 0; i < 3; ++i) {
    middle[i] = turn[3 * i] * middle_mm[0] + turn[3 * i + 1] * middle_mm[1] +
                turn[3 * i + 2] * middle_mm[2];
  }
  volume.pose = place_volume(volume.image, turn, middle);
  scene.force.model = ForceModel::proxy;
  scene.cut.model = CutModel::preston;
  constexpr double kRates[] = {1, 4, 8};
  scene.cut.machinability_mm3_per_s_n *= kRates[static_cast<std::size_t>(random.uniform(0, 3))];
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  scene.servo.numeric = loop.numeric;
  scene.servo.rate_hz = loop.rate_hz;
  scene.materials = default_materials();
  scene.materials[kLabelPulp].forbidden = random.uniform(0, 1) < 0.5;
  return scene;
}

void add_tools(bool bur, RandomNumbers& random, LoadedScene& scene) {
  for (const std::string_view shape : kToolShapes) {
    const std::string name(shape);
    const double radius_mm = random.uniform(0.4, 1);
    scene.tools.push_back(make_tool(name, name, {.pitch_mm = kVoxelMm, .radius_mm = radius_mm}));
  }
  if (bur) scene.tools.push_back(shipped_bur(1, kVoxelMm));
  for (SceneTool& tool : scene.tools) {
    const bool shafted = random.uniform(0, 1) < 0.5;
    ToolShaft shaft;
    shaft.radius_mm = tool.radius_mm * random.uniform(0.3, 1.2);
    shaft.end_mm = tool.length_mm / 2 + random.uniform(1, 6);
    if (random.uniform(0, 1) < 0.5) {
      shaft.handpiece_radius_mm = shaft.radius_mm + random.uniform(0.5, 2);
      shaft.handpiece_end_mm = shaft.end_mm + 8;
    }
    if (shafted) tool.shaft = shaft;
  }
}

/// The scene with this number, the same on every machine. Matter: flat, crown, layers, rubble,
/// pits, shells, plates, and a block that ends at the volume's border; half of it with a soft
/// material, that no cut may touch in half of those. Of 16 scenes in a row 8 run in fixed point at
/// 1 kHz, 4 at 250 Hz, 1 at 8 kHz, and 3 in double. Half of the tools have a shaft, some a
/// handpiece; one scene of four has the fluted bur of scenes/burs. Throws LoadError if that cannot
/// be read.
TrapScene trap_scene(std::uint64_t number) {
  RandomNumbers random(number);
  const Loop& loop = loop_of(number);
  const Matter matter = matter_of(random);
  const bool border = std::string_view(matter.name).starts_with("block");
  const double softness = random.uniform(0, 1) < 0.5 ? kIsoShare * random.uniform(0.2, 0.97) : 0;
  const VoxelGrid grid = border ? VoxelGrid{24, 32, 24} : VoxelGrid{64, 64, 64};
  const Point middle_mm = border ? Point{0, -2, 0} : Point{};
  LoadedScene scene =
      scene_around(image_of(grid, matter, middle_mm, softness), middle_mm, loop, random);
  add_tools(number % 4 == 2, random, scene);
  std::string what = matter.name;
  if (softness > 0 && matter.soft) {
    what += scene.materials[kLabelPulp].forbidden ? ", forbidden pulp" : ", pulp";
  }
  return {std::move(scene), what + ", " + loop.name, loop.presses};
}

/// The same with a flat that is softer than its iso, all of it: 0.2 to 0.97 of that.
TrapScene soft_scene(std::uint64_t number) {
  RandomNumbers random(~number);
  const Loop& loop = loop_of(number);
  const double softness = kIsoShare * random.uniform(0.2, 0.97);
  const Matter matter{"soft", [softness](Point at) { return softness * filled(at[1]); }, {}};
  LoadedScene scene = scene_around(image_of({64, 64, 64}, matter, {}, 0), {}, loop, random);
  add_tools(number % 4 == 2, random, scene);
  return {std::move(scene), std::string("soft, ") + loop.name, loop.presses};
}

constexpr Point kAbove{0, 4.5, 0};
constexpr double kPressS = 5, kTrappedS = 0.5;
constexpr double kCutsFrom = 1.2;  ///< times the threshold: a press that must cut

/// The outcome of a press.
struct Pressed {
  double longest_s = 0;   ///< of force that must cut and no removal; the load of a shaft is none
  double held_n = 0;      ///< at the end, by a hand that rests
  bool touched = false;   ///< there was force that must cut
  bool by_shaft = false;  ///< a shaft bore the press by right
};

/// The part of the sent force that the head must bear, whatever the shaft does.
double force_on_head(CuttingHand& miller, const LoadedScene& scene, const SceneTool& tool,
                     const ServoOutput& out) {
  const double force_n = length(out.commanded_force_n);
  if (tool.shaft.radius_mm <= 0 || force_n <= 0) return force_n;
  Point centre_mm{};
  for (std::size_t i = 0; i < 3; ++i) centre_mm[i] = out.position_mm[i] + out.proxy_offset_mm[i];
  const ShaftTouch touch(scene.volumes[0], miller.servo().density(0));
  return force_n *
         touch.least_head_share(tool, centre_mm, out.rotation, -1 * out.commanded_force_n);
}

/// How a hand presses.
struct Hand {
  Point from, direction;
  double force_n;
  bool along_a_line;  ///< held on it; else it slides wherever it is led
};

/// A hand that presses and trembles by 0.1 mm, for `seconds`; it goes on at 50 mm/s if nothing
/// holds it. The press ends if the tool leaves the matter, or counts as stuck.
Pressed press(CuttingHand& miller, const Hand& how, const LoadedScene& scene, const SceneTool& tool,
              double seconds) {
  constexpr double kMmPerS = 50, kTremorMm = 0.1, kTremorHz = 9, kLeftMm = 5, kRestS = 0.1;
  const double tick_s = 1.0 / scene.servo.rate_hz, step_mm = kMmPerS * tick_s;
  const double lead_mm = how.force_n / scene.force.stiffness_n_per_mm;
  const Point across = unit(cross(how.direction, Point{0.3, 0.1, 1}));
  const double must_cut_n = kCutsFrom * scene.cut.threshold_n;
  Point hand = how.from, proxy = how.from;
  Pressed seen;
  int still = 0;
  // The load that a shaft may bear changes with the tremor: it is judged several times.
  const auto judged = [tick_s](int n) { return static_cast<int>(n * tick_s * 6 / kTrappedS); };
  const int ticks = static_cast<int>(seconds * scene.servo.rate_hz);
  for (int tick = 0; tick < ticks && length(proxy) <= kLeftMm; ++tick) {
    const Point held =
        how.along_a_line ? how.from + dot(proxy - how.from, how.direction) * how.direction : proxy;
    const Point goal =
        held + lead_mm * how.direction +
        kTremorMm * std::sin(2 * std::numbers::pi * kTremorHz * tick * tick_s) * across;
    const Point way = goal - hand;
    hand = hand + std::min(1.0, step_mm / std::max(step_mm, length(way))) * way;
    const ServoOutput out = miller.step(hand);
    for (std::size_t i = 0; i < 3; ++i) proxy[i] = out.position_mm[i] + out.proxy_offset_mm[i];
    const bool must_cut = length(out.commanded_force_n) > must_cut_n;
    seen.touched = seen.touched || must_cut;
    still = must_cut && out.removed_steps == 0 ? still + 1 : 0;
    if (judged(still) > judged(still - 1) &&
        force_on_head(miller, scene, tool, out) <= must_cut_n) {
      seen.by_shaft = true;
      still = 0;
    }
    if (still * tick_s > kTrappedS) {
      seen.longest_s = still * tick_s;
      break;
    }
    // A load that a shaft may have borne is judged only if it lasts.
    if (tool.shaft.radius_mm <= 0) seen.longest_s = std::max(seen.longest_s, still * tick_s);
  }
  seen.held_n = length(miller.hold(hand, kRestS).commanded_force_n);
  return seen;
}

/// The hand takes the tool out of the matter, chooses the next one, turned anyhow, and holds it
/// above. Returns its position.
Point begin(CuttingHand& miller, std::size_t tool, RandomNumbers& random) {
  const Point from{random.uniform(-1.5, 1.5), random.uniform(3, 4), random.uniform(-1.5, 1.5)};
  miller.travel(kAbove);
  miller.servo().apply({ServoCommand::Kind::select_tool, static_cast<std::uint32_t>(tool)});
  miller.turn_wrist(
      {random.uniform(-0.5, 0.5), random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5)});
  miller.travel(from);
  static_cast<void>(miller.hold(from, 0.1));
  return from;
}

std::string press_name(const TrapScene& at, const SceneTool& tool, std::uint64_t scene, int press) {
  return tool.name + (tool.shaft.radius_mm > 0 ? " with a shaft" : "") + " in " + at.what +
         ", scene " + std::to_string(scene) + " press " + std::to_string(press);
}

/// A press by the number of its scene and its own in that scene.
struct PressNumber {
  std::uint64_t scene;
  int press;
  bool operator==(const PressNumber&) const = default;
};

/// Presses that stop and are not repaired: each by a tool with a shaft, of which a part that
/// touches two faces has one plane (docs/contact.md). They are shown, and fail nothing; one that
/// cuts again does, until it is taken off this list.
constexpr PressNumber kOpen[] = {{478, 16}, {483, 0}};

/// The outcome of many presses.
struct Search {
  int made = 0, touched = 0, by_shaft = 0, bad = 0, open = 0, repaired = 0;
  double worst = 0;
};

/// Presses in the scenes from `first` on; adds a row for each with more than `limit`, and compares
/// none of those in `open` with it.
template <class Make, class Value>
Search search(int presses, std::uint64_t first, double seconds, double limit, const char* unit_name,
              std::span<const PressNumber> open_presses, Make&& make, Value&& value,
              const RowSink& add_row) {
  Search found;
  for (std::uint64_t number = first; found.made < presses; ++number) {
    const TrapScene at = make(number);
    CuttingHand miller(at.scene, kAbove);
    RandomNumbers random(number ^ 0x5eed);
    for (int i = 0; i < std::min(at.presses, presses - found.made); ++i) {
      const std::size_t tool = (static_cast<std::size_t>(i) + number) % at.scene.tools.size();
      const Point from = begin(miller, tool, random);
      const Point down = unit(Point{random.uniform(-0.7, 0.7), -1, random.uniform(-0.7, 0.7)});
      const Hand hand{from, down, random.uniform(0.1, 1), random.uniform(0, 1) < 0.7};
      const Pressed seen = press(miller, hand, at.scene, at.scene.tools[tool], seconds);
      found.touched += seen.touched ? 1 : 0;
      found.by_shaft += seen.by_shaft ? 1 : 0;
      const bool stops = value(seen) > limit;
      const bool open =
          std::ranges::find(open_presses, PressNumber{number, i}) != open_presses.end();
      if (open) {
        ++(stops ? found.open : found.repaired);
      } else {
        found.worst = std::max(found.worst, value(seen));
        found.bad += stops ? 1 : 0;
      }
      if (!stops) continue;
      const std::string name = press_name(at, at.scene.tools[tool], number, i);
      add_row({"traps",
               open ? "open: " + name : name,
               value(seen),
               unit_name,
               open ? std::nullopt : std::optional(limit),
               {}});
    }
    found.made += std::min(at.presses, presses - found.made);
  }
  return found;
}

}  // namespace

void measure_traps(const Effort& effort, const RowSink& add_row) {
  constexpr double kSoftS = 1, kSoftN = 0.01;
  const Search hard = search(
      effort.presses, effort.first_scene, kPressS, kTrappedS, "s", kOpen, trap_scene,
      [](const Pressed& seen) { return seen.longest_s; }, add_row);
  const auto row = [&](const char* what, double value, const char* unit, std::optional<double> must,
                       std::optional<double> aim) {
    add_row({"traps", what, value, unit, must, aim});
  };
  const double made = std::max(hard.made, 1);
  const std::string scenes = "presses of 5 s, from --seed " + std::to_string(effort.first_scene);
  row(scenes.c_str(), hard.made, "", {}, {});
  row("presses with a force that must cut", 100 * hard.touched / made, "%", {}, {});
  row("presses that a shaft carries", 100 * hard.by_shaft / made, "%", {}, {});
  row("presses that stop cutting for over 0.5 s", hard.bad, "", 0, 0);
  if (hard.open + hard.repaired > 0) {
    row("presses known to stop, which do", hard.open, "", {}, 0);
    row("presses known to stop, which cut: take them off the list", hard.repaired, "", 0, 0);
  }
  row("longest time of force without removal", hard.worst, "s", kTrappedS, 0.2);
  const Search soft = search(
      effort.presses / 4, effort.first_scene, kSoftS, kSoftN, "N", {}, soft_scene,
      [](const Pressed& seen) { return seen.held_n; }, add_row);
  row("force in solids of 0.2 to 0.97 of the iso", soft.worst, "N", kSoftN, 0);
}

}  // namespace kerf::extremes
