// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>

#include "controller/scene/materials.hpp"
#include "controller/scene/scene_text.hpp"

namespace kerf {
namespace {

// Ranges are wide enough for any tooth and bone, narrow enough that a slip of the unit shows.
constexpr Range kSpacingMm{1e-4, 100};
constexpr Range kSourceValue{-1e9, 1e9};
constexpr Range kUnitInterval{0, 1};
constexpr Range kIso{1e-4, 1};
constexpr Range kLengthMm{1e-4, 1000};
constexpr Range kPhantomSide{16, 512};
constexpr Range kMachinability{0, 1000};
constexpr Range kWorldMm{-kLargestWorldMm, kLargestWorldMm};

constexpr Range kMeshScale{1e-6, 1000};  // mm per unit: from nanometres to metres

constexpr auto kShapeWords = [] {
  std::array<std::string_view, kToolShapes.size() + 1> words{};
  std::copy(kToolShapes.begin(), kToolShapes.end(), words.begin());
  words.back() = kMeshShape;
  return words;
}();
constexpr std::string_view kPoseKeys[] = {"position_mm", "orientation"};
constexpr std::string_view kIsoWords[] = {"otsu"};

std::array<double, 4> unit_quaternion(const SceneTable& pose) {
  constexpr double kTolerance = 0.01;  // rounded by hand, not forgotten
  std::array<double, 4> q = *pose.numbers<4>("orientation", {-1.01, 1.01});
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(length - 1) > kTolerance) {
    refuse(pose.place("orientation"),
           " has length " + short_text(length) + "; write a unit quaternion [x, y, z, w]");
  }
  for (double& component : q) component /= length;
  return q;
}

void read_phantom_keys(const SceneTable& table, VolumeSpec& volume) {
  const bool is_phantom = volume.file == kPhantomFile;
  for (const std::string_view key : {"spacing_mm", "window"}) {
    if (is_phantom && table.has(key)) {
      refuse(table.place(key), " is given with the phantom, which has its own; leave it out");
    }
  }
  if (const auto size = table.numbers<3>("size", kPhantomSide)) {
    if (!is_phantom) {
      refuse(table.place("size"), " only shapes the phantom; leave it out, a file has its own");
    }
    std::array<std::int32_t, 3> whole{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      whole[axis] = static_cast<std::int32_t>((*size)[axis]);
      if (whole[axis] != (*size)[axis]) {
        refuse(table.place("size"), " counts voxels; write whole numbers");
      }
    }
    volume.phantom_size = VoxelGrid{whole[0], whole[1], whole[2]};
  }
}

/// A mesh has its own size.
void read_mesh_keys(const SceneTable& table, ToolSpec& tool) {
  const auto file = table.text("file");
  if (!file) refuse(table.place(), " has no file; write file = \"bur.stl\"");
  for (const std::string_view key : {"radius_mm", "size_vox", "length_mm"}) {
    if (!table.has(key)) continue;
    refuse(table.place(key),
           " is given with a mesh, which has its own size; leave it out, or set "
           "scale (mm per unit of the file)");
  }
  tool.file = *file;
  tool.where = table.where("file");
  tool.size_place = table.place("file");
  tool.scale = table.number("scale", kMeshScale).value_or(tool.scale);
  tool.name = std::filesystem::path(tool.file).stem().string();
}

void read_size_keys(const SceneTable& table, ToolSpec& tool) {
  for (const std::string_view key : {"file", "scale"}) {
    if (!table.has(key)) continue;
    refuse(table.place(key), " is of shape = \"stl\"; leave it out, or set that shape");
  }
  if (table.has("radius_mm") == table.has("size_vox")) {
    refuse(table.place(), " needs either radius_mm or size_vox; write one of them");
  }
  ToolSize& size = tool.size;
  if (const auto radius_mm = table.number("radius_mm", kLengthMm)) {
    size.radius_mm = *radius_mm;
    tool.size_place = table.place("radius_mm");
    tool.name = tool.shape + " " + number_text(size.radius_mm) + " mm";
  } else {
    size.size_vox = table.whole("size_vox", {1, 10000});  // its own limit is told with the way out
    tool.size_place = table.place("size_vox");
    tool.name = tool.shape + " " + std::to_string(*size.size_vox) + " vox";
  }
  size.length_mm = table.number("length_mm", kLengthMm);
  if (size.length_mm && (size.size_vox || tool.shape == "ball")) {
    refuse(table.place("length_mm"), size.size_vox
                                         ? " contradicts size_vox, which is a cube; leave it out"
                                         : " contradicts the ball, which is round; leave it out");
  }
  if (tool.shape == "wheel" && size.length_mm && *size.length_mm > 2 * size.radius_mm) {
    refuse(table.place("length_mm"),
           " is more than the wheel's diameter; use at most " + number_text(2 * size.radius_mm));
  }
}

}  // namespace

