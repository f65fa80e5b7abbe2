// SPDX-License-Identifier: Apache-2.0

#include "bridge/igtl/igtl_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <igtlImageMessage.h>
#include <igtlSensorMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>

#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/json.hpp"

namespace kerf::bridge {
namespace {

constexpr std::size_t kNameBytes = 20;

/// The first `most` bytes of a name, or fewer, so that no UTF-8 character is cut.
std::string first_bytes(const std::string& name, std::size_t most) {
  if (name.size() <= most) return name;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
  return name.substr(0, end);
}

/// `name` with `ending`, cut so that it fits; with its number too if another has it.
std::string not_taken(const std::string& name, std::size_t volume, const std::string& ending,
                      const std::vector<std::string>& taken) {
  const std::string out = first_bytes(name, kNameBytes - ending.size()) + ending;
  if (std::find(taken.begin(), taken.end(), out) == taken.end()) return out;
  const std::string numbered = " " + std::to_string(volume + 1) + ending;
  return first_bytes(name, kNameBytes - numbered.size()) + numbered;
}

std::string name_in(const Json& scene, std::size_t volume) {
  try {
    return scene.at("volumes").at(volume).at("name").get<std::string>();
  } catch (const JsonError&) {
    return {};
  }
}

Json scene_of(const SegmentInfo& segment) {
  try {
    return Json::parse(segment.scene_json);
  } catch (const JsonError&) {
    return {};
  }
}

}  // namespace

std::vector<std::string> device_names(const SegmentInfo& segment) {
  const Json scene = scene_of(segment);
  std::vector<std::string> names;
  for (std::size_t v = 0; v < segment.volumes.size(); ++v) {
    std::string name = name_in(scene, v);
    if (name.empty()) name = "volume " + std::to_string(v + 1);
    names.push_back(not_taken(name, v, "", names));
  }
  return names;
}

std::vector<std::string> label_names(const std::vector<std::string>& volumes) {
  std::vector<std::string> taken = volumes, names;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    names.push_back(not_taken(volumes[v], v, " labels", taken));
    taken.push_back(names.back());
  }
  return names;
}

namespace {

/// From kerf's world to RAS: signs of x, y and z.
constexpr std::array<double, 3> kRas{-1, -1, 1};

std::array<double, 4> quaternion(const float (&q)[4]) {
  return {q[0], q[1], q[2], q[3]};
}

/// RAS from axes that `orientation` turns into the world.
void set_axes(const Matrix3& orientation, igtl::Matrix4x4& matrix) {
  igtl::IdentityMatrix(matrix);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      matrix[row][axis] = static_cast<float>(kRas[row] * orientation[3 * row + axis]);
    }
  }
}

IgtlBytes packed(igtl::MessageBase& message, const char* device) {
  igtl::TimeStamp::Pointer now = igtl::TimeStamp::New();
  now->GetTime();
  message.SetTimeStamp(now);
  message.SetDeviceName(device);
  message.Pack();
  const auto* first = static_cast<const std::byte*>(message.GetPackPointer());
  return std::make_shared<const std::vector<std::byte>>(first, first + message.GetPackSize());
}

template <class Voxel>
void copy_part(const VoxelGrid& grid, std::span<const Voxel> linear, const VoxelBox& part,
               void* out) {
  auto* to = static_cast<char*>(out);
  const auto row = static_cast<std::size_t>(part.extent().x) * sizeof(Voxel);
  for (std::int32_t z = part.lo.z; z < part.hi.z; ++z) {
    for (std::int32_t y = part.lo.y; y < part.hi.y; ++y, to += row) {
      std::memcpy(to, &linear[grid.index(part.lo.x, y, z)], row);
    }
  }
}

