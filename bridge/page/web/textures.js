// SPDX-License-Identifier: Apache-2.0
// Volumes on the GPU: uploaded by boxes of changed bricks.
import {CellGradients, cellPlan, joined, surfaceVoxels} from './cell_gradients.js';
import {kClearVox, kMostTapVox, kOcclusionTapsMm} from './constants.js';
import {bind, texture} from './gl.js';
import {scaled, translated} from './math.js';
import {gradientByte, gradientTexels, MaterialTexels, transferFunction} from './transfer_function.js';
import {FineCells, Macrocells} from './volume.js';

/** A texel for each voxel inside a border of air one voxel thick. */
class VoxelTexture {
  constructor(gl, size, internal, format, filter) {
    Object.assign(this, {gl, size, format});
    this.texture = texture(gl, gl.TEXTURE_3D, internal, filter, size.map(n => n + 2));
  }
  /** Makes all of it one colour, which the format can be drawn in. */
  fill(colour) {
    const {gl} = this;
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.disable(gl.SCISSOR_TEST);
    for (let z = 0; z < this.size[2] + 2; ++z) {
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.texture, 0, z);
      gl.clearBufferfv(gl.COLOR, 0, colour);
    }
    gl.deleteFramebuffer(framebuffer);
  }
  /** `texels` fill the box from `low` to `high`. */
  upload(low, high, texels) {
    const {gl} = this;
    gl.bindTexture(gl.TEXTURE_3D, this.texture);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, low[0] + 1, low[1] + 1, low[2] + 1, high[0] - low[0],
      high[1] - low[1], high[2] - low[2], this.format, gl.UNSIGNED_BYTE, texels);
  }
  /** The box out of `whole`, the bytes of all texels. */
  uploadFrom(low, high, whole, texelBytes) {
    const {gl} = this;
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, this.size[0]);
    gl.pixelStorei(gl.UNPACK_IMAGE_HEIGHT, this.size[1]);
    const first = (low[2] * this.size[1] + low[1]) * this.size[0] + low[0];
    this.upload(low, high, whole.subarray(first * texelBytes));
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    gl.pixelStorei(gl.UNPACK_IMAGE_HEIGHT, 0);
  }
  free() {
    this.gl.deleteTexture(this.texture);
  }
}

/** Boxes of voxels that hold these bricks, no larger than a layer of the volume, and a third of each
 * box or more changed: a call for each brick costs more than its voxels do. */
export function boxesOf(volume, bricks) {
  const [gx, gy] = volume.grid;
  const boxes = [];
  const add = cells => {
    const low = [0, 1, 2].map(axis => cells.reduce((least, cell) => Math.min(least, cell[axis]), Infinity));
    const high = [0, 1, 2].map(axis => cells.reduce((most, cell) => Math.max(most, cell[axis] + 1), 0));
    const size = high.map((n, axis) => n - low[axis]);
    const all = size[0] * size[1] * size[2];
    if (3 * cells.length >= all && all <= gx * gy) {
      boxes.push({low: low.map(n => 8 * n), high: high.map((n, axis) => Math.min(8 * n, volume.size[axis]))});
      return;
    }
    const axis = size.indexOf(Math.max(...size));
    const middle = low[axis] + (size[axis] >> 1);
    add(cells.filter(cell => cell[axis] < middle));
    add(cells.filter(cell => cell[axis] >= middle));
  };
  if (bricks.length > 0) add(bricks.map(id => [id % gx, Math.floor(id / gx) % gy, Math.floor(id / gx / gy)]));
  return boxes;
}

/** Active cells of a volume as a texture, and the faces around them. */
class CellsOnGpu {
  constructor(gl, view, threshold) {
    this.gl = gl;
    this.cells = new Macrocells(view.volume, threshold);
    this.texture = texture(gl, gl.TEXTURE_3D, gl.R8UI, gl.NEAREST, this.cells.grid);
    this.worldFromCell = scaled(translated(view.worldFromVoxel, [-1, -1, -1]), [8, 8, 8]);
    this.array = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.faces = 0;
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 4, gl.UNSIGNED_SHORT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
  }
  update(touched) {
    if (!this.cells.update(touched)) return;
    const {gl} = this;
    gl.bindTexture(gl.TEXTURE_3D, this.texture);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, ...this.cells.grid, gl.RED_INTEGER, gl.UNSIGNED_BYTE,
      this.cells.active);
    const faces = this.cells.faces();
    this.faces = faces.length / 4;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, faces, gl.DYNAMIC_DRAW);
  }
  drawFaces() {
    if (this.faces === 0) return;
    this.gl.bindVertexArray(this.array);
    this.gl.drawArraysInstanced(this.gl.TRIANGLES, 0, 6, this.faces);
  }
  free() {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.array);
  }
}

