// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Slices at right angles to the view axis.

layout(location = 0) in vec3 a_vertex;  // x, y in eye mm; number of the slice

uniform mat4 u_clip_from_eye;
uniform float u_step_mm;

flat out float v_slice;

void main() {
  float eye_mm = a_vertex.z * u_step_mm;
  v_slice = a_vertex.z;
  gl_Position = u_clip_from_eye * vec4(a_vertex.xy, -eye_mm, 1.0);
}
