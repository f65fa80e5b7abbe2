// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/import_scene.hpp"

#include <algorithm>
#include <sstream>

#include "shared/text/json.hpp"

namespace kerf {
namespace {

/// On one line of a comment.
std::string comment(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
  return text;
}

constexpr const char* kTools = R"(
[[tool]]
name = "ball 16"
shape = "ball"
size_vox = 16  # in voxels of this volume

[[tool]]
name = "ball 10"
shape = "ball"
size_vox = 10

[[tool]]
name = "ball 24"
shape = "ball"
size_vox = 24

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
  text << kTools;
  return text.str();
}

}  // namespace kerf
