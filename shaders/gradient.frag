// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Direction of the density gradient in texture coordinates.

#ifdef GL_ES

uniform sampler3D u_density;   // 0..1, inside a border of air one voxel thick
uniform vec3 u_texels;         // its extent
uniform sampler3D u_cell_gradient;  // of each cell (bridge/page/web/cell_gradients.js)
uniform vec3 u_cell_scale;     // from texture coordinates of u_density to those of u_cell_gradient
uniform vec3 u_cell_shift;
uniform vec3 u_per_edge;       // edges of a voxel by the longest
uniform vec3 u_fine;           // 1 along axes where cells have several voxels

float density_of(vec4 texel);
vec3 followed(vec3 voxel, vec3 cell, vec3 fine, vec3 per_edge);

// Where a cell is one voxel, its gradient; else also that of the voxels, from the eight corners of a
// cube: differences along one axis, means along the others. Farther corners leave the two voxels over
// which a border is antialiased, and draw terraces.
vec3 gradient_at(vec3 p) {
  const float kReachVox = 1.0;
  vec3 cell = textureLod(u_cell_gradient, p * u_cell_scale + u_cell_shift, 0.0).xyz;
  if (u_fine == vec3(0.0)) return cell * u_per_edge * u_texels;
  vec3 d = kReachVox / u_texels;
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    vec3 side = vec3((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    sum += side * density_of(texture(u_density, p + side * d));
  }
  // A step from air to full density over two edges is 1 in each of four pairs of corners.
  return followed(0.25 * sum, cell, u_fine, u_per_edge) * u_per_edge * u_texels;
}

#else

uniform sampler3D u_gradient;   // of each voxel (visualizer/cast/gradient_rows.hpp)
uniform vec3 u_gradient_scale;  // to texture coordinates

vec3 gradient_at(vec3 p) {
  const float kLeast = 1e-6;  // less is the rounding of none
  vec3 gradient = textureLod(u_gradient, p, 0.0).xyz - 32768.0 / 65535.0;
  return dot(gradient, gradient) > kLeast * kLeast ? gradient * u_gradient_scale : vec3(0.0);
}

#endif
