// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string>

// clang-format off
#include "controller/volume/file/itk_on_clang.hpp"  // before any header of ITK
// clang-format on
#include <itkImageIOBase.h>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/volume_header.hpp"

// What all readers of ITK share; only foreign_*.cpp include ITK. Its readers are driven one level
// below itk::Image, so that each size is checked before memory is taken, and no type is
// instantiated twelve times. In the sandbox.

namespace kerf::volume {

using ImageIo = itk::ImageIOBase;

[[noreturn]] void refuse_unreadable(const std::filesystem::path& path, const std::string& reason);

/// Runs a step of a library; its exceptions become one line that begins with the file.
template <class Step>
auto guarded(const std::filesystem::path& path, Step&& step) {
  try {
    return step();
  } catch (const itk::ExceptionObject& error) {
    refuse_unreadable(path, error.GetDescription());
  } catch (const std::bad_alloc&) {
    throw;  // the sandbox knows how much there was
  } catch (const SceneError&) {
    throw;
  } catch (const std::exception& error) {
    refuse_unreadable(path, error.what());
  }
}

/// Reads the header; gives the three extents of a volume (`axes` 3) or of a picture (2). More axes
/// are fine where they hold one layer each. Refuses more than one value per voxel.
[[nodiscard]] std::array<std::int64_t, 3> open_image(const std::filesystem::path& path, ImageIo& io,
                                                     unsigned axes = 3);

/// The type of the opened file's numbers; refuses others.
[[nodiscard]] VoxelType type_of(const std::filesystem::path& path, const ImageIo& io);

/// Reads all voxels of the opened file, as they are there, into `bytes`.
void read_voxels(const std::filesystem::path& path, ImageIo& io, std::span<std::byte> bytes);

/// What the opened file says. `kind` of its own type.
[[nodiscard]] VolumeClaim claim_of(const std::filesystem::path& path, const ImageIo& io,
                                   const std::array<std::int64_t, 3>& size, bool has_spacing);

/// One file that holds a whole volume.
void read_one_file(const std::filesystem::path& path, ImageIo& io, const VolumeHeader& header,
                   const Offer& offer);

/// A value of all slices that have these.
[[nodiscard]] constexpr ValueKind common_kind(ValueKind a, ValueKind b) noexcept {
  return a == b ? a : ValueKind::float32;
}

void read_dicom_file(const std::filesystem::path& path, const Offer& offer);
void read_dicom_series(const std::filesystem::path& folder,
                       const std::vector<std::filesystem::path>& beside, const std::string& series,
                       SandboxReader& sandbox, const Offer& offer);
/// Pictures of one size in the order of the numbers in their names.
void read_slice_stack(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& beside, VolumeKind kind,
                      SandboxReader& sandbox, const Offer& offer);

}  // namespace kerf::volume
