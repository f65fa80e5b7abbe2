// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A mesh as steel (KERF_METAL 1) or as plain paint (0): a software GL would work out both where a
// uniform chose. Depth is that of the projection, which is equation (1): not written, so hidden pixels
// cost nothing.

in vec3 v_eye_mm;
in vec3 v_normal;
layout(location = 0) out vec4 o_colour;

uniform vec3 u_colour;     // linear
uniform float u_opacity;   // 0..1
uniform vec3 u_up_eye;     // world up

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);
vec3 srgb(vec3 linear);

// A photographer's tent: bright above, two strip lights, a dark floor.
vec3 studio(vec3 direction) {
  float up = dot(direction, u_up_eye);
  float tent = mix(0.15, 0.66, smoothstep(-0.35, 0.75, up));
  float strip = smoothstep(0.16, 0.04, abs(direction.x + 0.42)) * smoothstep(-0.2, 0.3, direction.z);
  float edge = smoothstep(0.12, 0.03, abs(direction.x - 0.72));
  return vec3(tent + 0.85 * strip + 0.35 * edge) * vec3(0.97, 0.99, 1.0);
}

vec3 steel(vec3 normal, vec3 to_eye) {
  float away = 1.0 - max(dot(normal, to_eye), 0.0);
  float away_2 = away * away;
  vec3 mirror = u_colour + (1.0 - u_colour) * (away_2 * away_2 * away);  // Schlick
  return mirror * studio(reflect(-to_eye, normal));
}

void main() {
  vec3 normal = normalize(v_normal);
  vec3 to_eye = -normalize(v_eye_mm);
#if KERF_METAL
  vec3 colour = steel(normal, to_eye);
#else
  vec3 colour = lit(u_colour, normal, to_eye, u_up_eye, 1.0);
#endif
  o_colour = vec4(srgb(colour), u_opacity);
}
