// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/tool/inner_samples.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_mesh.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "tests/fuzz/text_fuzz.hpp"

/// The file, and what is made of a mesh that passes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kerf::fuzz::must_read_or_explain<kerf::LoadError>(data, size, [](std::string_view bytes) {
    kerf::ToolMesh mesh = kerf::join_triangles(kerf::parse_stl(bytes, "bur.stl"), 1, "bur.stl");
    static_cast<void>(kerf::mesh_surface_samples(mesh, 64));
    if (kerf::mesh_side_vox(mesh, 0.25) <= kerf::kMaxToolSide) {
      static_cast<void>(kerf::make_mesh_tool("bur", std::move(mesh), 0.25));
    }
    return 0;
  });
  return 0;
}
