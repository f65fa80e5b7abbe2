// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/manifest.hpp"

// What scene.json says of a run, as far as manifest.json says it too.

namespace kerf {

/// The facts of a scene. Scenes of earlier versions may lack some.
struct SceneFacts {
  struct Volume {
    std::string name;
    std::string density_hash;  ///< `volume_hash` of the content at the start: name of its file
    std::array<std::int32_t, 3> size_vox{};
    std::array<double, 3> spacing_mm{};
  };
  std::optional<std::uint32_t> tick_ns;  ///< none without a rate
  std::optional<std::size_t> arms;       ///< none without a device
  std::vector<Volume> volumes;           ///< empty if one of them is incomplete or impossible
  std::string config_hash;  ///< of the scene without its source, as 16 hexadecimal digits
};

/// Throws JsonError if the text is no JSON object.
[[nodiscard]] SceneFacts scene_facts(std::string_view scene_json);

/// `read_manifest`, with length of a tick, arms and voxels as scene.json has them: it is the source
/// of these facts, which the manifest repeats for other programs. Throws as `read_manifest`; a
/// scene that cannot be read is left to those who need it.
[[nodiscard]] Manifest read_facts(const std::filesystem::path& folder);

/// Replaces length of a tick, arms and voxels in `manifest` by the scene's, if it has them.
void take_facts(const SceneFacts& scene, Manifest& manifest);

}  // namespace kerf
