# SPDX-License-Identifier: Apache-2.0
# Writes the shader files as raw string literals, so that a binary runs from anywhere.
# cmake -DOUTPUT=FILE -DSHADERS=a.vert,b.frag -P embed_shaders.cmake
string(REPLACE "," ";" SHADERS "${SHADERS}")
set(entries "")
foreach(shader ${SHADERS})
  get_filename_component(file ${shader} NAME)
  file(READ ${shader} text)
  string(APPEND entries "    {\"${file}\", R\"GLSL(${text})GLSL\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from shaders/; edit those.
#include <array>

#include \"visualizer/gl/program.hpp\"

namespace kerf {

namespace {
constexpr auto kTexts = std::to_array<ShaderText>({
${entries}});
}  // namespace

std::span<const ShaderText> shader_texts() noexcept { return kTexts; }

}  // namespace kerf
")
