// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Between the gradient of cells and that of their voxels: `followed` of visualizer/scene/gradient.cpp,
// for a browser, where this is left to the shader.

// 1 where the cosine between two vectors is `agree` or more, 0 where it is `differ` or less; 0 for
// vectors without a direction.
float agreement(vec3 a, vec3 b, float agree, float differ) {
  float a_2 = dot(a, a), b_2 = dot(b, b);
  if (a_2 == 0.0 || b_2 == 0.0) return 0.0;
  return clamp((dot(a, b) / sqrt(a_2 * b_2) - differ) / (agree - differ), 0.0, 1.0);
}

// `voxel` is per voxel edge, `cell` and what is returned per longest edge.
vec3 followed(vec3 voxel, vec3 cell, vec3 fine, vec3 per_edge) {
  float voxel_2 = dot(voxel, voxel);
  if (voxel_2 == 0.0) return cell;
  vec3 across = fine * voxel;
  float says = clamp(4.0 * dot(across, across) / voxel_2 - 1.0, 0.0, 1.0);
  float part = max(agreement(across, fine * cell, 0.9, 0.7), 1.0 - says);
  vec3 direction = voxel / per_edge;
  return mix(direction * sqrt(voxel_2 / dot(direction, direction)), cell, part);
}
