// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <sstream>
#include <type_traits>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_header.hpp"
#include "controller/volume/file/volume_limits.hpp"
#include "shared/text/number.hpp"

namespace kerf::volume {

namespace fs = std::filesystem;

void set_frame(const fs::path& path, Place x, Place y, Place z, SourceVolume& volume) {
  constexpr double kSkew = 2e-3;  // files round their cosines; a shear is far above this
  const double skew =
      std::max({std::abs(dot(x, y)), std::abs(dot(y, z)), std::abs(dot(z, x)),
                std::abs(dot(x, x) - 1.0), std::abs(dot(y, y) - 1.0), std::abs(dot(z, z) - 1.0)});
  if (!(skew < kSkew)) {
    throw SceneError(path.string() +
                     ": its axes are not at right angles; resample it to a straight grid first");
  }
  x = unit(x);
  y = unit(y - dot(x, y) * x);
  const Place right_handed = cross(x, y);
  if (dot(right_handed, z) < 0.0) {
    const auto layer = static_cast<std::ptrdiff_t>(volume.values.bytes().size()) / volume.grid.nz;
    auto low = volume.values.bytes().begin();
    auto high = volume.values.bytes().end();
    for (; high - low >= 2 * layer; low += layer) {
      high -= layer;
      std::swap_ranges(low, low + layer, high);
    }
    const double depth_mm = volume.spacing_mm[2] * (volume.grid.nz - 1);
    volume.origin_mm = volume.origin_mm - depth_mm * right_handed;
  }
  volume.direction = {x[0], y[0], right_handed[0], x[1], y[1], right_handed[1],
                      x[2], y[2], right_handed[2]};
}

void set_grid(const fs::path& path, const std::array<std::int64_t, 3>& size, SourceVolume& volume) {
  check_grid(path.string(), size[0], size[1], size[2]);
  volume.grid = {static_cast<std::int32_t>(size[0]), static_cast<std::int32_t>(size[1]),
                 static_cast<std::int32_t>(size[2])};
}

void set_spacing(const fs::path& path, const ReadOptions& options, bool in_file,
                 const std::array<double, 3>& from_file, SourceVolume& volume) {
  volume.has_spacing = in_file || options.spacing_mm.has_value();
  if (options.spacing_mm) {
    volume.spacing_mm = *options.spacing_mm;
  } else if (in_file) {
    volume.spacing_mm = from_file;
  } else if (!options.allow_missing_spacing) {
    throw SceneError(path.string() +
                     ": spacing is not in the file; add `spacing_mm = [x, y, z]` to the scene or "
                     "`--spacing x,y,z` (mm)");
  }
  check_spacing(path.string(), volume.spacing_mm);
}

void set_origin(const fs::path& path, const std::array<double, 3>& origin_mm,
                SourceVolume& volume) {
  for (const double o : origin_mm) {
    if (std::isfinite(o)) continue;
    throw SceneError(path.string() +
                     ": its origin is not a number of mm; correct the header, or leave it out");
  }
  volume.origin_mm = origin_mm;
}

std::vector<double> dicom_distances(std::string_view text) {
  constexpr std::string_view kPadding{" \0", 2};  // to an even length
  std::vector<double> distances;
  for (std::size_t next = 0; next != text.npos;) {
    next = text.find('\\');
    std::string_view word = text.substr(0, next);
    if (next != text.npos) text.remove_prefix(next + 1);
    word.remove_prefix(std::min(word.find_first_not_of(kPadding), word.size()));
    word = word.substr(0, word.find_last_not_of(kPadding) + 1);
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto value = number_in(word);
    if (!value || !(*value > 0)) return {};
    distances.push_back(*value);
  }
  return distances;
}

namespace {

/// Of floats, which may be no numbers.
void set_float_range(const fs::path& path, std::span<const float> values, SourceVolume& volume) {
  float min = std::numeric_limits<float>::infinity();
  float max = -min;
  std::uint64_t bad = 0;
  std::uint64_t first_bad = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float v = values[i];
    if (!std::isfinite(v) && bad++ == 0) first_bad = i;
    min = std::min(min, v);
    max = std::max(max, v);
  }
  if (bad != 0) {
    refuse_not_finite(path, bad, first_bad, static_cast<std::uint64_t>(volume.grid.nx),
                      static_cast<std::uint64_t>(volume.grid.ny));
  }
  volume.min = static_cast<double>(min);
  volume.max = static_cast<double>(max);
}

}  // namespace

void set_range(const fs::path& path, SourceVolume& volume) {
  volume.values.visit([&]<class T>(std::span<const T> values) {
    if constexpr (std::is_same_v<T, float>) {
      set_float_range(path, values, volume);
    } else {
      T least = values.front(), most = least;
      for (const T v : values) {  // a loop that the compiler turns into vectors
        least = std::min(least, v);
        most = std::max(most, v);
      }
      volume.min = least;
      volume.max = most;
    }
  });
}

namespace {

/// The slices do not follow one another evenly: names the one whose distance to the slice before it
/// is the oddest. Most others are right, so the median is what is usual.
[[noreturn]] void refuse_uneven(const fs::path& folder, const std::vector<Slice>& slices) {
  std::vector<double> apart;
  for (std::size_t i = 1; i < slices.size(); ++i) {
    apart.push_back(slices[i].depth_mm - slices[i - 1].depth_mm);
  }
  std::vector<double> sorted = apart;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  const auto oddest = std::ranges::max_element(
      apart, {}, [&](double distance) { return std::abs(distance - usual); });
  const auto slice = static_cast<std::size_t>(oddest - apart.begin()) + 1;
  std::ostringstream text;
  text << folder.string() << ": " << *oddest << " mm before slice "
       << slices[slice].file.filename().string() << " where " << usual
       << " mm is usual; add the missing slices or remove doubled ones";
  throw SceneError(text.str());
}

}  // namespace

double slice_distance(const std::filesystem::path& folder, const std::vector<Slice>& slices,
                      const Place& normal) {
  const double step =
      (slices.back().depth_mm - slices.front().depth_mm) / static_cast<double>(slices.size() - 1);
  const double slack_mm = std::max(0.02 * step, 1e-3);  // positions are rounded in the files
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const Place apart = slices[i].origin_mm - slices[i - 1].origin_mm;
    const double depth = dot(apart, normal);
    const Place aside = apart - depth * normal;
    if (std::abs(depth - step) > slack_mm) refuse_uneven(folder, slices);
    if (length(aside) > slack_mm) {
      throw SceneError(folder.string() +
                       ": its axes are not at right angles (tilted gantry); resample it to a "
                       "straight grid first");
    }
  }
  return step;
}

}  // namespace kerf::volume
