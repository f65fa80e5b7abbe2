// SPDX-License-Identifier: Apache-2.0
#version 450 core
// One slice through one volume: what a ray meets between the slice before and this one.

flat in float v_slice;
layout(location = 0) out vec4 o_colour;  // linear, times opacity
layout(location = 1) out float o_depth;

uniform sampler2D u_opaque_depth;        // of the window
uniform mat4 u_texture_from_eye[1];      // mm to texture coordinates
uniform float u_step_mm;                 // between slices
uniform float u_near_mm;
uniform float u_far_mm;

vec3 eye_direction_at(vec2 ndc);
vec2 shown_mm(vec3 eye_direction);
float window_depth(float eye_mm, float near_mm, float far_mm);
float eye_distance(float window_depth, float near_mm, float far_mm);
vec4 voxel_at(int v, vec3 p);
float presence_between(int v, float front, float back);
bool is_seen(float extinction);
float beginning_between(int v, float front, float back);
vec4 material_of(int v, vec4 voxel, vec3 p, vec3 to_eye);

void main() {
  // Of the pixel, not interpolated: slices are cut to what there is in a volume, and a change in one
  // place would round all of it anew.
  vec2 size = vec2(textureSize(u_opaque_depth, 0));
  vec3 eye_direction = eye_direction_at(2.0 * gl_FragCoord.xy / size - 1.0);
  vec2 shown = shown_mm(eye_direction);
  float opaque_mm = eye_distance(texelFetch(u_opaque_depth, ivec2(gl_FragCoord.xy), 0).r,
                                 u_near_mm, u_far_mm);
  float from_mm = max((v_slice - 1.0) * u_step_mm, shown.x);
  float to_mm = min(v_slice * u_step_mm, min(shown.y, opaque_mm));
  vec3 origin = u_texture_from_eye[0][3].xyz;
  vec3 direction = mat3(u_texture_from_eye[0]) * eye_direction;
  vec4 front = voxel_at(0, origin + from_mm * direction);
  vec4 back = voxel_at(0, origin + to_mm * direction);
  float presence = presence_between(0, front.a, back.a);
  if (from_mm >= to_mm || presence <= 0.0) discard;

  vec3 middle = origin + 0.5 * (from_mm + to_mm) * direction;
  vec4 material = material_of(0, 0.5 * (front + back), middle, -normalize(eye_direction));
  float extinction = presence * material.a;
  float length_mm = (to_mm - from_mm) * length(eye_direction);
  o_colour = (1.0 - exp2(-extinction * length_mm)) * vec4(material.rgb, 1.0);
  float depth_mm = mix(from_mm, to_mm, beginning_between(0, front.a, back.a));
  o_depth = is_seen(extinction) ? window_depth(depth_mm, u_near_mm, u_far_mm) : 1.0;
}
