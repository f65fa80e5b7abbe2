// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/import_scene.hpp"

#include <algorithm>
#include <cstddef>
#include <sstream>

#include "controller/scene/materials.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_file.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

/// On one line of a comment, whatever bytes the name has.
std::string comment(const std::string& name) {
  std::string text = Json(name).canonical();
  std::ranges::replace(text, '\x7f', ' ');
  return text;
}

bool is_control(char c) {
  return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
}

/// Balls of these sizes, those that fit; of a volume that is smaller than all, one as large as it.
std::string tools_text(int longest_vox) {
  std::ostringstream text;
  const auto add = [&text](int size_vox) {
    text << "\n[[tool]]\nname = \"ball " << size_vox
         << "\"\nshape = \"ball\"\nsize_vox = " << size_vox << "  # in voxels of this volume\n";
  };
  bool any = false;
  for (const int size_vox : {16, 10, 24}) {
    if (size_vox > longest_vox) continue;
    add(size_vox);
    any = true;
  }
  if (!any) add(longest_vox);
  return text.str();
}

constexpr const char* kDevice = R"(
[device]
personality = "omni"
fit = true  # the volume fills the workspace; cutting, as for voxels of 0.125 mm, grows with its own

[force]
stiffness_n_per_mm = 0.4   # of the coupling, at the device
damping_ns_per_mm = 0.002

[cut]
machinability_mm3_per_s_n = 4  # tuned: to see a cavity within seconds
)";

}  // namespace

void check_imported_scene(const std::string& text, const std::filesystem::path& scene,
                          const std::filesystem::path& volume) {
  const std::string name = volume.filename().string();
  const bool plain = std::ranges::none_of(name, is_control);
  if (plain && parse_scene(text, scene).volumes.front().file == name) return;
  throw SceneError(volume.string() +
                   ": a scene cannot name this file (its name has control characters, or is no "
                   "UTF-8); give another with --out");
}

std::string imported_scene_text(const ImportedScene& scene) {
  std::ostringstream text;
  text << "# Made by kerf volume import from " << comment(scene.source)
       << "\n# ./kerf demo --scene THIS; what each key means: "
          "docs/scene-keys.md\n\n[[volume]]\nfile = "
       << Json(scene.volume.filename().string()).canonical()
       << "\nwindow = [0, 65535]\niso = " << scene.iso_density;
  if (scene.proposal != nullptr) {
    text << "  # " << scene.proposal->iso << scene.proposal->unit() << " of the source, where "
         << scene.proposal->window.lo << " is 0 and " << scene.proposal->window.hi << " is 1";
  }
  text << "\ndenoise = \"off\"  # the import made " << scene.passes
       << (scene.passes == 1 ? " pass" : " passes") << "\ncrop = false     # the import did\n";
  if (scene.proposal != nullptr) {
    text << "\n# By density alone; no voxel has a label.\n";
    for (const ProposedMaterial& material : scene.proposal->materials) {
      const auto& c = material.colour;
      text << "[[material]]\nname = " << Json(material.name).canonical()
           << "\niso = " << scene.proposal->density_of(material.from) << "\ncolour = [" << c[0]
           << ", " << c[1] << ", " << c[2] << "]\n";
    }
  }
  for (std::size_t label = default_materials().size(); label <= scene.last_label; ++label) {
    const Material material = label_material(label, scene.iso_density);
    const auto& c = material.colour;
    text << "\n[[material]]\nname = " << Json(material.name).canonical()
         << "\niso = " << material.iso << "\ncolour = [" << c[0] << ", " << c[1] << ", " << c[2]
         << "]\n";
  }
  text << tools_text(scene.longest_vox) << kDevice;
  return text.str();
}

}  // namespace kerf
