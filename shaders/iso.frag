// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Iso-surface of one volume by ray casting: colour and true depth.
//
// Within a cell of eight voxels the density along a ray is a cubic, whose first root is the surface:
// no part is too thin to be met. G. Marmitt, A. Kleer, I. Wald, H. Friedrich, P. Slusallek, "Fast
// and accurate ray-voxel intersection techniques for iso-surface ray tracing", Vision, Modeling, and
// Visualization 2004. Each cell is looked into for itself: skipping others changes the time, never
// the picture.

in vec2 v_ndc;
layout(location = 0) out vec4 o_colour;

uniform usampler3D u_active_cell;   // of eight voxel edges: 0 where no sample reaches iso
uniform usampler3D u_fine_cell;     // of two: a bit for each of its octants in which one may
uniform sampler2DArray u_entry_mm;  // where the ray meets the first active cell

uniform mat4 u_texture_from_eye;   // mm to texture coordinates
uniform sampler3D u_density;
uniform vec3 u_texels;             // extent of the volume's textures
uniform vec3 u_edges_mm;           // of a voxel
uniform vec3 u_up_eye;             // world up
uniform float u_near_mm;
uniform float u_far_mm;
uniform float u_iso;

vec3 eye_direction_at(vec2 ndc);
vec2 shown_mm(vec3 eye_direction);
vec2 box_mm(vec3 origin, vec3 inverse_direction, vec3 lo, vec3 hi);
vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);
vec3 srgb(vec3 linear);
vec3 section_normal();
float window_depth(float eye_mm, float near_mm, float far_mm);
vec3 gradient_at(vec3 texture_point);
float density_of(vec4 texel);
float density_at(vec3 texture_point);
vec3 material_at(vec3 p, vec3 inward_texture);

const int kCellLog2 = 3;  // voxel edges of an active cell
const int kRefinements = 4;
// A point so far ahead, in voxel edges, is in the cell that begins there however its coordinates, of
// up to some thousand, are rounded.
const float kAheadVox = 1.0 / 2048.0;
const float kAheadOfEnd = 1.0 / 1048576.0;  // the same of a distance: t grows whatever it is

// Density above iso along a part of a ray, of s from 0 to 1: a + s (b + s (c + s d)).
float cubic_at(vec4 g, float s) { return g.x + s * (g.y + s * (g.z + s * g.w)); }

// Of a face of a cell of eight voxels: the density at its corner, what it gains along x and along y,
// and along both.
vec4 face_at(ivec3 corner) {
  float low = density_of(texelFetch(u_density, corner, 0));
  float x = density_of(texelFetch(u_density, corner + ivec3(1, 0, 0), 0)) - low;
  float y = density_of(texelFetch(u_density, corner + ivec3(0, 1, 0), 0)) - low;
  float both = density_of(texelFetch(u_density, corner + ivec3(1, 1, 0), 0)) - low;
  return vec4(low, x, y, both - x - y);
}

// The cubic in a cell, from `p` in it on over `span`.
vec4 cubic_along(ivec3 cell, vec3 p, vec3 span) {
  vec4 face = face_at(cell);
  vec4 gain = face_at(cell + ivec3(0, 0, 1)) - face;  // along z
  face += p.z * gain;
  // Half a step of the density less: what is iso itself is solid, however a driver rounds.
  float above = face.x - (u_iso - 0.5 / 65535.0);
  vec3 slope = vec3(face.y + face.w * p.y, face.z + face.w * p.x,
                    gain.x + gain.y * p.x + p.y * (gain.z + gain.w * p.x));
  vec2 twist = gain.yz + gain.w * p.yx;  // of the slopes along x and y, along z
  return vec4(above + face.y * p.x + p.y * (face.z + face.w * p.x), dot(slope, span),
              span.x * span.y * face.w + span.z * dot(span.xy, twist),
              span.x * span.y * span.z * gain.w);
}

// The first s with a density of iso, or -1. The cubic may touch iso before it falls again: its one
// maximum splits it into parts with one root at most.
float first_root(vec4 g) {
  float turn = g.z * g.z - 3.0 * g.y * g.w;
  float top = g.y / (sqrt(max(turn, 0.0)) - g.z);  // where the slope falls through 0
  bool inner = turn >= 0.0 && top > 0.0 && top < 1.0;
  float at_top = inner ? cubic_at(g, top) : -1.0;
  bool rises = at_top >= 0.0;
  float low = inner && !rises ? top : 0.0;
  float high = rises ? top : 1.0;
  float below = inner && !rises ? at_top : g.x;
  float above = rises ? at_top : cubic_at(g, 1.0);
  if (g.x >= 0.0) return 0.0;
  if (above < 0.0) return -1.0;
  // Regula falsi (Illinois).
  float s = high;
  for (int i = 0; i < kRefinements; ++i) {
    s = mix(low, high, below / (below - above));
    float value = cubic_at(g, s);
    if (value < 0.0) {
      low = s;
      below = value;
      above *= 0.5;
    } else {
      high = s;
      above = value;
      below *= 0.5;
    }
  }
  return s;
}

