// SPDX-License-Identifier: Apache-2.0
#version 450 core
// In the place of lighting.frag, for measurements: the colour is the normal. Its x and y in eye
// space, 0..4095 for -1..1, are 24 bits of red, green and blue; z is towards the eye.

vec3 section_normal() { return vec3(0.0, 0.0, 1.0); }

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor) {
  vec2 n = floor((0.5 + 0.5 * normal.xy) * 4095.0 + 0.5);
  return vec3(floor(n.x / 16.0), mod(n.x, 16.0) * 16.0 + floor(n.y / 256.0), mod(n.y, 256.0)) /
         255.0;
}

vec3 srgb(vec3 colour) { return colour; }
