// SPDX-License-Identifier: Apache-2.0
#version 450 core
// The face in the clip plane of one volume whose surface is a mesh: what iso.frag shows there.

in vec2 v_ndc;
layout(location = 0) out vec4 o_colour;

uniform mat4 u_texture_from_eye;  // mm to texture coordinates
uniform vec3 u_up_eye;            // world up
uniform float u_near_mm;
uniform float u_far_mm;
uniform float u_iso;

vec3 eye_direction_at(vec2 ndc);
vec2 shown_mm(vec3 eye_direction);
float density_at(vec3 texture_point);
vec3 material_at(vec3 p, vec3 inward_texture);
vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);
vec3 srgb(vec3 linear);
vec3 section_normal();
float window_depth(float eye_mm, float near_mm, float far_mm);

void main() {
  vec3 eye_direction = eye_direction_at(v_ndc);
  vec2 shown = shown_mm(eye_direction);
  vec3 p = (u_texture_from_eye * vec4(shown.x * eye_direction, 1.0)).xyz;
  // Rays begin in the plane where it hides what is before it; beside the volume is air.
  if (shown.x <= u_near_mm || shown.x >= shown.y || density_at(p) < u_iso) discard;

  vec3 albedo = material_at(p, vec3(0.0));
  vec3 to_eye = -normalize(eye_direction);
  vec3 colour = lit(albedo, section_normal(), to_eye, u_up_eye, 1.0);
  o_colour = vec4(srgb(colour), 1.0);
  gl_FragDepth = window_depth(shown.x, u_near_mm, u_far_mm);
}
