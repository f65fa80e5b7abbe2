// SPDX-License-Identifier: Apache-2.0
#version 450 core
// In the place of lighting.frag, for targets of floats: the colour is the normal in eye space.

uniform vec4 u_clip_plane_eye;  // shown where dot(this, (p, 1)) >= 0, p in eye mm

// A section through solid faces what the plane took away.
vec3 section_normal() { return -normalize(u_clip_plane_eye.xyz); }

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor) { return normal; }

vec3 srgb(vec3 colour) { return colour; }
