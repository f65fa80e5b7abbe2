// SPDX-License-Identifier: Apache-2.0
#version 450 core
// The material of a volume with an iso-surface at a point.

uniform sampler3D u_density;   // 0..1, inside a border of air one voxel thick
uniform usampler3D u_label;    // the same extent; 0 = none
uniform sampler2D u_palette;   // linear colour: row 0 by density, row 1 by label
uniform vec3 u_texels;         // extent of u_density
uniform bool u_has_labels;

// A texel of u_density. WebGL filters no texel of 16 bits: there it is two of 8, low and high, whose
// weighted sum filters as one would.
#ifdef GL_ES
float density_of(vec4 texel) { return dot(texel.rg, vec2(1.0, 256.0) / 257.0); }
#else
float density_of(vec4 texel) { return texel.r; }
#endif

float density_at(vec3 texture_point) { return density_of(texture(u_density, texture_point)); }

// Colour of the labels around, blended so that their borders are smooth, times the fraction (alpha) of
// voxels that have one.
vec4 label_colour_at(vec3 texture_point) {
  vec3 texel = texture_point * u_texels - 0.5;
  ivec3 low = ivec3(floor(texel));
  vec3 fraction = texel - vec3(low);
  vec4 sum = vec4(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    ivec3 side = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    uint label = texelFetch(u_label, low + side, 0).r;
    vec3 weight = mix(1.0 - fraction, fraction, vec3(side));
    float w = label != 0u ? weight.x * weight.y * weight.z : 0.0;
    sum += w * vec4(texelFetch(u_palette, ivec2(label, 1), 0).rgb, 1.0);
  }
  return sum;
}

// The mean of the labels over 3.5 voxels: in a clip plane their borders are steps of voxels.
vec4 face_colour_at(vec3 p) {
  const float kReachVox = 0.75;
  vec4 sum = vec4(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    vec3 side = vec3((corner & 1) * 2 - 1, (corner & 2) - 1, (corner & 4) / 2 - 1);
    sum += 0.125 * label_colour_at(p + kReachVox * side / u_texels);
  }
  return sum;
}

// Below the surface, because the surface itself is half air. Soft tissue that lies on the surface,
// too thin for iso, coats it until it is milled away: pulp on the walls of its chamber. A face in the
// clip plane has no inward direction: it shows what lies there.
vec3 material_at(vec3 p, vec3 inward_texture) {
  const float kDepthVox = 1.25;
  const float kFullDepthVox = 2.5;  // past the two voxels over which a border is antialiased
  const float kCoatDensity = 0.14;
  vec3 below = p + kDepthVox * inward_texture;
  vec3 above = p - kDepthVox * inward_texture;
  if (u_has_labels) {
    bool on_face = inward_texture == vec3(0.0);
    vec4 labelled = on_face ? face_colour_at(p) : label_colour_at(below);
    if (!on_face && density_at(above) > kCoatDensity) {
      vec4 coat = label_colour_at(above);
      labelled = mix(labelled, coat, coat.a);
    }
    if (labelled.a > 0.0) return labelled.rgb / labelled.a;
  }
  float density = max(density_at(below), density_at(p + kFullDepthVox * inward_texture));
  return texture(u_palette, vec2(density, 0.25)).rgb;
}