/** `FineCells` as a texture. */
class FineCellsOnGpu {
  constructor(gl, view, cells) {
    this.gl = gl;
    this.cells = new FineCells(view.volume, cells);
    this.texture = texture(gl, gl.TEXTURE_3D, gl.R8UI, gl.NEAREST, this.cells.grid);
  }
  update(touched) {
    const box = this.cells.update(touched);
    if (!box) return;
    const {gl, cells: {grid, octants}} = this, {low, high} = box;
    gl.bindTexture(gl.TEXTURE_3D, this.texture);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, grid[0]);
    gl.pixelStorei(gl.UNPACK_IMAGE_HEIGHT, grid[1]);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, ...low, ...high.map((n, axis) => n - low[axis]), gl.RED_INTEGER,
      gl.UNSIGNED_BYTE, octants.subarray((low[2] * grid[1] + low[1]) * grid[0] + low[0]));
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    gl.pixelStorei(gl.UNPACK_IMAGE_HEIGHT, 0);
  }
  free() {
    this.gl.deleteTexture(this.texture);
  }
}

/** Three of four numbers a texel, as vectors of length 127 in signed bytes. */
function directionBytes(vectors) {
  const bytes = new Int8Array(vectors.length);
  for (let at = 0; at < vectors.length; at += 4) {
    const x = vectors[at], y = vectors[at + 1], z = vectors[at + 2], square = x * x + y * y + z * z;
    if (square === 0) continue;
    const scale = 127 / Math.sqrt(square);
    bytes[at] = Math.round(scale * x);
    bytes[at + 1] = Math.round(scale * y);
    bytes[at + 2] = Math.round(scale * z);
  }
  return bytes;
}

/** The gradients of the cells of a volume as a texture. With an `iso` value, and if the voxels are cubes, the directions of
 * those alone that a point of the surface lies between: half of the memory, and a fourth of the time. */
class CellGradientsOnGpu {
  constructor(gl, volume, plan, iso) {
    Object.assign(this, {gl, iso, directions: iso !== null && plan.cubes});
    this.cells = new CellGradients(volume, plan);
    this.size = this.cells.grid.map(n => n + 2);
    this.texture = texture(gl, gl.TEXTURE_3D, this.directions ? gl.RGBA8_SNORM : gl.RGBA16F, gl.LINEAR, this.size);
  }
  /** After the voxels of these boxes have changed. */
  update(boxes) {
    const {gl, cells, iso, directions} = this;
    gl.bindTexture(gl.TEXTURE_3D, this.texture);
    const upload = (low, high, type, texels) => gl.texSubImage3D(gl.TEXTURE_3D, 0, ...low.map(n => n + 1),
      ...high.map((n, axis) => n - low[axis]), gl.RGBA, type, texels);
    for (const box of joined(boxes.map(one => cells.update(one)))) {
      if (directions) {
        // Where there are none, none is read.
        cells.blocks(box, (low, high, found) => found && upload(low, high, gl.BYTE, directionBytes(found)),
          (low, high) => surfaceVoxels(cells.volume, iso, low, high));
      } else {
        cells.blocks(box, (low, high, found) => upload(low, high, gl.FLOAT,
          found ?? new Float32Array(4 * high.reduce((count, n, axis) => count * (n - low[axis]), 1))));
      }
    }
  }
  /** From texture coordinates of the voxels, inside of their border of one, to those of the cells. */
  uniforms() {
    const {cell, perEdge} = this.cells.plan;
    const texels = this.cells.volume.size.map(n => n + 2);
    return {u_cell_scale: texels.map((n, axis) => n / (cell[axis] * this.size[axis])),
      u_cell_shift: cell.map((n, axis) => (1 - 1 / n) / this.size[axis]),
      u_per_edge: perEdge, u_fine: cell.map(n => n > 1 ? 1 : 0)};
  }
  free() {
    this.gl.deleteTexture(this.texture);
  }
}

/** What both renderers have of a volume; `take` uploads what came since. */
class VolumeOnGpu {
  constructor(gl, view, threshold) {
    Object.assign(this, {gl, view, volume: view.volume});
    this.texels = this.volume.size.map(n => n + 2);
    this.worldFromTexture = scaled(translated(view.worldFromVoxel, [-1.5, -1.5, -1.5]), this.texels);
    this.cells = new CellsOnGpu(gl, view, threshold);
    this.plan = cellPlan(view.edges);
    const tapMm = Math.max(...kOcclusionTapsMm, kClearVox * Math.max(...view.edges));
    /** Voxels, by axis, over which a changed one is seen in the shading of a surface. */
    this.shadingReach = view.edges.map((edge, axis) =>
      Math.max(Math.min(tapMm / edge, kMostTapVox), this.plan.reach[axis]) + 1);
    this.stale = this.volume.follow();
  }
  /** Takes up what changed; returns those bricks. */
  take() {
    const bricks = [...this.stale];
    this.stale.clear();
    if (bricks.length === 0) return bricks;
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    const boxes = boxesOf(this.volume, bricks);
    for (const {low, high} of boxes) this.upload(low, high);
    this.gradients.update(boxes);
    this.updateCells(this.cells.cells.touched(bricks));
    return bricks;
  }
  updateCells(touched) {
    this.cells.update(touched);
  }
  free() {
    this.volume.forget(this.stale);
    this.cells.free();
    this.gradients.free();
  }
}

