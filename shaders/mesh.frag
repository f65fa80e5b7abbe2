// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A mesh as steel or as plain paint, with true depth.

in vec3 v_eye_mm;
in vec3 v_normal;
layout(location = 0) out vec4 o_colour;

uniform vec3 u_colour;     // linear
uniform float u_opacity;   // 0..1
uniform bool u_is_metal;
uniform vec3 u_up_eye;     // world up
uniform float u_near_mm;
uniform float u_far_mm;

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float openness);
vec3 srgb(vec3 linear);
float window_depth(float eye_mm, float near_mm, float far_mm);

// A photographer's tent: bright above, two strip lights, a dark floor.
vec3 studio(vec3 direction) {
  float up = dot(direction, u_up_eye);
  float tent = mix(0.15, 0.66, smoothstep(-0.35, 0.75, up));
  float strip = smoothstep(0.16, 0.04, abs(direction.x + 0.42)) * smoothstep(-0.2, 0.3, direction.z);
  float edge = smoothstep(0.12, 0.03, abs(direction.x - 0.72));
  return vec3(tent + 0.85 * strip + 0.35 * edge) * vec3(0.97, 0.99, 1.0);
}

vec3 steel(vec3 normal, vec3 to_eye) {
  float facing = max(dot(normal, to_eye), 0.0);
  vec3 mirror = u_colour + (1.0 - u_colour) * pow(1.0 - facing, 5.0);  // Schlick
  return mirror * studio(reflect(-to_eye, normal));
}

void main() {
  vec3 normal = normalize(v_normal);
  vec3 to_eye = -normalize(v_eye_mm);
  vec3 colour = u_is_metal ? steel(normal, to_eye) : lit(u_colour, normal, to_eye, u_up_eye, 1.0);
  o_colour = vec4(srgb(colour), u_opacity);
  gl_FragDepth = window_depth(-v_eye_mm.z, u_near_mm, u_far_mm);
}
