// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Direction of the density gradient, per voxel edge: one of three, chosen by a define. From samples
// on the fly, or from what was worked out for each voxel (visualizer/scene/gradient.hpp).

uniform sampler3D u_density;   // 0..1, inside a border of air one voxel thick
uniform vec3 u_texels;         // its extent

float density_of(vec4 texel);

#if defined(KERF_GRADIENT_FARID5)

uniform sampler3D u_gradient;  // of the same extent

vec3 gradient_at(vec3 p) { return textureLod(u_gradient, p, 0.0).xyz; }

#elif defined(KERF_GRADIENT_CENTRAL)

vec3 gradient_at(vec3 p) {
  vec3 d = 1.0 / u_texels;
  vec3 above = vec3(density_of(textureLod(u_density, p + vec3(d.x, 0.0, 0.0), 0.0)),
                    density_of(textureLod(u_density, p + vec3(0.0, d.y, 0.0), 0.0)),
                    density_of(textureLod(u_density, p + vec3(0.0, 0.0, d.z), 0.0)));
  vec3 below = vec3(density_of(textureLod(u_density, p - vec3(d.x, 0.0, 0.0), 0.0)),
                    density_of(textureLod(u_density, p - vec3(0.0, d.y, 0.0), 0.0)),
                    density_of(textureLod(u_density, p - vec3(0.0, 0.0, d.z), 0.0)));
  return above - below;
}

#else

// From the eight corners of a cube: differences along one axis, means along the others, which calms
// the steps that voxels and cuts leave in the density. Farther corners leave the two voxels over
// which a border is antialiased, and draw terraces.
vec3 gradient_at(vec3 p) {
  const float kReachVox = 1.0;
  vec3 d = kReachVox / u_texels;
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    vec3 side = vec3((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    sum += side * density_of(texture(u_density, p + side * d));
  }
  return sum;
}

#endif
