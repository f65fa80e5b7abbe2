// SPDX-License-Identifier: Apache-2.0
#version 450 core
// A finished picture over the place where it is shown, larger where it was drawn coarsely.

in vec2 v_ndc;
out vec4 o_colour;

uniform sampler2D u_picture;

void main() { o_colour = vec4(texture(u_picture, 0.5 * v_ndc + 0.5).rgb, 1.0); }