VolumeSpec read_volume_table(const SceneTable& table) {
  VolumeSpec volume;
  const auto file = table.text("file");
  if (!file) refuse(table.place(), " has no file; write file = \"phantom\" or a path");
  volume.file = *file;
  volume.where = table.where("file");
  volume.name = table.text("name").value_or(std::filesystem::path(volume.file).stem().string());
  read_phantom_keys(table, volume);
  if (table.is_array("spacing_mm")) {
    volume.spacing_mm = table.numbers<3>("spacing_mm", kSpacingMm);
  } else if (const auto spacing_mm = table.number("spacing_mm", kSpacingMm)) {
    volume.spacing_mm = {*spacing_mm, *spacing_mm, *spacing_mm};
  }
  volume.window = table.numbers<2>("window", kSourceValue);
  if (volume.window && (*volume.window)[0] >= (*volume.window)[1]) {
    refuse(table.place("window"), " is empty; write [low, high] with low < high");
  }
  if (table.is_text("iso")) {
    static_cast<void>(table.choice("iso", kIsoWords));
  } else {
    volume.iso = table.number("iso", kIso);
  }
  volume.crop = table.flag("crop").value_or(true);
  volume.solid = table.flag("solid").value_or(true);
  if (const auto pose = table.table("pose", kPoseKeys)) {
    volume.position_mm = pose->numbers<3>("position_mm", kWorldMm).value_or(volume.position_mm);
    if (pose->has("orientation")) volume.orientation = unit_quaternion(*pose);
  }
  return volume;
}

ToolSpec read_tool_table(const SceneTable& table) {
  ToolSpec tool;
  const auto shape = table.choice("shape", kShapeWords);
  if (!shape) refuse(table.place(), " has no shape; write shape = \"ball\" or another");
  tool.shape = kShapeWords[*shape];
  if (tool.shape == kMeshShape) {
    read_mesh_keys(table, tool);
  } else {
    read_size_keys(table, tool);
  }
  ToolSize& size = tool.size;
  if (const auto pitch_mm = table.number("pitch_mm", kSpacingMm)) {
    size.pitch_mm = *pitch_mm;
    tool.pitch_given = true;
    tool.pitch_place = table.place("pitch_mm");
  }
  tool.turns = table.flag("turns").value_or(tool.turns);
  tool.name = table.text("name").value_or(tool.name);
  return tool;
}

void read_material_table(const SceneTable& table, std::vector<Material>& materials) {
  const auto name = table.text("name");
  if (!name) refuse(table.place(), " has no name; write name = \"enamel\" or another");
  if (*name == materials.front().name) {
    refuse(table.place("name"), " is air and has no properties; use another name");
  }
  auto material = std::find_if(materials.begin(), materials.end(),
                               [&](const Material& m) { return m.name == *name; });
  if (material == materials.end()) {
    materials.push_back(known_material(*name));
    material = std::prev(materials.end());
  }
  material->iso = table.number("iso", kUnitInterval).value_or(material->iso);
  if (const auto felt_iso = table.number("felt_iso", kIso)) material->felt_iso = felt_iso;
  material->machinability =
      table.number("machinability", kMachinability).value_or(material->machinability);
  material->forbidden = table.flag("forbidden").value_or(material->forbidden);
  material->colour = table.numbers<3>("colour", kUnitInterval).value_or(material->colour);
}

}  // namespace kerf
