// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "record/scene_facts.hpp"

// What keeps a repair from hiding a change of other files.

namespace kerf {

/// Whether the recording of a run with this scene may have a file `name`, as "volumes/HASH.npy.gz",
/// beside manifest and log. `missed`: ticks before its log, of which it may have the inputs.
[[nodiscard]] bool may_have_file(const SceneFacts& scene, std::string_view name,
                                 std::uint64_t missed);

/// Which file is not the one whose checksum the manifest in `folder` has, as far as that can be
/// read: one line; empty if there is none. A checksum of another form says nothing, nor does
/// `config_hash` if the checksum of scene.json is right. Throws `RecordError`.
[[nodiscard]] std::string contradiction_to_manifest(const std::filesystem::path& folder,
                                                    const SceneFacts& scene);

}  // namespace kerf
