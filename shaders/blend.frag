// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Looks into all volumes at once by ray casting, front to back: linear colour times opacity, and the
// depth of the first sample that is seen.
//
// One ray goes through all volumes together, so they mix where they intersect. It is cut into pieces
// at whole multiples of the step along the view axis, whatever was skipped: skipping changes the
// time, never the picture. Volumes are gone through by KERF_EACH_VOLUME: a loop over them inside that
// along the ray is not unrolled by every driver, and then costs half the frame.

in vec2 v_ndc;
layout(location = 0) out vec4 o_colour;
layout(location = 1) out float o_depth;

uniform usampler3D u_active_cell[KERF_VOLUMES];  // 1 where something may be seen
uniform sampler2DArray u_entry_mm;               // layer v: the first active cell of volume v
uniform sampler2D u_opaque_depth;                // of the window; rays end there
uniform mat4 u_texture_from_eye[KERF_VOLUMES];   // mm to texture coordinates
uniform vec3 u_texels[KERF_VOLUMES];
uniform float u_step_mm;                         // along the view axis
uniform float u_near_mm;
uniform float u_far_mm;

vec3 eye_direction_at(vec2 ndc);
vec2 shown_mm(vec3 eye_direction);
vec2 box_mm(vec3 origin, vec3 inverse_direction, vec3 lo, vec3 hi);
float window_depth(float eye_mm, float near_mm, float far_mm);
float eye_distance(float window_depth, float near_mm, float far_mm);
vec4 voxel_at(int v, vec3 p);
float presence_between(int v, float front, float back);
bool is_seen(float extinction);
float beginning_between(int v, float front, float back);
vec4 material_of(int v, vec4 voxel, vec3 p, vec3 to_eye);

const float kCellVox = 8.0;
const float kOpaque = 0.98;             // as in composite.frag
const float kNever = 1e30;

struct Line {
  vec3 origin, direction;               // in texture coordinates, by t
  vec3 cell_origin, cell_direction, inverse_cell_direction;
  vec2 inside_mm;                       // where it is in the volume's box
};

Line line_through(int v, vec3 eye_direction) {
  Line line;
  line.origin = u_texture_from_eye[v][3].xyz;
  line.direction = mat3(u_texture_from_eye[v]) * eye_direction;
  line.inside_mm = box_mm(line.origin, 1.0 / line.direction, vec3(0.0), vec3(1.0));
  // Voxel v has texel coordinate v + 1.5 and cell coordinate (v + 1) / 8.
  vec3 cells_per_texture = u_texels[v] / kCellVox;
  line.cell_origin = line.origin * cells_per_texture - 0.5 / kCellVox;
  line.cell_direction = line.direction * cells_per_texture;
  line.inverse_cell_direction = 1.0 / line.cell_direction;
  return line;
}

vec3 at(Line line, float t) { return line.origin + t * line.direction; }

