// SPDX-License-Identifier: Apache-2.0

#include "visualizer/scene/appearance.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/text/toml.hpp"
#include "visualizer/scene/view_file.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

// The ramp begins at this share of the way from air to its end; nearer to that in voxels whose edge
// is longer than `kOpacityMm` (TransferFunction).
constexpr double kEmptyShare = 0.4;
constexpr double kHighestAir = 0.75;   // of the density where it ends: else hardly a ramp is left
constexpr double kWholeSoftest = 2.0;  // an iso density is half-way up to a material
// What a ramp that begins at air shows outside of a surface, in edges: half of the way on which the
// density of a border rises to half of full. Voxels as full as the body fills them, and
// interpolation between them, blur a border by half an edge (1/12 + 1/6 = 1/4), so it rises by 2 /
// sqrt(2 pi) = 0.80 per edge.
constexpr double kBorderEdges = 0.5 * 0.5 / 0.80;
constexpr double kEightBits = 255.0;
constexpr double kLeastRamp = 1.0 / kDensityMax;  // a step of the density: no division by 0

double softest_iso(std::span<const MaterialView> materials) {
  const auto softer = [](const MaterialView& a, const MaterialView& b) { return a.iso < b.iso; };
  return std::min_element(materials.begin() + 1, materials.end(), softer)->iso;
}

constexpr double kHalfBand = 0.03;  // density; CT noise of dentin is about 0.015
// Over `kOpacityMm`. Enamel lets what is below shine through; behind a millimetre of dentin little
// does.
constexpr double kHardestOpacity = 0.10;
constexpr double kSoftestOpacity = 0.40;
constexpr glm::dvec4 kIvory{0.80, 0.74, 0.62, kSoftestOpacity};

/// Colour and opacity of each material, from the softest to the hardest.
struct MaterialColour {
  double iso;
  std::size_t label;
  glm::dvec4 colour;
};

std::vector<MaterialColour> material_colours(std::span<const MaterialView> materials) {
  std::vector<MaterialColour> colours;
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const double opacity = materials[m].opacity.value_or(default_opacity(materials, m));
    colours.push_back({materials[m].iso, m, glm::dvec4(materials[m].colour, opacity)});
  }
  std::stable_sort(colours.begin(), colours.end(),
                   [](const MaterialColour& a, const MaterialColour& b) { return a.iso < b.iso; });
  return colours;
}

}  // namespace

double TransferFunction::presence(double density) const noexcept {
  return std::clamp((density - empty) / (full - empty), 0.0, 1.0);
}

Density TransferFunction::lowest_seen() const noexcept {
  const double seen = std::max(0.0, empty - 0.5 / kEightBits) * kDensityMax;
  return static_cast<Density>(std::max(1.0, std::floor(seen)));
}

TransferFunction make_transfer_function(std::span<const MaterialView> materials, Density iso,
                                        bool has_labels, Density air, double longest_mm) {
  TransferFunction made{.materials = make_palette(materials)};
  made.full = has_labels && materials.size() > 1 ? kWholeSoftest * softest_iso(materials)
                                                 : iso / kDensityMax;
  made.full = std::clamp(made.full, 2.0 / kEightBits, 1.0);
  const double empty_of_all = std::min(air / kDensityMax, kHighestAir * made.full);
  const double shorter = has_labels ? 1.0 : std::max(longest_mm / kOpacityMm, 1.0);
  const double ramp = (1.0 - kEmptyShare) / shorter;
  made.empty = made.full - std::max(ramp * (made.full - empty_of_all), kLeastRamp);
  made.border_mm = kBorderEdges * ramp * longest_mm;
  return made;
}

TransferFunction make_transfer_function(const SceneView& scene, std::size_t volume,
                                        const VolumeContent& content) {
  const Density iso = scene.volumes[volume].iso;
  const glm::dvec3 edges_mm = scene.volumes[volume].edges_mm();
  const double longest_mm = std::max({edges_mm.x, edges_mm.y, edges_mm.z});
  if (!content.labels.empty()) {
    return make_transfer_function(scene.materials, iso, true, 0, longest_mm);
  }
  return make_transfer_function(scene.materials, iso, false, air_level(content.density, iso),
                                longest_mm);
}

