// SPDX-License-Identifier: Apache-2.0
// The picture of a scene for one or two eyes: backdrop, volumes, tool, force arrow, in the order and
// with the layers of visualizer/compose.
import {clippedRect, grownRect, isEmptyRect, screenBounds, unitedRect} from './camera.js';
import {cellPlan} from './cell_gradients.js';
import {kPaletteWidth} from './constants.js';
import {bind, cover, programOf, requireNoError, Target, texture} from './gl.js';
import {boxCorners} from './math.js';
import {BlendCaster, Entries, IsoCaster, mostBlended} from './renderers.js';
import {SolidOnGpu, TranslucentOnGpu} from './textures.js';
import {HandPainter, kMetal, kPlain, sameHand, toolBounds} from './tool.js';
import {palette} from './transfer_function.js';

const kSmoothingReach = 3;  // pixels

/** Lets the driver begin with the programs of a picture by iso, while its volumes are on their way. */
export function beginPrograms(gl) {
  for (const name of ['iso', 'cell_faces', 'backdrop', 'smooth', 'shown']) programOf(gl, name);
  for (const surface of [kMetal, kPlain]) programOf(gl, 'mesh', surface);
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

export class Painter {
  /** Makes room for all of a scene. `kindOf(volume)`: iso or blend. Throws why there can be no picture. */
  constructor(gl, scene, kindOf) {
    Object.assign(this, {gl, scene, eyes: [], volumes: []});
    const isBlend = scene.volumes.map((_, v) => kindOf(v) === 'blend');
    this.blended = isBlend.filter(blend => blend).length;
    const most = mostBlended(gl, scene.volumes.some(({edges}, v) => isBlend[v] && !cellPlan(edges).cubes));
    if (this.blended > most) {
      throw new Error(`${this.blended} volumes, and this browser has texture units for ${most}; take iso`);
    }
    const limit = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) - 2;
    for (const {name, volume} of scene.volumes) {
      if (Math.max(...volume.size) > limit) {
        throw new Error(`volume ${name} has ${volume.size.join('x')} voxels, and this browser takes ${limit} a side`);
      }
    }
    try {
      this.make(isBlend);
    } catch (problem) {
      this.free();
      throw problem;
    }
  }

  make(isBlend) {
    const {gl, scene} = this;
    const rows = palette(scene.materials);
    this.volumes = scene.volumes.map((view, v) => isBlend[v] ?
      new TranslucentOnGpu(gl, view, scene.materials, rows) : new SolidOnGpu(gl, view));
    this.solids = this.volumes.filter((_, v) => !isBlend[v]);
    this.translucents = this.volumes.filter((_, v) => isBlend[v]);
    // Half floats: they are filtered everywhere.
    this.palette = texture(gl, gl.TEXTURE_2D, gl.RGBA16F, gl.LINEAR, [kPaletteWidth, 2]);
    this.byDensity = texture(gl, gl.TEXTURE_2D, gl.RGBA16F, gl.LINEAR, [kPaletteWidth, Math.max(this.blended, 1)]);
    this.uploadPalettes(rows);
    this.backdrop = programOf(gl, 'backdrop');
    this.smooth = programOf(gl, 'smooth');
    this.shown = programOf(gl, 'shown');
    this.entries = new Entries(gl);
    this.iso = this.solids.length > 0 ? new IsoCaster(gl) : null;
    this.blend = this.blended > 0 ? new BlendCaster(gl, this.translucents) : null;
    this.hand = new HandPainter(gl, scene);
    requireNoError(gl);
  }

  uploadPalettes(rows) {
    const {gl} = this;
    gl.bindTexture(gl.TEXTURE_2D, this.palette);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, kPaletteWidth, 2, gl.RGBA, gl.FLOAT, rows);
    gl.bindTexture(gl.TEXTURE_2D, this.byDensity);
    for (let v = 0; v < this.blended; ++v) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, v, kPaletteWidth, 1, gl.RGBA, gl.FLOAT, rows);
    }
  }

  /** Other colours and opacities of the same materials. */
  setMaterials(materials) {
    const rows = palette(materials);
    this.uploadPalettes(rows);
    for (const volume of this.translucents) volume.setRows(rows);
  }

  /** Uploads what came; the boxes (corners, mm) within which the picture may differ. */
  take() {
    const boxes = [];
    for (const one of this.volumes) {
      const bricks = one.take();
      if (bricks.length === 0) continue;
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const id of bricks) {
        const brick = one.volume.brick(id);
        for (let axis = 0; axis < 3; ++axis) {
          low[axis] = Math.min(low[axis], brick.low[axis]);
          high[axis] = Math.max(high[axis], brick.high[axis]);
        }
      }
      const reach = one.shadingReach;
      boxes.push(boxCorners(low.map((n, axis) => n - reach[axis]), high.map((n, axis) => n + reach[axis]),
        one.view.worldFromVoxel));
    }
    return boxes;
  }

  /** Makes layers for so many eyes of this size, unless they are there. True where they are new. Throws
   * as requireNoError. */
  fit(eyes, width, height) {
    const same = this.eyes.length === eyes && this.eyes[0].all.x1 === width && this.eyes[0].all.y1 === height;
    if (same) return false;
    for (const eye of this.eyes) eye.free();
    this.eyes = Array.from({length: eyes},
      () => new Eye(this.gl, width, height, this.blended));
    requireNoError(this.gl);
    return true;
  }

  /** What of a picture of this size `boxes`, or other hands than `before`, may have changed; all of it
   * where `boxes` is null: {volumes, stage, pixels}, two parts that may be empty, and of volumes the
   * pixels that are to be cast. */
  partsOf(view, hands, before, boxes, width, height) {
    const all = {x0: 0, y0: 0, x1: width, y1: height};
    let volumes = boxes ? null : all;
    for (const box of boxes ?? []) volumes = unitedRect(volumes, screenBounds(box, view, width, height));
    let stage = volumes;
    if (boxes) {
      for (let arm = 0; arm < Math.max(hands.length, before.length); ++arm) {
        if (sameHand(hands[arm], before[arm])) continue;
        for (const one of [hands[arm], before[arm]]) {
          if (one) stage = unitedRect(stage, toolBounds(this.scene, one, view, width, height));
        }
      }
    }
    const cast = this.blended > 0 ? stage : volumes;
    return {volumes, stage, pixels: isEmptyRect(cast) ? 0 : (cast.x1 - cast.x0) * (cast.y1 - cast.y0)};
  }

  /** Draws `view` into eye `index`, as much of it as `partsOf` says. Returns the pixels of volumes that
   * were cast. */
  draw(index, view, hands, before, boxes) {
    const eye = this.eyes[index];
    const {volumes, stage, pixels} = this.partsOf(view, hands, before, boxes, eye.all.x1, eye.all.y1);
    if (isEmptyRect(stage)) return 0;
    if (!isEmptyRect(volumes)) this.drawOpaque(eye, view, volumes);
    eye.stage.copy(eye.opaque, stage);
    eye.stage.bind(stage);
    for (const hand of hands) if (hand) this.hand.drawTool(view, hand);
    if (this.blended > 0) this.drawInside(eye, view, stage);
    for (const hand of hands) if (hand) this.hand.drawForce(view, hand);
    this.smoothEdges(eye, clippedRect(grownRect(stage, kSmoothingReach), eye.all));
    return pixels;
  }

  drawOpaque(eye, view, part) {
    const {gl} = this;
    eye.opaque.bind(part);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.ALWAYS);
    gl.disable(gl.BLEND);
    this.backdrop.use();
    cover(gl);
    gl.depthFunc(gl.LESS);
    for (const volume of this.solids) {
      this.entries.draw(eye, 0, volume, view, part);
      this.iso.draw(eye, volume, view, part, this.palette);
    }
  }

  drawInside(eye, view, part) {
    this.translucents.forEach((volume, v) => this.entries.draw(eye, v, volume, view, part));
    this.blend.draw(eye, view, part, this.byDensity);
  }

  smoothEdges(eye, part) {
    const {gl} = this;
    eye.smooth.bind(part);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    bind(gl, 0, gl.TEXTURE_2D, eye.stage.colours[0]);
    this.smooth.use();
    this.smooth.setInts({u_picture: 0});
    cover(gl);
  }

  /** Puts the eyes side by side on the canvas. */
  show(width, height) {
    const {gl} = this;
    const each = Math.floor(width / this.eyes.length);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    this.shown.use();
    this.shown.setInts({u_picture: 0});
    this.eyes.forEach((eye, i) => {
      gl.viewport(i * each, 0, each, height);
      bind(gl, 0, gl.TEXTURE_2D, eye.smooth.colours[0]);
      cover(gl);
    });
  }

  free() {
    for (const one of [...this.eyes, ...this.volumes, this.hand, this.blend]) {
      one?.free();
    }
    this.gl.deleteTexture(this.palette);
    this.gl.deleteTexture(this.byDensity);
  }
}
