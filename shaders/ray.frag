// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Rays as every ray caster sees them, and true depth. A ray is parametrised by its distance `t` in mm
// along the view axis, so t is the eye distance of the paper's equation (1).

uniform vec2 u_half_size_at_1mm;  // half the picture, 1 mm from the eye
uniform vec2 u_middle_at_1mm;     // the picture's middle, from the view axis
uniform float u_near_mm;
uniform float u_far_mm;
uniform vec4 u_clip_plane_eye;  // clip plane: shown where dot(this, (p, 1)) >= 0, p in eye mm

// Where the ray of a pixel is 1 mm from the eye.
vec3 eye_direction_at(vec2 ndc) { return vec3(u_middle_at_1mm + ndc * u_half_size_at_1mm, -1.0); }

// The part of a ray between the near, the far and the clip plane: t from x to y.
vec2 shown_mm(vec3 eye_direction) {
  vec2 shown = vec2(u_near_mm, u_far_mm);
  float slope = dot(u_clip_plane_eye.xyz, eye_direction);
  float cut = -u_clip_plane_eye.w / slope;
  if (slope > 0.0) shown.x = max(shown.x, cut);
  if (slope < 0.0) shown.y = min(shown.y, cut);
  if (slope == 0.0 && u_clip_plane_eye.w < 0.0) shown.y = 0.0;
  return shown;
}

// Distances along a line at which it enters and leaves the box lo..hi.
vec2 box_mm(vec3 origin, vec3 inverse_direction, vec3 lo, vec3 hi) {
  vec3 to_lo = (lo - origin) * inverse_direction;
  vec3 to_hi = (hi - origin) * inverse_direction;
  vec3 near = min(to_lo, to_hi);
  vec3 far = max(to_lo, to_hi);
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// True depth, so that everything hides everything as it should.

// The paper's equation (1): 0 at the near plane, 1 at the far plane.
float window_depth(float eye_mm, float near_mm, float far_mm) {
  float f = far_mm;
  float n = near_mm;
  return ((f + n) / (f - n) - 2.0 * f * n / ((f - n) * eye_mm) + 1.0) / 2.0;
}

// Its inverse.
float eye_distance(float window_depth, float near_mm, float far_mm) {
  float f = far_mm;
  float n = near_mm;
  return 2.0 * f * n / (f + n - (2.0 * window_depth - 1.0) * (f - n));
}
