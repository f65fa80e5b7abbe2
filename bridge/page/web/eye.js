// SPDX-License-Identifier: Apache-2.0
import {shownInEye} from './camera.js';
import {Target, texture} from './gl.js';
import {turn} from './math.js';

/** What both ray casters read of a view. */
export function viewUniforms(view) {
  return {u_half_size_at_1mm: [view.tanHalfHeight * view.aspect, view.tanHalfHeight],
    u_middle_at_1mm: [view.middleRight, 0], u_near_mm: view.near, u_far_mm: view.far,
    u_shown_eye: shownInEye(view), u_up_eye: turn(view.eyeFromWorld, [0, 1, 0])};
}

/** The layers of one eye, kept from frame to frame. */
export class Eye {
  /** `blended`: how many volumes are looked into. */
  constructor(gl, width, height, blended) {
    this.gl = gl;
    this.all = {x0: 0, y0: 0, x1: width, y1: height};
    this.opaque = new Target(gl, width, height, [gl.RGBA8]);
    this.stage = new Target(gl, width, height, [gl.RGBA8]);
    this.smooth = new Target(gl, width, height, [gl.RGBA8], false);
    this.layers = Math.max(blended, 1);
    this.entry = texture(gl, gl.TEXTURE_2D_ARRAY, gl.R32F, gl.NEAREST, [width, height, this.layers]);
    this.entries = new Target(gl, width, height, []);
    // Linear light, which a sum of hundreds of faint samples needs, and depth.
    this.gathered = blended > 0 ? new Target(gl, width, height, [gl.RGBA16F, gl.R32F], false) : null;
  }
  free() {
    this.gl.deleteTexture(this.entry);
    for (const one of [this.opaque, this.stage, this.smooth, this.entries, this.gathered]) one?.free();
  }
}