/** Density, as two bytes a texel, low and high, and labels: what volume_sample.frag reads. */
export class SolidOnGpu extends VolumeOnGpu {
  constructor(gl, view) {
    super(gl, view, view.iso);
    this.gradients = new CellGradientsOnGpu(gl, this.volume, this.plan, view.iso);
    this.fineCells = new FineCellsOnGpu(gl, view, this.cells.cells);
    this.density = new VoxelTexture(gl, this.volume.size, gl.RG8, gl.RG, gl.LINEAR);
    const labelled = this.volume.labels ? this.volume.size : [0, 0, 0];
    this.labels = new VoxelTexture(gl, labelled, gl.R8UI, gl.RED_INTEGER, gl.NEAREST);
  }
  upload(low, high) {
    this.density.uploadFrom(low, high, new Uint8Array(this.volume.density.buffer), 2);
    if (this.volume.labels) this.labels.uploadFrom(low, high, this.volume.labels, 1);
  }
  updateCells(touched) {
    super.updateCells(touched);
    this.fineCells.update(touched);
  }
  bind() {
    bind(this.gl, 0, this.gl.TEXTURE_3D, this.density.texture);
    bind(this.gl, 1, this.gl.TEXTURE_3D, this.labels.texture);
    bind(this.gl, 2, this.gl.TEXTURE_3D, this.cells.texture);
    bind(this.gl, 3, this.gl.TEXTURE_3D, this.fineCells.texture);
    bind(this.gl, 6, this.gl.TEXTURE_3D, this.gradients.texture);
  }
  free() {
    super.free();
    this.fineCells.free();
    this.density.free();
    this.labels.free();
  }
}

/** The gradients of cubes, and the densities, in the texels of a volume. */
class GradientTexels {
  constructor(volume, plan, voxels) {
    Object.assign(this, {volume, voxels, cells: new CellGradients(volume, plan)});
    this.begun = false;
  }
  /** After the voxels of these boxes have changed. */
  update(boxes) {
    const {volume, voxels, cells} = this;
    const within = ({low, high}) =>
      ({low: low.map(n => Math.max(n, 0)), high: high.map((n, axis) => Math.min(n, volume.size[axis]))});
    for (const box of joined(boxes.map(one => within(cells.update(one))))) {
      cells.blocks(box, (low, high, gradients) => {
        const texels = gradientTexels(volume, low, high, !this.begun && !gradients);
        if (!texels) return;  // as the texture is at first
        for (let at = 0; gradients && at < texels.length; at += 4) {
          for (let i = at; i < at + 3; ++i) texels[i] = gradientByte(gradients[i]);
        }
        voxels.upload(low, high, texels);
      });
    }
    this.begun = true;
  }
  free() {}
}

/** Gradient and density in one texture, materials in a second where there are labels. */
export class TranslucentOnGpu extends VolumeOnGpu {
  constructor(gl, view, materials, rows) {
    const transfer = transferFunction(view, materials);
    super(gl, view, transfer.lowestSeen);
    this.transfer = transfer;
    const {volume, plan} = this, {labels, size} = volume;
    this.voxels = new VoxelTexture(gl, size, gl.RGBA8, gl.RGBA, gl.LINEAR);
    this.voxels.fill([128 / 255, 128 / 255, 128 / 255, 0]);
    this.gradients = plan.cubes ? new GradientTexels(volume, plan, this.voxels) :
      new CellGradientsOnGpu(gl, volume, plan, null);
    this.materials = new VoxelTexture(gl, labels ? size : [0, 0, 0], gl.RGBA8, gl.RGBA, gl.LINEAR);
    this.materialTexels = labels ? new MaterialTexels(this.volume, rows) : null;
  }
  upload(low, high) {
    if (!this.plan.cubes) {
      // A gradient reaches a voxel farther.
      const from = low.map(n => Math.max(n - 1, 0));
      const to = high.map((n, axis) => Math.min(n + 1, this.volume.size[axis]));
      const texels = gradientTexels(this.volume, from, to, !this.begun);
      if (!texels) return;  // as the texture is at first
      this.voxels.upload(from, to, texels);
    }
    if (this.materialTexels) this.materials.upload(low, high, this.materialTexels.of(low, high));
  }
  /** Other colours and opacities: of labels; by density the palette has them. */
  setRows(rows) {
    if (!this.materialTexels) return;
    this.materialTexels = new MaterialTexels(this.volume, rows);
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    const low = [0, 0, 0], high = this.volume.size;
    this.materials.upload(low, high, this.materialTexels.of(low, high));
  }
  take() {
    const bricks = super.take();
    this.begun = true;
    return bricks;
  }
  bind(unit) {
    bind(this.gl, unit, this.gl.TEXTURE_3D, this.voxels.texture);
    bind(this.gl, unit + 1, this.gl.TEXTURE_3D, this.materials.texture);
    bind(this.gl, unit + 2, this.gl.TEXTURE_3D, this.cells.texture);
  }
  free() {
    super.free();
    this.voxels.free();
    this.materials.free();
  }
}