// Whether there may be something at t. Shortens until_mm to where that may change.
bool may_be_seen(int v, Line line, float t, inout float until_mm) {
  if (t >= line.inside_mm.y) return false;
  if (t < line.inside_mm.x) {
    until_mm = min(until_mm, line.inside_mm.x);
    return false;
  }
  vec3 cell = floor(line.cell_origin + t * line.cell_direction);
  until_mm =
      min(until_mm, box_mm(line.cell_origin, line.inverse_cell_direction, cell, cell + 1.0).y);
#define TAKE_CELL(i)                                                                    \
  if (v == i) {                                                                         \
    ivec3 last = textureSize(u_active_cell[i], 0) - 1;                                  \
    return texelFetch(u_active_cell[i], clamp(ivec3(cell), ivec3(0), last), 0).r != 0u; \
  }
  KERF_EACH_VOLUME(TAKE_CELL)
  return false;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float entry_mm = u_far_mm;
  for (int v = 0; v < KERF_VOLUMES; ++v) {
    entry_mm = min(entry_mm, texelFetch(u_entry_mm, ivec3(pixel, v), 0).r);
  }
  vec3 eye_direction = eye_direction_at(v_ndc);
  vec3 to_eye = -normalize(eye_direction);
  vec2 shown = shown_mm(eye_direction);
  float opaque_mm = eye_distance(texelFetch(u_opaque_depth, pixel, 0).r, u_near_mm, u_far_mm);
  float end_mm = min(shown.y, opaque_mm);
  if (entry_mm >= end_mm || shown.x >= end_mm) discard;

  Line line[KERF_VOLUMES];
  float leave_mm = 0.0;
#define SET_LINE(v)                         \
  line[v] = line_through(v, eye_direction); \
  leave_mm = max(leave_mm, line[v].inside_mm.y);
  KERF_EACH_VOLUME(SET_LINE)
  end_mm = min(end_mm, leave_mm);

  float length_per_mm = length(eye_direction);
  vec4 sum = vec4(0.0);
  float depth_mm = kNever;
  vec4 voxel[KERF_VOLUMES];  // at the far end of a piece
  float k = floor(max(entry_mm, shown.x) / u_step_mm);
  while (k * u_step_mm < end_mm && sum.a < kOpaque) {
    float from_mm = max(k * u_step_mm, shown.x);
    float until_mm = end_mm;
    bool anything = false;
#define LOOK(v) anything = may_be_seen(v, line[v], from_mm, until_mm) || anything;
    KERF_EACH_VOLUME(LOOK)
    // A piece that begins in an empty cell and ends in the next one must be looked at.
    float k_until = until_mm / u_step_mm;
    k_until = anything ? ceil(k_until) : floor(k_until);
    if (!anything && k_until > k) {
      k = k_until;
      from_mm = k * u_step_mm;
    }
    k_until = max(k_until, k + 1.0);
#define SAMPLE(v) voxel[v] = voxel_at(v, at(line[v], from_mm));
    KERF_EACH_VOLUME(SAMPLE)
    // Up to the first piece with something in it without any light: most of the way is air.
    bool empty = true;
    while (empty && k < k_until) {
      float to_mm = min((k + 1.0) * u_step_mm, end_mm);
      vec4 ahead[KERF_VOLUMES];
#define AHEAD(v)                                  \
      ahead[v] = voxel_at(v, at(line[v], to_mm)); \
      empty = empty && presence_between(v, voxel[v].a, ahead[v].a) <= 0.0;
      KERF_EACH_VOLUME(AHEAD)
      if (empty) {
        voxel = ahead;
        from_mm = to_mm;
        k += 1.0;
      }
    }
    while (k < k_until && sum.a < kOpaque) {
      k += 1.0;
      float to_mm = min(k * u_step_mm, end_mm);
      vec4 here = vec4(0.0);  // colour times extinction, extinction per mm
#define ADD(v)                                                                              \
      {                                                                                     \
        vec4 front = voxel[v];                                                              \
        voxel[v] = voxel_at(v, at(line[v], to_mm));                                         \
        float presence = presence_between(v, front.a, voxel[v].a);                          \
        vec3 middle = at(line[v], 0.5 * (from_mm + to_mm));                                 \
        vec4 material = material_of(v, 0.5 * (front + voxel[v]), middle, to_eye);           \
        float extinction = presence * material.a;                                           \
        here += extinction * vec4(material.rgb, 1.0);                                       \
        float begins_mm = mix(from_mm, to_mm, beginning_between(v, front.a, voxel[v].a));   \
        if (is_seen(extinction)) depth_mm = min(depth_mm, begins_mm);                       \
      }
      KERF_EACH_VOLUME(ADD)
      float opacity = 1.0 - exp2(-here.a * (to_mm - from_mm) * length_per_mm);
      sum += (1.0 - sum.a) * opacity * vec4(here.rgb / max(here.a, 1e-9), 1.0);
      from_mm = to_mm;
    }
  }
  if (depth_mm == kNever) discard;
  o_colour = sum;
  o_depth = window_depth(depth_mm, u_near_mm, u_far_mm);
}
