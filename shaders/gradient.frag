// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Direction of the density gradient in texture coordinates.

#ifdef GL_ES

uniform sampler3D u_density;   // 0..1, inside a border of air one voxel thick
uniform vec3 u_texels;         // its extent

float density_of(vec4 texel);

// A browser stores no gradient for this: from the eight corners of a cube, differences along one
// axis, means along the others. Farther corners leave the two voxels over which a border is
// antialiased, and draw terraces.
vec3 gradient_at(vec3 p) {
  const float kReachVox = 1.0;
  vec3 d = kReachVox / u_texels;
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    vec3 side = vec3((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    sum += side * density_of(texture(u_density, p + side * d));
  }
  return sum * u_texels;
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