// 1 in the open, less where the neighbourhood along the normal is solid: cavities read as such. Where
// it samples, and why: kOcclusionTapsMm (visualizer/cast/cast_kernels.hpp).
float ao_factor_at(vec3 p, vec3 inward_per_mm) {
  const vec3 kTapsMm = vec3(0.3125, 0.75, 1.5);
  const vec3 kWeights = vec3(0.30, 0.30, 0.25);
  const float kClearVox = 2.5;
  const float kMostTapVox = 64.0;
  vec3 edges_per_mm = inward_per_mm * u_texels;
  float clear_mm = kClearVox * length(edges_per_mm * u_edges_mm * u_edges_mm);
  vec2 clear = clamp(3.0 * kTapsMm.xy / clear_mm - 2.0, 0.0, 1.0);
  vec3 tap = min(vec3(kTapsMm.xy, max(kTapsMm.z, clear_mm)), kMostTapVox / length(edges_per_mm));
  vec3 solid = vec3(density_at(p - tap.x * inward_per_mm), density_at(p - tap.y * inward_per_mm),
                    density_at(p - tap.z * inward_per_mm));
  return 1.0 - dot(clamp(solid / u_iso, 0.0, 1.0), kWeights * vec3(clear, 1.0));
}

void main() {
  vec3 eye_direction = eye_direction_at(v_ndc);
  vec2 shown = shown_mm(eye_direction);
  float entry_mm = texelFetch(u_entry_mm, ivec3(gl_FragCoord.xy, 0), 0).r;
  // In voxel edges from the border: voxel v is at v + 1, and cells of any size begin at 0.
  vec3 origin = u_texture_from_eye[3].xyz * u_texels - 0.5;
  vec3 direction = mat3(u_texture_from_eye) * eye_direction * u_texels;
  direction += 1e-12 * vec3(equal(direction, vec3(0.0)));  // its inverse is a number
  vec3 inverse_direction = 1.0 / direction;
  vec2 box = box_mm(origin, inverse_direction, vec3(0.0), u_texels - 1.0);
  float end_mm = min(box.y, shown.y);
  float ahead_mm = max(kAheadVox / length(direction), kAheadOfEnd * end_mm);
  ivec3 last_cell = ivec3(u_texels) - 2;

  // From cell to cell, the larger ones where there is nothing.
  float t = max(max(entry_mm - ahead_mm, box.x), shown.x);
  float hit_mm = -1.0;
  while (t < end_mm && hit_mm < 0.0) {
    ivec3 cell = ivec3(0);
    vec2 within = vec2(t);  // the cell: from, to
    bool solid = false;
    while (t < end_mm && !solid) {
      cell = clamp(ivec3(floor(origin + (t + ahead_mm) * direction)), ivec3(0), last_cell);
      uint octants = texelFetch(u_fine_cell, cell >> 1, 0).r;
      uint larger = texelFetch(u_active_cell, cell >> kCellLog2, 0).r;
      ivec3 odd = cell & 1;
      solid = (octants >> (odd.x + 2 * odd.y + 4 * odd.z) & 1u) != 0u;
      int edge_log2 = larger == 0u ? kCellLog2 : octants == 0u ? 1 : 0;
      vec3 low = vec3(cell >> edge_log2 << edge_log2);
      within = box_mm(origin, inverse_direction, low, low + float(1 << edge_log2));
      if (!solid) t = max(within.y, t + ahead_mm);
    }
    if (solid) {
      // A cell that begins just ahead of where the ray is shown from holds that point, too: what is
      // solid there is a face. Twice, since both are rounded.
      float from_mm = within.x < shown.x + 2.0 * ahead_mm ? shown.x : within.x;
      float span_mm = min(within.y, end_mm) - from_mm;
      vec3 p = origin + from_mm * direction - vec3(cell);
      float s = first_root(cubic_along(cell, p, span_mm * direction));
      if (s >= 0.0) hit_mm = from_mm + s * span_mm;
      t = max(within.y, t + ahead_mm);
    }
  }
  if (hit_mm < 0.0) discard;
  // What the clip plane takes away is not hit; where it cuts through solid, there is a face.
  bool on_face = hit_mm <= shown.x && shown.x > u_near_mm;
  vec3 p = (origin + hit_mm * direction + 0.5) / u_texels;

  vec3 to_eye = -normalize(eye_direction);
  // A gradient in texture coordinates goes to the eye's millimetres by the transposed Jacobian.
  vec3 slope = transpose(mat3(u_texture_from_eye)) * gradient_at(p);
  vec3 normal = dot(slope, slope) > 0.0 ? -normalize(slope) : to_eye;
  if (dot(normal, to_eye) < 0.0) normal = normalize(normal - 1.02 * dot(normal, to_eye) * to_eye);
  vec3 inward_per_mm = mat3(u_texture_from_eye) * -normal;
  vec3 inward = inward_per_mm / length(inward_per_mm * u_texels);  // one voxel edge
  if (on_face) {
    normal = section_normal();
    inward = vec3(0.0);  // no border: it shows what lies in the plane
  }

  float ao_factor = on_face ? 1.0 : ao_factor_at(p, inward_per_mm);
  vec3 colour = lit(material_at(p, inward), normal, to_eye, u_up_eye, ao_factor);
  o_colour = vec4(srgb(colour), 1.0);
  gl_FragDepth = window_depth(hit_mm, u_near_mm, u_far_mm);
}
