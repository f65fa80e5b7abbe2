// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "controller/load/loaded_scene.hpp"

namespace kerf::test {

/// A folder of its own, gone at the end.
class TempFolder {
 public:
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "kerf-scene-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() { std::filesystem::remove_all(path_); }

  std::filesystem::path write(const std::string& name, std::string_view text) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file << text;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

/// NRRD text and data of u16 values, x fastest, little-endian.
inline std::string nrrd(VoxelGrid grid, std::array<double, 3> spacing_mm,
                        const std::vector<Density>& values) {
  std::string text =
      "NRRD0004\ntype: uint16\ndimension: 3\nencoding: raw\nendian: little\nsizes: " +
      std::to_string(grid.nx) + " " + std::to_string(grid.ny) + " " + std::to_string(grid.nz) +
      "\nspacings: " + std::to_string(spacing_mm[0]) + " " + std::to_string(spacing_mm[1]) + " " +
      std::to_string(spacing_mm[2]) + "\n\n";
  for (const Density value : values) {
    text += static_cast<char>(value & 0xff);
    text += static_cast<char>(value >> 8);
  }
  return text;
}

/// A box of `inside` in a grid of air.
inline std::vector<Density> block(VoxelGrid grid, VoxelBox box, Density inside) {
  std::vector<Density> values(grid.voxel_count(), 0);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      for (std::int32_t x = box.lo.x; x < box.hi.x; ++x) values[grid.index(x, y, z)] = inside;
    }
  }
  return values;
}

/// The message of the LoadError that `action` throws; empty when it throws none.
template <class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const LoadError& error) {
    return error.what();
  }
  return {};
}

}  // namespace kerf::test
