// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/tool/tool_mesh.hpp"

// The closed parts of a mesh: which way each faces, and what its user should know of the whole.

namespace kerf {

/// Turns the whole mesh outward, and then each part of it that is no hollow in another. A part is
/// judged after those that it lies in, for any order in the file. Returns the enclosed volume.
double turn_outward(ToolMesh& mesh);

/// What may be a slip in a mesh that encloses a solid, on one line; or empty: several shells, a
/// body that is round about another axis than the spindle's, or stands beside it. Load time.
[[nodiscard]] std::string mesh_note(const ToolMesh& mesh);

}  // namespace kerf
