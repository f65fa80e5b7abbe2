// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/volume_slices.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>

#include "controller/scene/scene_error.hpp"

namespace kerf::volume {

double slice_distance(const std::filesystem::path& folder, const std::vector<Slice>& slices,
                      const Place& normal) {
  const double step =
      (slices.back().depth_mm - slices.front().depth_mm) / static_cast<double>(slices.size() - 1);
  const double slack_mm = std::max(0.02 * step, 1e-3);  // positions are rounded in the files
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const Place apart = slices[i].origin_mm - slices[i - 1].origin_mm;
    const double depth = dot(apart, normal);
    const Place aside = apart - depth * normal;
    if (std::abs(depth - step) > slack_mm) {
      std::ostringstream text;
      text << folder.string() << ": " << depth << " mm before slice "
           << slices[i].file.filename().string() << " where " << step
           << " mm is usual; add the missing slices or remove doubled ones";
      throw SceneError(text.str());
    }
    if (length(aside) > slack_mm) {
      throw SceneError(folder.string() +
                       ": its axes are not at right angles (tilted gantry); resample it to a "
                       "straight grid first");
    }
  }
  return step;
}

}  // namespace kerf::volume
