// SPDX-License-Identifier: Apache-2.0
#version 450 core
// What a sample inside a volume looks like: the transfer function and the light. The program defines
// KERF_VOLUMES, KERF_EACH_VOLUME(f), which is f(0) f(1) ..., and KERF_HAS_LABELS, one bool for each.
// A sampler is taken by a constant index, as WebGL asks; where the volume is a constant nothing of
// the choice is left.

uniform sampler3D u_voxel[KERF_VOLUMES];     // gradient (128 + 127 g in 8 bits) and density
uniform sampler3D u_material[KERF_VOLUMES];  // linear colour, opacity over 1/8 mm
uniform sampler2D u_by_density;              // the same by density, row v for volume v
uniform vec3 u_texels[KERF_VOLUMES];
uniform vec2 u_fade[KERF_VOLUMES];           // densities where a material begins and where it is whole
uniform mat3 u_eye_from_gradient[KERF_VOLUMES];
uniform float u_surface_mm[KERF_VOLUMES];    // thickness of the layer that is lit by its gradient
uniform float u_least_extinction;            // per mm; less makes no difference
uniform vec3 u_up_eye;                       // world up

const float kOpacityMm = 0.125;  // s0, over which opacities hold

const bool kHasLabels[KERF_VOLUMES] = KERF_HAS_LABELS;

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);

// Gradient and density.
vec4 voxel_at(int v, vec3 p) {
#define TAKE_VOXEL(i) if (v == i) return textureLod(u_voxel[i], p, 0.0);
  KERF_EACH_VOLUME(TAKE_VOXEL)
  return vec4(0.0);
}

vec4 material_by_label(int v, vec3 p) {
#define TAKE_MATERIAL(i) if (v == i) return textureLod(u_material[i], p, 0.0);
  KERF_EACH_VOLUME(TAKE_MATERIAL)
  return vec4(0.0);
}

// A volume without labels: the material at a border is that of what the border belongs to, a voxel
// and a half up the gradient. By its own density every border would have a skin of softer tissue.
vec4 material_by_density(int v, vec3 p, vec3 gradient, float density) {
  const float kDepthVox = 1.5;
  float size = length(gradient);
  if (size > 0.0) {
    vec3 inward = gradient * (kDepthVox / size) / u_texels[v];
    density = max(density, voxel_at(v, p + inward).a);
  }
  return texelFetch(u_by_density, ivec2(density * 255.0 + 0.5, v), 0);
}

// How much of its material is there, 0..1, on the mean between two points. The density runs straight
// between them, so the ramp of the transfer function is integrated exactly: sampled, a border that
// is thinner than the step would leave rings (pre-integration: Engel, Kraus and Ertl 2001).
float presence_between(int v, float front, float back) {
  vec2 x = (vec2(front, back) - u_fade[v].x) / (u_fade[v].y - u_fade[v].x);
  vec2 ramp = clamp(x, 0.0, 1.0);
  vec2 integral = 0.5 * ramp * ramp + max(x - 1.0, 0.0);
  float change = x.y - x.x;
  return abs(change) > 0.01 ? (integral.y - integral.x) / change : 0.5 * (ramp.x + ramp.y);
}

// Where between the two, 0..1, the material begins to be there.
float beginning_between(int v, float front, float back) {
  return front < u_fade[v].x ? clamp((u_fade[v].x - front) / (back - front), 0.0, 1.0) : 0.0;
}

// Whether this extinction per mm counts as something that is seen.
bool is_seen(float extinction) { return extinction >= u_least_extinction; }

#ifdef KERF_HAS_CELLS  // by a browser, if a volume has unequal edges: one bool for each, as KERF_HAS_LABELS

const bool kHasCells[KERF_VOLUMES] = KERF_HAS_CELLS;
uniform sampler3D u_cell_gradient[KERF_VOLUMES];  // of each cell (bridge/page/web/cell_gradients.js)
uniform vec3 u_cell_scale[KERF_VOLUMES];          // from texture coordinates of u_voxel to its own
uniform vec3 u_cell_shift[KERF_VOLUMES];
uniform vec3 u_per_edge[KERF_VOLUMES];            // edges of a voxel by the longest
uniform vec3 u_fine[KERF_VOLUMES];                // 1 along axes where cells have several voxels

vec3 followed(vec3 voxel, vec3 cell, vec3 fine, vec3 per_edge);

// Per longest edge; `voxel` is per voxel edge.
vec3 gradient_of(int v, vec3 voxel, vec3 p) {
  if (!kHasCells[v]) return voxel;
  vec3 at = p * u_cell_scale[v] + u_cell_shift[v];
  vec3 cell = vec3(0.0);
#define TAKE_CELL_GRADIENT(i) if (v == i) cell = textureLod(u_cell_gradient[i], at, 0.0).xyz;
  KERF_EACH_VOLUME(TAKE_CELL_GRADIENT)
  return followed(voxel, cell, u_fine[v], u_per_edge[v]);
}

#else

vec3 gradient_of(int v, vec3 voxel, vec3 p) { return voxel; }

#endif

// The weight of the light on a surface: visualizer/scene/appearance.hpp has the reason (kLitMm).
float lit_part(int v, float extinction, float facing) {
  const float kLitMm = 0.2692;
  const float kLeastFacing = 0.2;  // a ray that grazes leaves the border before it is in deeper
  float per_mm = max(extinction, u_least_extinction) / max(facing, kLeastFacing);
  return (1.0 - exp2(-per_mm * kLitMm)) / (1.0 - exp2(-per_mm * u_surface_mm[v]));
}

// Linear colour, lit, of what is at p, and -log2 of the transparency of a mm of it: times a presence
// and a length that is exact, (1 - a)^(p s / s0) = 2^(-p s * this).
vec4 material_of(int v, vec4 voxel, vec3 p, vec3 to_eye) {
  vec3 gradient = gradient_of(v, (voxel.rgb * 255.0 - 128.0) / 127.0, p);
  vec4 material = kHasLabels[v] ? material_by_label(v, p)
                                : material_by_density(v, p, gradient, voxel.a);

  // Where the density hardly changes there is no surface to be lit; inside, light comes from
  // everywhere.
  const vec2 kSurface = vec2(0.04, 0.20);  // of the gradient
  const float kInside = 0.62;
  vec3 slope = u_eye_from_gradient[v] * gradient;
  vec3 normal = dot(slope, slope) > 0.0 ? -normalize(slope) : to_eye;
  if (dot(normal, to_eye) < 0.0) normal = -normal;
  float extinction = -log2(1.0 - min(material.a, 0.996)) / kOpacityMm;
  float surface = smoothstep(kSurface.x, kSurface.y, length(gradient)) *
                  lit_part(v, extinction, dot(normal, to_eye));
  vec3 colour = mix(kInside * material.rgb, lit(material.rgb, normal, to_eye, u_up_eye, 1.0), surface);
  return vec4(colour, extinction);
}
