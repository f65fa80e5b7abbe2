# SPDX-License-Identifier: Apache-2.0
# The shader files as a module of JavaScript for WebGL 2: for each program one vertex and one
# fragment shader of GLSL ES 3.00, which links no more than one of a stage. What is below stands
# before what uses it, so prototypes go; a uniform that several files declare stays once.
# cmake -DOUTPUT=FILE -DSHADERS=FOLDER -P web_shaders.cmake
cmake_minimum_required(VERSION 3.25)
set(iso screen.vert lighting.frag ray.frag volume_sample.frag followed.frag gradient.frag iso.frag)
set(blend screen.vert lighting.frag ray.frag followed.frag translucent_sample.frag blend.frag)
set(layer screen.vert lighting.frag composite.frag)
set(cell_faces cell_faces.vert cell_faces.frag)
set(mesh mesh.vert lighting.frag mesh.frag)
set(backdrop screen.vert backdrop.frag)
set(smooth screen.vert antialias.frag)
set(shown screen.vert present.frag)

# A browser's default precision is too coarse for a depth, and there is none for these samplers.
set(head "#version 300 es\nprecision highp float;\nprecision highp int;\n")
foreach(sampler sampler2D sampler3D usampler3D sampler2DArray)
  string(APPEND head "precision highp ${sampler};\n")
endforeach()

# Appends a file to `stage_text`, whose uniforms are `known`.
function(append_file file stage_text known)
  file(READ ${SHADERS}/${file} text)
  string(REGEX REPLACE "#version[^\n]*\n" "" text "${text}")
  string(REGEX REPLACE "[ ]*//[^\n]*" "" text "${text}")
  string(REGEX REPLACE "\n[a-z0-9]+ [a-z0-9_]+\\([^{}\n]*\\);" "" text "${text}")
  string(REGEX MATCHALL "\nuniform [a-zA-Z0-9]+ [a-z0-9_]+" uniforms "${text}")
  foreach(uniform ${uniforms})
    if("${uniform}" IN_LIST ${known})
      string(REGEX REPLACE "${uniform}(\\[[A-Z_]+\\])?;" "" text "${text}")
    endif()
  endforeach()
  string(REGEX REPLACE "\n\n+" "\n" text "${text}")
  set(${known} ${${known}} ${uniforms} PARENT_SCOPE)
  set(${stage_text} "${${stage_text}}${text}" PARENT_SCOPE)
endfunction()

set(entries "")
foreach(program iso blend layer cell_faces mesh backdrop smooth shown)
  set(vert "")
  set(frag "")
  set(vert_uniforms "")
  set(frag_uniforms "")
  foreach(file ${${program}})
    string(REGEX REPLACE ".*\\." "" stage ${file})
    append_file(${file} ${stage} ${stage}_uniforms)
  endforeach()
  string(APPEND entries "  ${program}: {vertex: String.raw`${vert}`, fragment: String.raw`${frag}`},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from shaders/; edit those.
/** What each shader begins with; defines come below it. */
export const head = `${head}`;
/** By program, without the head. */
export const shaders = {
${entries}};
")
