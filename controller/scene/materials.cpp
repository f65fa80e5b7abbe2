// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/materials.hpp"

#include <algorithm>
#include <iterator>
#include <string>

#include "shared/volume/label_colour.hpp"

namespace kerf {
namespace {

constexpr std::size_t kDefaultMaterials = 4;

/// Density at half-way to the next softer tissue; the default ones first.
const std::vector<Material>& all_known() {
  static const std::vector<Material> materials = {
      {.name = "none", .iso = 0.0, .machinability = 0.0, .colour = {0.0, 0.0, 0.0}},
      {.name = "enamel", .iso = 0.81, .machinability = 1.0, .colour = {0.91, 0.88, 0.80}},
      {.name = "dentin", .iso = 0.45, .machinability = 3.0, .colour = {0.80, 0.66, 0.42}},
      {.name = "pulp", .iso = 0.14, .machinability = 10.0, .colour = {0.70, 0.25, 0.22}},
      {.name = "bone", .iso = 0.40, .machinability = 4.0, .colour = {0.89, 0.83, 0.68}},
      {.name = "caries", .iso = 0.25, .machinability = 6.0, .colour = {0.42, 0.28, 0.14}},
      {.name = "amalgam", .iso = 0.90, .machinability = 2.5, .colour = {0.55, 0.56, 0.58}}};
  return materials;
}

}  // namespace

std::vector<Material> default_materials() {
  return {all_known().begin(), all_known().begin() + kDefaultMaterials};
}

Material known_material(std::string_view name) {
  const auto known = std::find_if(all_known().begin(), all_known().end(),
                                  [&](const Material& m) { return m.name == name; });
  return known == all_known().end() ? Material{.name = std::string(name)} : *known;
}

Material label_material(std::size_t label, double iso) {
  return {.name = "label " + std::to_string(label), .iso = iso, .colour = label_colour(label)};
}

}  // namespace kerf
