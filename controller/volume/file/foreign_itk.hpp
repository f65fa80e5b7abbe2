// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <sstream>
#include <streambuf>
#include <string>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/file_headers.hpp"
#include "controller/volume/file/foreign_volume.hpp"

// Shared by all readers that call ITK; only foreign_*.cpp include this. ITK's readers are driven
// one level below itk::Image, so that each size is checked before memory is taken, and no type is
// instantiated twelve times. All of it runs in the sandbox.

// Debian builds ITK with g++, and ITK's generated itk_compiler_detection.h then refuses every other
// compiler. Under clang these definitions replace it, for a compiler with C++20, before any header
// of ITK.
#ifdef __clang__
#define ITK_COMPILER_DETECTION_H
#define ITK_COMPILER_IS_Clang 1
#define ITK_ALIGNAS(X) alignas(X)
#define ITK_ALIGNOF(X) alignof(X)
#define ITK_DEPRECATED [[deprecated]]
#define ITK_DEPRECATED_MSG(MSG) [[deprecated(MSG)]]
#define ITK_CONSTEXPR constexpr
#define ITK_DELETED_FUNCTION = delete
#define ITK_EXTERN_TEMPLATE extern
#define ITK_FINAL final
#define ITK_NOEXCEPT noexcept
#define ITK_NOEXCEPT_EXPR(X) noexcept(X)
#define ITK_NULLPTR nullptr
#define ITK_OVERRIDE override
#define ITK_STATIC_ASSERT(X) static_assert(X, #X)
#define ITK_STATIC_ASSERT_MSG(X, MSG) static_assert(X, MSG)
#define ITK_THREAD_LOCAL thread_local
#endif
#include <itkImageIOBase.h>

namespace kerf::volume {

using ImageIo = itk::ImageIOBase;

/// Keeps the output of ITK, MetaIO and GDCM to std::cerr and std::cout while it lives. In the
/// sandbox, where no other code writes there.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

  /// MetaIO only prints that voxels are missing or cannot be unpacked, and goes on: throws
  /// LoadError for them. The kept output is that of all files read so far.
  void refuse_if_missing(const std::filesystem::path& path) const;

 private:
  std::ostringstream kept_;
  std::streambuf* cerr_;
  std::streambuf* cout_;
};

[[noreturn]] void refuse_unreadable(const std::filesystem::path& path, const std::string& reason);

/// Runs a step of a library; its exceptions become one line that begins with the file.
template <class Step>
auto guarded(const std::filesystem::path& path, Step&& step) {
  try {
    return step();
  } catch (const itk::ExceptionObject& error) {
    refuse_unreadable(path, error.GetDescription());
  } catch (const std::bad_alloc&) {
    throw;  // the sandbox reports the limit
  } catch (const LoadError&) {
    throw;
  } catch (const std::exception& error) {
    refuse_unreadable(path, error.what());
  }
}

/// Reads the header; returns the three extents of a volume (`axes` 3) or of a picture (2). More
/// axes are accepted if they have one layer each. Refuses more than one value per voxel.
[[nodiscard]] std::array<std::int64_t, 3> open_image(const std::filesystem::path& path, ImageIo& io,
                                                     unsigned axes = 3);

/// The type of the opened file's numbers; refuses others.
[[nodiscard]] VoxelType type_of(const std::filesystem::path& path, const ImageIo& io);

/// Reads all voxels of the opened file, unconverted, into `bytes`.
void read_voxels(const std::filesystem::path& path, ImageIo& io, std::span<std::byte> bytes);

/// The claim of the opened file. `kind` is that of its own type; `spacing_known` as in the claim.
[[nodiscard]] UntrustedHeader claim_of(const std::filesystem::path& path, const ImageIo& io,
                                       const std::array<std::int64_t, 3>& size,
                                       std::uint32_t spacing_known);

/// One file that holds a whole volume.
void read_one_file(const std::filesystem::path& path, ImageIo& io, const VolumeHeader& header,
                   const MemoryRequest& offer);

/// A project of InVesalius 3. Throws as above; no ITK in it.
void read_invesalius(const std::filesystem::path& path, const MemoryRequest& offer);
/// Pictures of one size in the order of the numbers in their names.
void read_slice_stack(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& beside, VolumeKind kind,
                      SandboxReader& sandbox, const MemoryRequest& offer);

}  // namespace kerf::volume
