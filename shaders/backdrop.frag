// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A neutral backdrop, lighter in the middle, so that pale enamel and a dark shaft both stand out.

in vec2 v_ndc;
out vec4 o_colour;

const vec3 kEdge = vec3(0.075, 0.085, 0.100);    // sRGB, as shown
const vec3 kMiddle = vec3(0.255, 0.275, 0.300);

void main() {
  float away = length(v_ndc * vec2(0.75, 0.85) - vec2(0.0, 0.10));
  // One step of 8 bits as a fixed dither: no bands in a dark gradient.
  float dither = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  vec3 colour = mix(kMiddle, kEdge, smoothstep(0.0, 1.25, away));
  o_colour = vec4(colour + (dither - 0.5) / 255.0, 1.0);
}
