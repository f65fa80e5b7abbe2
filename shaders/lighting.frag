// SPDX-License-Identifier: Apache-2.0
#version 450 core
// What every renderer shares: light, and the step to the screen's colours. Linked to a fragment
// shader that declares the functions it uses.

const vec3 kKey = normalize(vec3(-0.45, 0.75, 0.70));

// What a section through solid faces: the key light, so that each material has its own colour
// wherever the clip plane lies.
vec3 section_normal() { return kKey; }

// Two lights of a photographer that go with the eye, and a sky that stays with the world.
vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor) {
  const vec3 kFill = normalize(vec3(0.80, 0.05, 0.45));
  vec3 ambient = mix(vec3(0.16, 0.145, 0.13), vec3(0.32, 0.34, 0.37),
                     0.5 + 0.5 * dot(normal, up_eye));
  // The key light is a soft box: it reaches a little round the edge.
  float key = max((dot(normal, kKey) + 0.15) / 1.15, 0.0);
  vec3 diffuse = vec3(1.00, 0.97, 0.92) * (0.72 * key) +
                 vec3(0.75, 0.85, 1.00) * (0.16 * max(dot(normal, kFill), 0.0));
  float shine = pow(max(dot(normal, normalize(kKey + to_eye)), 0.0), 48.0) * 0.22 +
                pow(max(dot(normal, normalize(kFill + to_eye)), 0.0), 24.0) * 0.04;
  return albedo * (ambient * ao_factor + diffuse * mix(0.35, 1.0, ao_factor)) +
         vec3(shine * ao_factor);
}

vec3 srgb(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