Density air_level(std::span<const Density> density, Density iso) {
  constexpr std::size_t kEnough = 1U << 20;
  const std::size_t step = density.size() / kEnough | 1U;  // odd: not one column of all rows
  std::array<std::size_t, 256> counts{};                   // by the upper 8 bits
  std::size_t below = 0;
  for (std::size_t i = 0; i < density.size(); i += step) {
    if (density[i] >= iso) continue;
    ++counts[density[i] >> 8];
    ++below;
  }
  std::size_t median = 0;
  for (std::size_t passed = counts[0]; 2 * passed < below; passed += counts[median]) ++median;
  return static_cast<Density>(median << 8);
}

double default_opacity(std::span<const MaterialView> materials, std::size_t index) {
  if (materials.size() < 3) return kSoftestOpacity;
  // In equal ratios from the softest to the hardest; among equals the first is the softer.
  std::size_t softer = 0;
  for (std::size_t m = 1; m < materials.size(); ++m) {
    const double iso = materials[m].iso;
    if (iso < materials[index].iso || (iso == materials[index].iso && m < index)) ++softer;
  }
  const double rank = static_cast<double>(softer) / static_cast<double>(materials.size() - 2);
  return kSoftestOpacity * std::pow(kHardestOpacity / kSoftestOpacity, rank);
}

Palette make_palette(std::span<const MaterialView> materials) {
  const std::vector<MaterialColour> colours = material_colours(materials);
  Palette palette{};
  for (std::size_t i = 0; i < kPaletteWidth; ++i) {
    const double density = static_cast<double>(i) / (kPaletteWidth - 1);
    glm::dvec4 colour = colours.empty() ? kIvory : colours.front().colour;
    for (std::size_t m = 1; m < colours.size(); ++m) {
      const double iso = colours[m].iso;
      const double fraction = glm::smoothstep(iso - kHalfBand, iso + kHalfBand, density);
      colour = glm::mix(colour, colours[m].colour, fraction);
    }
    palette[0][i] = glm::vec4(colour);
    palette[1][i] = glm::vec4(kIvory);
  }
  for (const MaterialColour& material : colours) {
    if (material.label < kPaletteWidth) palette[1][material.label] = glm::vec4(material.colour);
  }
  if (!materials.empty()) palette[1][0] = glm::vec4(glm::vec3(materials[0].colour), 0.0F);
  return palette;
}

Opacities parse_transfer(std::string_view text, const std::string& name) {
  const TomlNode file = parse_view_file(text, name);
  for (const TomlNode& entry : file.entries) {
    if (entry.key == "opacity" && entry.form == TomlNode::Form::table) continue;
    refuse_in(name, entry.key_line, entry.key + " is not known here; known is the table [opacity]");
  }
  Opacities opacities;
  const TomlNode* table = file.find("opacity");
  if (table == nullptr) throw VisualizerError(name + ": there is no table [opacity]; write one");
  for (const TomlNode& entry : table->entries) {
    const double opacity = entry.number().value_or(-1.0);
    if (!(opacity >= 0.0 && opacity <= 1.0)) {
      refuse_in(name, entry.line,
                "opacity." + entry.key + " = " + entry.shown +
                    " is no opacity; give a number from 0 to 1");
    }
    opacities[entry.key] = opacity;
  }
  return opacities;
}

Opacities read_transfer(const std::filesystem::path& file) {
  return parse_transfer(read_view_file(file, "transfer function",
                                       "name a transfer function, as w in the window writes it"),
                        file.string());
}

void write_transfer(const std::filesystem::path& file, const Opacities& opacities) {
  std::ostringstream text;
  text << "# Opacity over 1/8 mm, by material: kerf-visualizer --transfer FILE\n[opacity]\n";
  for (const auto& [material, opacity] : opacities) {
    // A quoted key of TOML is a string of JSON; toml++ itself leaves quotes in keys as they are.
    text << Json(material).canonical() << " = " << opacity << "\n";
  }
  write_new_file(file, text.str());
}

void check_materials(const Opacities& opacities, const SceneView& scene, const std::string& name) {
  std::vector<std::string> known;
  for (std::size_t m = 1; m < scene.materials.size(); ++m) known.push_back(scene.materials[m].name);
  for (const auto& [material, opacity] : opacities) {
    if (std::ranges::find(known, material) != known.end()) continue;
    throw VisualizerError(name + ": opacity." + one_line(material) +
                          " is no material of this scene; it has " +
                          (known.empty() ? "none" : listed(known)));
  }
}

}  // namespace kerf
