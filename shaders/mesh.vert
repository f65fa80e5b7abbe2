// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A mesh: the tool, the force arrow.

layout(location = 0) in vec3 a_position;  // in the mesh's own unit
layout(location = 1) in vec3 a_normal;

uniform mat4 u_eye_from_mesh;  // to mm
uniform mat3 u_eye_from_mesh_normal;
uniform mat4 u_clip_from_eye;

out vec3 v_eye_mm;
out vec3 v_normal;

void main() {
  vec4 eye = u_eye_from_mesh * vec4(a_position, 1.0);
  v_eye_mm = eye.xyz;
  v_normal = u_eye_from_mesh_normal * a_normal;
  gl_Position = u_clip_from_eye * eye;
}
