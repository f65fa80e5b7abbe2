// SPDX-License-Identifier: Apache-2.0
// The picture of a scene for one or two eyes: backdrop, volumes, tool, force arrow, in the order and
// with the layers of visualizer/compose.
import {clipFromEye, clippedRect, grownRect, isEmptyRect, screenBounds, unitedRect} from './camera.js';
import {kBlendStepVox, kIsoStepVox, kLongestTapVox, kPaletteWidth} from './constants.js';
import {Eye, viewUniforms} from './eye.js';
import {bind, cover, Program, texture} from './gl.js';
import {toolBounds} from './hand.js';
import {HandPainter} from './hand_painter.js';
import {leastExtinction, palette} from './matter.js';
import {affineInverse, boxCorners, multiply} from './math.js';
import {SolidOnGpu, TranslucentOnGpu} from './textures.js';

const kSmoothingReach = 3;  // pixels
const kUnitsPerVolume = 3;

export class Painter {
  /** Uploads all of a scene. `kindOf(volume)`: iso or blend. */
  constructor(gl, scene, kindOf) {
    Object.assign(this, {gl, scene, eyes: []});
    const isBlend = scene.volumes.map((_, v) => kindOf(v) === 'blend');
    this.blended = isBlend.filter(blend => blend).length;
    const units = gl.getParameter(gl.MAX_TEXTURE_IMAGE_UNITS);
    const most = Math.floor((units - 3) / kUnitsPerVolume);
    if (this.blended > most) {
      throw new Error(`${this.blended} volumes, and this browser has texture units for ${most}; take iso`);
    }
    const limit = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) - 2;
    for (const {name, volume} of scene.volumes) {
      if (Math.max(...volume.size) > limit) {
        throw new Error(`volume ${name} has ${volume.size.join('x')} voxels, and this browser takes ${limit} a side`);
      }
    }
    const rows = palette(scene.materials);
    this.volumes = scene.volumes.map((view, v) => isBlend[v] ?
      new TranslucentOnGpu(gl, view, scene.materials, rows) : new SolidOnGpu(gl, view));
    this.solids = this.volumes.filter((_, v) => !isBlend[v]);
    this.translucents = this.volumes.filter((_, v) => isBlend[v]);
    // Half floats: they are filtered everywhere.
    this.palette = texture(gl, gl.TEXTURE_2D, gl.RGBA16F, gl.LINEAR, [kPaletteWidth, 2]);
    this.byDensity = texture(gl, gl.TEXTURE_2D, gl.RGBA16F, gl.LINEAR, [kPaletteWidth, Math.max(this.blended, 1)]);
    this.uploadPalettes(rows);
    this.backdrop = new Program(gl, 'backdrop');
    this.smooth = new Program(gl, 'smooth');
    this.shown = new Program(gl, 'shown');
    this.faces = new Program(gl, 'cell_faces');
    if (this.solids.length > 0) this.makeIso();
    if (this.blended > 0) this.makeBlend();
    this.hand = new HandPainter(gl, scene);
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

  makeIso() {
    this.iso = new Program(this.gl, 'iso');
    this.iso.use();
    this.iso.setInts({u_density: 0, u_label: 1, u_active_cell: 2, u_entry_mm: 4, u_palette: 5});
    this.iso.set({u_step_vox: kIsoStepVox});
  }

