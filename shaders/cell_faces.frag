// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Where the ray of this pixel must begin to sample. The nearest face is seen from behind only when
// the near plane is inside the active cells; the ray then begins at the near plane.

uniform float u_near_mm;

out float o_entry_mm;

void main() {
  o_entry_mm = gl_FrontFacing ? 1.0 / gl_FragCoord.w : u_near_mm;
#ifdef GL_ES
  gl_FragDepth = clamp(1.0 - u_near_mm * gl_FragCoord.w, 0.0, 1.0);
#endif
}
