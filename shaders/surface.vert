// SPDX-License-Identifier: Apache-2.0
#version 450 core
// The surface of a volume as a mesh; each block of 8^3 cells is one draw, the block its instance.

layout(location = 0) in vec3 a_position;  // 1/4096 voxel from the block's start
layout(location = 1) in vec3 a_normal;    // in voxel coordinates
layout(location = 2) in vec4 a_shading;   // linear colour, ambient occlusion factor
layout(location = 3) in vec3 a_block;     // block (i, j, k) starts at voxel 8i - 1

uniform mat4 u_eye_from_voxel;  // to mm
uniform mat3 u_eye_from_voxel_normal;
uniform mat4 u_clip_from_eye;
uniform vec4 u_clip_plane_eye;  // clip plane: shown where dot(this, (p, 1)) >= 0, p in eye mm

out vec3 v_eye_mm;
out vec3 v_normal;
out vec4 v_shading;

void main() {
  // Exact in 24 bits below 4096 voxels, so blocks that meet do so to the bit.
  vec3 voxel = 8.0 * a_block - 1.0 + a_position / 4096.0;
  vec4 eye = u_eye_from_voxel * vec4(voxel, 1.0);
  v_eye_mm = eye.xyz;
  v_normal = u_eye_from_voxel_normal * a_normal;
  v_shading = a_shading;
  gl_ClipDistance[0] = dot(u_clip_plane_eye, eye);
  gl_Position = u_clip_from_eye * eye;
}
