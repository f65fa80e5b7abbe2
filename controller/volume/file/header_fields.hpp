// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace kerf {

/// Keys of a text header, in lower case, and what stands behind them.
using HeaderFields = std::map<std::string, std::string>;

/// Refuses what the reading libraries would refuse in words of their own, or take for something
/// else: a SceneError with the field, its text and what belongs there. What is missing is not
/// looked at.
void check_nrrd_fields(const std::filesystem::path& path, const HeaderFields& fields);
void check_meta_fields(const std::filesystem::path& path, const HeaderFields& fields);

}  // namespace kerf
