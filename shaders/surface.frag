// SPDX-License-Identifier: Apache-2.0
#version 450 core
// The surface of a volume: colour and ambient occlusion come with the
// vertices, light is computed for each pixel.
// Depth is that of the projection, which is equation (1): not written, so hidden pixels cost nothing.
//
// A mesh is a shell. Where the clip plane opens it, clip_cap.frag draws the face; its inner side shows
// only in slits, thinner than a voxel, between the two, and is lit like the face.

in vec3 v_eye_mm;
in vec3 v_normal;
in vec4 v_shading;
layout(location = 0) out vec4 o_colour;

uniform vec3 u_up_eye;     // world up

vec3 lit(vec3 albedo, vec3 normal, vec3 to_eye, vec3 up_eye, float ao_factor);
vec3 srgb(vec3 linear);
vec3 section_normal();

void main() {
  vec3 to_eye = -normalize(v_eye_mm);
  vec3 normal = normalize(v_normal);
  float ao_factor = v_shading.a;
  if (!gl_FrontFacing) {
    normal = section_normal();
    ao_factor = 1.0;
  } else if (dot(normal, to_eye) < 0.0) {
    // What is seen faces the eye, whatever the gradient says at a silhouette.
    normal = normalize(normal - 1.02 * dot(normal, to_eye) * to_eye);
  }
  o_colour = vec4(srgb(lit(v_shading.rgb, normal, to_eye, u_up_eye, ao_factor)), 1.0);
}
