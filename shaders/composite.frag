// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Puts gathered translucent light over the picture.

layout(location = 0) out vec4 o_colour;

uniform sampler2D u_colour;  // linear, times opacity
uniform sampler2D u_depth;   // of the window; 1: nothing is seen

vec3 srgb(vec3 linear);

// A ray may stop here and count as opaque: what lies behind would add two hundredths at most.
const float kOpaque = 0.98;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(u_depth, pixel, 0).r;
  if (depth >= 1.0) discard;
  vec4 light = texelFetch(u_colour, pixel, 0);
  float opacity = min(light.a / kOpaque, 1.0);
  o_colour = vec4(srgb(light.rgb / max(light.a, 1e-6)) * opacity, opacity);
  gl_FragDepth = depth;
}
