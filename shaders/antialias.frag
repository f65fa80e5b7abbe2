// SPDX-License-Identifier: Apache-2.0
#version 450 core
// Smooths the staircase of silhouettes: a ray hits or misses, so edges come without any coverage.
// Along an edge, found from the brightness of the neighbours, the picture is blurred by two pixels.

out vec4 o_colour;

uniform sampler2D u_picture;

const float kLeastContrast = 1.0 / 24.0;  // of the brightest neighbour; less is shading, not an edge

float brightness(vec3 colour) { return dot(colour, vec3(0.30, 0.59, 0.11)); }

float brightness_at(ivec2 pixel) {
  ivec2 inside = clamp(pixel, ivec2(0), textureSize(u_picture, 0) - 1);
  return brightness(texelFetch(u_picture, inside, 0).rgb);
}

vec3 along(vec2 pixel, vec2 edge, float from, float to) {
  vec2 size = vec2(textureSize(u_picture, 0));
  return 0.5 * (texture(u_picture, (pixel + from * edge) / size).rgb +
                texture(u_picture, (pixel + to * edge) / size).rgb);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 colour = texelFetch(u_picture, pixel, 0).rgb;
  float nw = brightness_at(pixel + ivec2(-1, 1));
  float ne = brightness_at(pixel + ivec2(1, 1));
  float sw = brightness_at(pixel + ivec2(-1, -1));
  float se = brightness_at(pixel + ivec2(1, -1));
  float here = brightness(colour);
  float least = min(here, min(min(nw, ne), min(sw, se)));
  float most = max(here, max(max(nw, ne), max(sw, se)));
  // A loop of at most one turn: a software GL skips it where no pixel of its group has an edge.
  for (bool edge = most - least > max(kLeastContrast, 0.125 * most); edge; edge = false) {
    // At right angles to the slope of brightness, two pixels long at most.
    vec2 direction = vec2(-(nw + ne) + (sw + se), (nw + sw) - (ne + se));
    float shortest = min(abs(direction.x), abs(direction.y)) + 1.0 / 128.0;
    direction = clamp(direction / shortest, -2.0, 2.0);
    vec3 near = along(gl_FragCoord.xy, direction, -1.0 / 6.0, 1.0 / 6.0);
    vec3 wide = 0.5 * near + 0.5 * along(gl_FragCoord.xy, direction, -0.5, 0.5);
    float at = brightness(wide);
    colour = at < least || at > most ? near : wide;  // what lies beyond the edge must not leak in
  }
  o_colour = vec4(colour, 1.0);
}