/// Size and place of a volume, of which the image has `part`; one number a voxel.
void set_place(const SegmentVolumeInfo& volume, const VoxelBox& part, igtl::ImageMessage& image) {
  const VoxelGrid& grid = volume.grid;
  const VoxelIndex extent = part.extent();
  image.SetDimensions(grid.nx, grid.ny, grid.nz);
  image.SetSubVolume(extent.x, extent.y, extent.z, part.lo.x, part.lo.y, part.lo.z);
  image.SetSpacing(static_cast<float>(volume.spacing_mm[0]),
                   static_cast<float>(volume.spacing_mm[1]),
                   static_cast<float>(volume.spacing_mm[2]));
  image.SetNumComponents(1);
  image.SetEndian(igtl::ImageMessage::ENDIAN_LITTLE);
  image.SetCoordinateSystem(igtl::ImageMessage::COORDINATE_RAS);

  const auto& q = volume.orientation;
  const Matrix3 orientation = rotation_of({q[0], q[1], q[2], q[3]});
  igtl::Matrix4x4 matrix;
  set_axes(orientation, matrix);
  const std::array<double, 3> middle_vox{(grid.nx - 1) / 2.0, (grid.ny - 1) / 2.0,
                                         (grid.nz - 1) / 2.0};
  for (std::size_t row = 0; row < 3; ++row) {
    double middle_mm = volume.origin_mm[row];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      middle_mm += orientation[3 * row + axis] * volume.spacing_mm[axis] * middle_vox[axis];
    }
    matrix[row][3] = static_cast<float>(kRas[row] * middle_mm);
  }
  image.SetMatrix(matrix);
}

}  // namespace

bool fits_an_image(const VoxelGrid& grid) noexcept {
  constexpr std::size_t kHeaders = 4096;  // of the message; far more than it has
  return grid.voxel_count() * sizeof(Density) <= INT32_MAX - kHeaders;
}

IgtlBytes image_message(const std::string& device, const SegmentVolumeInfo& volume,
                        const std::vector<Density>& linear, const VoxelBox& part) {
  const igtl::ImageMessage::Pointer image = igtl::ImageMessage::New();
  set_place(volume, part, *image);
  image->SetScalarTypeToUint16();
  image->AllocateScalars();
  copy_part(volume.grid, std::span<const Density>(linear), part, image->GetScalarPointer());
  return packed(*image, device.c_str());
}

IgtlBytes label_message(const std::string& device, const SegmentVolumeInfo& volume,
                        std::span<const Label> linear) {
  const igtl::ImageMessage::Pointer image = igtl::ImageMessage::New();
  set_place(volume, volume.grid.box(), *image);
  image->SetScalarTypeToUint8();
  image->AllocateScalars();
  copy_part(volume.grid, linear, volume.grid.box(), image->GetScalarPointer());
  return packed(*image, device.c_str());
}

std::optional<IgtlBytes> tool_message(const TickRecord& tick, std::size_t arm) {
  const auto known = [](double x) { return std::isfinite(x); };
  if (!std::all_of(std::begin(tick.position_mm), std::end(tick.position_mm), known) ||
      !std::all_of(std::begin(tick.orientation), std::end(tick.orientation), known)) {
    return std::nullopt;
  }
  igtl::Matrix4x4 matrix;
  set_axes(rotation_of(quaternion(tick.orientation)), matrix);
  for (std::size_t row = 0; row < 3; ++row) {
    matrix[row][3] = static_cast<float>(kRas[row] * tick.position_mm[row]);
  }
  const igtl::TransformMessage::Pointer tool = igtl::TransformMessage::New();
  tool->SetMatrix(matrix);
  return packed(*tool, arm == 0 ? "Tool" : "Tool 2");
}

IgtlBytes force_message(const TickRecord& tick, std::size_t arm) {
  const igtl::Unit::Pointer newton = igtl::Unit::New();
  newton->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  const igtl::SensorMessage::Pointer force = igtl::SensorMessage::New();
  force->SetLength(3);
  force->SetUnit(newton);
  for (unsigned int i = 0; i < 3; ++i) {
    force->SetValue(i, kRas[i] * double{tick.commanded_force_n[i]});
  }
  return packed(*force, arm == 0 ? "Force" : "Force 2");
}

}  // namespace kerf::bridge