  makeBlend() {
    const {gl, translucents} = this;
    const each = translucents.map((_, v) => `f(${v})`).join(' ');
    const labelled = translucents.map(({volume}) => volume.labels !== null).join(', ');
    this.cast = new Program(gl, 'blend', `#define KERF_VOLUMES ${this.blended}\n` +
      `#define KERF_EACH_VOLUME(f) ${each}\n#define KERF_HAS_LABELS bool[](${labelled})\n`);
    this.layer = new Program(gl, 'layer');
    this.layer.use();
    this.layer.setInts({u_colour: 0, u_depth: 1});
    const unit = kUnitsPerVolume * this.blended;
    const edge = Math.min(...translucents.map(({view}) => view.edge));
    this.cast.use();
    this.cast.setInts({u_by_density: unit, u_entry_mm: unit + 1, u_opaque_depth: unit + 2});
    this.cast.set({u_least_extinction: leastExtinction, u_step_mm: kBlendStepVox * edge});
    translucents.forEach((volume, v) => {
      const first = kUnitsPerVolume * v;
      this.cast.setInts({[`u_voxel[${v}]`]: first, [`u_material[${v}]`]: first + 1,
        [`u_active_cell[${v}]`]: first + 2});
      this.cast.set({[`u_texels[${v}]`]: volume.texels, [`u_edge_mm[${v}]`]: volume.view.edge,
        [`u_fade[${v}]`]: [volume.transfer.empty, volume.transfer.full]});
    });
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
      const reach = kLongestTapVox + 1;  // of the shading of a surface
      boxes.push(boxCorners(low.map(n => n - reach), high.map(n => n + reach), one.view.worldFromVoxel));
    }
    return boxes;
  }

  /** Makes layers for so many eyes of this size, unless they are there. True where they are new. */
  fit(eyes, width, height) {
    const same = this.eyes.length === eyes && this.eyes[0].all.x1 === width && this.eyes[0].all.y1 === height;
    if (same) return false;
    for (const eye of this.eyes) eye.free();
    this.eyes = Array.from({length: eyes},
      () => new Eye(this.gl, width, height, this.blended));
    return true;
  }

  /** Draws `view` into eye `index`, only what `boxes`, or another hand than `before`, may have
   * changed; all of it where `boxes` is null. Returns the pixels of volumes that were cast. */
  draw(index, view, hand, before, boxes) {
    const eye = this.eyes[index];
    const {x1: width, y1: height} = eye.all;
    let volumes = boxes ? null : eye.all;
    for (const box of boxes ?? []) volumes = unitedRect(volumes, screenBounds(box, view, width, height));
    let stage = volumes;
    if (boxes) {
      for (const one of hand === before ? [] : [hand, before]) {
        if (one) stage = unitedRect(stage, toolBounds(this.scene, one, view, width, height));
      }
    }
    if (isEmptyRect(stage)) return 0;
    if (!isEmptyRect(volumes)) this.drawOpaque(eye, view, volumes);
    eye.stage.copy(eye.opaque, stage);
    eye.stage.bind(stage);
    if (hand) this.hand.drawTool(view, hand);
    if (this.blended > 0) this.blend(eye, view, stage);
    if (hand) this.hand.drawForce(view, hand);
    this.smoothEdges(eye, clippedRect(grownRect(stage, kSmoothingReach), eye.all));
    const cast = this.blended > 0 ? stage : volumes;
    return isEmptyRect(cast) ? 0 : (cast.x1 - cast.x0) * (cast.y1 - cast.y0);
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
      this.drawEntries(eye, 0, volume, view, part);
      eye.opaque.bind(part);
      volume.bind();
      bind(gl, 4, gl.TEXTURE_2D_ARRAY, eye.entry);
      bind(gl, 5, gl.TEXTURE_2D, this.palette);
      this.iso.use();
      this.iso.set({...viewUniforms(view), u_iso: volume.view.iso / 65535, u_texels: volume.texels,
        u_texture_from_eye: affineInverse(multiply(view.eyeFromWorld, volume.worldFromTexture))});
      this.iso.setInts({u_has_labels: volume.volume.labels ? 1 : 0});
      cover(gl);
    }
  }

  /** Per pixel, where its ray first meets an active cell. */
  drawEntries(eye, layer, volume, view, part) {
    const {gl} = this;
    eye.entries.bind(part);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, eye.entry, 0, layer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.BLEND);
    gl.clearBufferfv(gl.COLOR, 0, [view.far, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    this.faces.use();
    this.faces.set({u_near_mm: view.near, u_clip_from_cell: multiply(clipFromEye(view),
      multiply(view.eyeFromWorld, volume.cells.worldFromCell))});
    volume.cells.drawFaces();
  }

  blend(eye, view, part) {
    const {gl} = this;
    this.translucents.forEach((volume, v) => this.drawEntries(eye, v, volume, view, part));
    eye.gathered.bind(part);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.COLOR, 1, [1, 0, 0, 0]);
    gl.disable(gl.DEPTH_TEST);
    this.cast.use();
    this.translucents.forEach((volume, v) => {
      volume.bind(kUnitsPerVolume * v);
      const textureFromEye = affineInverse(multiply(view.eyeFromWorld, volume.worldFromTexture));
      // A gradient per voxel edge goes to the eye's millimetres by the transposed Jacobian.
      const turned = [0, 1, 2].flatMap(c => [0, 1, 2].map(r => textureFromEye[4 * r + c] * volume.texels[c]));
      this.cast.set({[`u_texture_from_eye[${v}]`]: textureFromEye, [`u_eye_from_gradient[${v}]`]: turned});
    });
    const unit = kUnitsPerVolume * this.blended;
    bind(gl, unit, gl.TEXTURE_2D, this.byDensity);
    bind(gl, unit + 1, gl.TEXTURE_2D_ARRAY, eye.entry);
    bind(gl, unit + 2, gl.TEXTURE_2D, eye.stage.depth);
    this.cast.set(viewUniforms(view));
    cover(gl);
    bind(gl, unit + 2, gl.TEXTURE_2D, null);  // it is drawn into below
    eye.stage.bind(part);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
    bind(gl, 0, gl.TEXTURE_2D, eye.gathered.colours[0]);
    bind(gl, 1, gl.TEXTURE_2D, eye.gathered.colours[1]);
    this.layer.use();
    cover(gl);
    gl.disable(gl.BLEND);
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
    for (const one of [...this.eyes, ...this.volumes, this.hand, this.backdrop, this.smooth, this.shown, this.faces,
      this.iso, this.cast, this.layer]) {
      one?.free();
    }
    this.gl.deleteTexture(this.palette);
    this.gl.deleteTexture(this.byDensity);
  }
}
