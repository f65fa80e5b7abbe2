// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A picture from the ray caster on the processor: colour and true depth as they are.

layout(location = 0) out vec4 o_colour;

uniform sampler2D u_colour;  // sRGB and opacity
uniform sampler2D u_depth;   // window depth; 1 = nothing

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(u_depth, pixel, 0).r;
  if (depth >= 1.0) discard;
  o_colour = texelFetch(u_colour, pixel, 0);
  gl_FragDepth = depth;
}
