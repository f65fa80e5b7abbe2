// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Six vertices for each face between an active and an inactive macrocell.

layout(location = 0) in uvec4 a_face;  // cell x, y, z; 2 * axis + (1 on the high side)

uniform mat4 u_clip_from_cell;
uniform float u_near_mm;

void main() {
  const vec2 kCorner[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1),   //
                                 vec2(0, 0), vec2(1, 1), vec2(0, 1));
  vec2 at = kCorner[gl_VertexID];
  uint axis = a_face.w >> 1u;
  bool high = (a_face.w & 1u) != 0u;
  if (!high) at = at.yx;  // counter-clockwise when seen from the outside
  vec3 corner = axis == 0u ? vec3(high, at) : axis == 1u ? vec3(at.y, high, at.x) : vec3(at, high);
  gl_Position = u_clip_from_cell * vec4(vec3(a_face.xyz) + corner, 1.0);
  // No far plane: beyond it the nearest face still says whether a ray has been inside all the way.
  // Nor a near one: where depth cannot be clamped, cell_faces.frag writes it.
#ifdef GL_ES
  gl_Position.z = 0.0;
#else
  gl_Position.z = gl_Position.w - 2.0 * u_near_mm;
#endif
}
