// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "record/scene_facts.hpp"

// A manifest that is lost or wrong is made anew, unless that would hide a change of other files.

namespace kerf {

/// Whether the manifest is lost, or to blame for what is wrong. Throws `RecordError` if the folder
/// is no recording.
[[nodiscard]] bool has_wrong_manifest(const std::filesystem::path& folder);

/// Writes manifest.json anew from scene and rows. What only the old one said (session, versions,
/// how the run ended) is unknown then: nothing proves it. The old one is kept as manifest-old.json,
/// and if there is one of that name, it stays. Throws `RecordError` if scene.json or the log cannot
/// be read, or a checksum in the old one is not that of its file: a new one would hide the change;
/// `FileError` if the folder cannot be written.
void repair_manifest(const std::filesystem::path& folder);

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
