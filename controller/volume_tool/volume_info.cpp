// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/volume_info.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include "shared/posix/new_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// One character per bin, taller with the logarithm of the count.
std::string bars(const VolumeInfo& info) {
  constexpr std::array<const char*, 9> kBars{" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double most =
      static_cast<double>(*std::max_element(info.histogram.begin(), info.histogram.end()));
  std::string line;
  for (const std::uint64_t count : info.histogram) {
    const double height = std::log1p(static_cast<double>(count)) / std::log1p(most);
    line += kBars[static_cast<std::size_t>(std::ceil(height * (kBars.size() - 1)))];
  }
  return line;
}

/// The noise in one line: in values of a file of that window, and what a scene makes of it.
std::string noise_line(const Noise& noise, Window window) {
  if (noise.share == 0) return "noise      none found";
  const int passes = passes_for(noise);
  char text[128];
  std::snprintf(
      text, sizeof text,
      "noise      %.4g (%.3g %% of the surface's step); denoise = \"auto\" makes %d pass%s",
      noise.density * (window.hi - window.lo), 100 * noise.share, passes, passes == 1 ? "" : "es");
  return text;
}

}  // namespace

VolumeInfo describe(const std::string& file, const SourceVolume& volume, Window window) {
  const VolumeImage image = apply_window(volume, window);
  VolumeInfo info;
  static_cast<VolumeFrame&>(info) = volume;
  info.file = file;
  info.has_spacing = volume.has_spacing;
  info.min = volume.min;
  info.max = volume.max;
  info.window = window;
  info.otsu = otsu_threshold(image);
  info.otsu_value = window.lo + (window.hi - window.lo) * info.otsu / kDensityMax;
  info.noise = noise_of(image.grid, image.density, info.otsu);
  info.solid = solid_box(image, info.otsu);
  const auto solid = std::count_if(image.density.begin(), image.density.end(),
                                   [&](Density d) { return d >= info.otsu; });
  info.solid_ratio = static_cast<double>(solid) / static_cast<double>(image.density.size());
  for (const Density d : image.density) {
    ++info.histogram[std::size_t{d} * VolumeInfo::kHistogramBins >> 16];
  }
  return info;
}

void print(const VolumeInfo& info, std::ostream& out) {
  const auto& s = info.spacing_mm;
  const auto& o = info.origin_mm;
  const auto& d = info.direction;
  out << "file       " << escaped(info.file) << "\nsize       " << info.grid.nx << " x "
      << info.grid.ny << " x " << info.grid.nz << " voxels\nspacing    ";
  if (info.has_spacing) {
    out << s[0] << " x " << s[1] << " x " << s[2] << " mm\nextent     " << s[0] * info.grid.nx
        << " x " << s[1] * info.grid.ny << " x " << s[2] * info.grid.nz << " mm\n";
  } else {
    out << "not in the file; give it with --spacing or spacing_mm\n";
  }
  out << "origin     " << o[0] << " " << o[1] << " " << o[2] << " mm\ndirection  (" << d[0] << " "
      << d[3] << " " << d[6] << ") (" << d[1] << " " << d[4] << " " << d[7] << ") (" << d[2] << " "
      << d[5] << " " << d[8] << ")\nvalues     " << info.min << " .. " << info.max
      << "\nwindow     " << info.window.lo << " .. " << info.window.hi << "\notsu       "
      << info.otsu_value << " (density " << info.otsu / kDensityMax << ")\n"
      << noise_line(info.noise, info.window) << "\nsolid box  (" << info.solid.lo.x << ", "
      << info.solid.lo.y << ", " << info.solid.lo.z << ") .. (" << info.solid.hi.x - 1 << ", "
      << info.solid.hi.y - 1 << ", " << info.solid.hi.z - 1 << "), " << 100.0 * info.solid_ratio
      << " % of the voxels are solid\nhistogram  |" << bars(info) << "| (log)\n";
}

void write_report(const VolumeInfo& info, const std::filesystem::path& path) {
  const auto corner = [](VoxelIndex v) { return std::array{v.x, v.y, v.z}; };
  const Json report{{"denoise_passes", passes_for(info.noise)},
                    {"direction", info.direction},
                    {"file", info.file},
                    {"has_spacing", info.has_spacing},
                    {"histogram", info.histogram},
                    {"max", info.max},
                    {"min", info.min},
                    {"noise_density", info.noise.density},
                    {"noise_share", info.noise.share},
                    {"origin_mm", info.origin_mm},
                    {"otsu_density", info.otsu / kDensityMax},
                    {"otsu_value", info.otsu_value},
                    {"size_vox", std::array{info.grid.nx, info.grid.ny, info.grid.nz}},
                    {"solid_box", {{"hi", corner(info.solid.hi)}, {"lo", corner(info.solid.lo)}}},
                    {"solid_ratio", info.solid_ratio},
                    {"spacing_mm", info.spacing_mm},
                    {"window", std::array{info.window.lo, info.window.hi}}};
  write_new_file(path, report.document());
}

}  // namespace kerf
