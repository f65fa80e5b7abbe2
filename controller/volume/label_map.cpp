// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/label_map.hpp"

#include <bitset>
#include <cmath>
#include <cstddef>
#include <string>

#include "controller/scene/scene.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/volume/volume_noise.hpp"

namespace kerf {

bool take_label_map(const SourceVolume& source, VolumeImage& image, const std::string& place) {
  constexpr std::size_t kMostLabels = 256;
  if (source.min != 0 || !(source.max < kMostLabels)) return false;
  std::bitset<kMostLabels> seen;
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    const double value = static_cast<double>(source.values[i]);
    if (value != std::floor(value)) return false;
    seen.set(static_cast<std::size_t>(value));
  }
  if (seen.count() < 3 || !is_label_map(image.grid, image.density)) return false;
  if (source.max >= kMaxMaterials) {
    const std::string last = std::to_string(std::lround(source.max));
    throw SceneError(place + "label " + last + " is above " + std::to_string(kMaxMaterials - 1) +
                     ", the last that a scene has a material for; number the labels anew, or take "
                     "them as a scan with --window 0," +
                     last);
  }
  image.labels.resize(image.density.size());
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    image.labels[i] = static_cast<Label>(source.values[i]);
    image.density[i] = static_cast<Density>(image.labels[i] == 0 ? 0 : kDensityMax);
  }
  return true;
}

}  // namespace kerf
