// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Iso-surface of one volume by ray casting: colour and true depth.
//
// Samples stand at whole multiples of the step whatever was skipped before: skipping changes the
// time, never the picture.

in vec2 v_ndc;
layout(location = 0) out vec4 o_colour;

uniform usampler3D u_active_cell;   // 1 where a sample may reach iso
uniform sampler2DArray u_entry_mm;  // where the ray meets the first active cell

uniform mat4 u_texture_from_eye;   // mm to texture coordinates
uniform vec3 u_texels;             // extent of the volume's textures
uniform vec3 u_up_eye;             // world up
uniform float u_near_mm;
uniform float u_far_mm;
uniform float u_iso;
uniform float u_step_vox;          // along the ray

vec3 eye_direction_at(vec2 ndc);
vec2 shown_mm(vec3 eye_direction);
vec2 box_mm(vec3 origin, vec3 inverse_direction, vec3 lo, vec3 hi);
vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);
vec3 srgb(vec3 linear);
vec3 section_normal();
float window_depth(float eye_mm, float near_mm, float far_mm);
vec3 gradient_at(vec3 texture_point);
float density_at(vec3 texture_point);
vec3 material_at(vec3 p, vec3 inward_texture);

const float kCellVox = 8.0;
const int kRefinements = 3;

// Regula falsi (Illinois) between a sample below iso and one at or above it.
float refined_mm(vec3 origin, vec3 direction, float below_mm, float above_mm, float above) {
  float below = density_at(origin + below_mm * direction) - u_iso;
  above -= u_iso;
  if (below >= 0.0) return below_mm;  // the ray begins inside
  float t = above_mm;
  for (int i = 0; i < kRefinements; ++i) {
    t = mix(below_mm, above_mm, below / (below - above));
    float value = density_at(origin + t * direction) - u_iso;
    if (value < 0.0) {
      below_mm = t;
      below = value;
      above *= 0.5;
    } else {
      above_mm = t;
      above = value;
      below *= 0.5;
    }
  }
  return t;
}

// 1 in the open, less where the neighbourhood along the normal is solid: cavities read as such.
float ao_factor_at(vec3 p, vec3 inward_texture) {
  const vec3 kReachVox = vec3(2.5, 6.0, 12.0);
  const vec3 kWeight = vec3(0.30, 0.30, 0.25);
  vec3 solid = vec3(density_at(p - kReachVox.x * inward_texture),
                    density_at(p - kReachVox.y * inward_texture),
                    density_at(p - kReachVox.z * inward_texture));
  return 1.0 - dot(clamp(solid / u_iso, 0.0, 1.0), kWeight);
}

void main() {
  vec3 eye_direction = eye_direction_at(v_ndc);
  vec2 shown = shown_mm(eye_direction);
  float entry_mm = texelFetch(u_entry_mm, ivec3(gl_FragCoord.xy, 0), 0).r;
  vec3 origin = u_texture_from_eye[3].xyz;
  vec3 direction = mat3(u_texture_from_eye) * eye_direction;
  vec3 inverse_direction = 1.0 / direction;
  float end_mm = min(box_mm(origin, inverse_direction, vec3(0.0), vec3(1.0)).y, shown.y);
  float step_mm = u_step_vox / length(direction * u_texels);

  // Cell coordinates: voxel v has texel coordinate v + 1.5 and cell coordinate (v + 1) / 8.
  vec3 cells_per_texture = u_texels / kCellVox;
  vec3 cell_origin = origin * cells_per_texture - 0.5 / kCellVox;
  vec3 cell_direction = direction * cells_per_texture;
  vec3 inverse_cell_direction = 1.0 / cell_direction;

  // What the clip plane takes away must not be hit; where it cuts through solid, there is a face.
  float k = max(floor(entry_mm / step_mm), ceil(shown.x / step_mm));
  float hit_density = -1.0;
  bool on_face = false;
  if (entry_mm <= shown.x && shown.x < end_mm) {
    float density = density_at(origin + shown.x * direction);
    if (density >= u_iso) hit_density = density;
    on_face = hit_density >= 0.0 && shown.x > u_near_mm;
  }
  float k_end = ceil(end_mm / step_mm);
  while (k < k_end && hit_density < 0.0) {
    float t = k * step_mm;
    vec3 cell = floor(cell_origin + t * cell_direction);
    float exit_mm = box_mm(cell_origin, inverse_cell_direction, cell, cell + 1.0).y;
    float k_exit = min(max(k + 1.0, ceil(exit_mm / step_mm)), k_end);
    if (texelFetch(u_active_cell, ivec3(cell), 0).r == 0u) {
      k = k_exit;
    } else {
      while (k < k_exit) {
        float density = density_at(origin + k * step_mm * direction);
        if (density >= u_iso) {
          hit_density = density;
          break;
        }
        k += 1.0;
      }
    }
  }
  if (hit_density < 0.0) discard;

  float below_mm = max((k - 1.0) * step_mm, shown.x);
  float above_mm = max(k * step_mm, shown.x);
  float t = refined_mm(origin, direction, below_mm, above_mm, hit_density);
  vec3 p = origin + t * direction;

  vec3 to_eye = -normalize(eye_direction);
  // A gradient in texture coordinates goes to the eye's millimetres by the transposed Jacobian.
  vec3 slope = transpose(mat3(u_texture_from_eye)) * gradient_at(p);
  vec3 normal = dot(slope, slope) > 0.0 ? -normalize(slope) : to_eye;
  if (dot(normal, to_eye) < 0.0) normal = normalize(normal - 1.02 * dot(normal, to_eye) * to_eye);
  vec3 inward = mat3(u_texture_from_eye) * -normal;
  inward /= length(inward * u_texels);  // one voxel edge
  if (on_face) {
    normal = section_normal();
    inward = vec3(0.0);  // no border: it shows what lies in the plane
  }

  float ao_factor = on_face ? 1.0 : ao_factor_at(p, inward);
  vec3 colour = lit(material_at(p, inward), normal, to_eye, u_up_eye, ao_factor);
  o_colour = vec4(srgb(colour), 1.0);
  gl_FragDepth = window_depth(t, u_near_mm, u_far_mm);
}
