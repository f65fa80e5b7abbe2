// SPDX-License-Identifier: Apache-2.0
// Volumes cast ray by ray: where rays enter them, surfaces, and looks inside, as the renderers of
// visualizer/render.
import {clipFromEye, shownInEye} from './camera.js';
import {surfaceMm} from './cell_gradients.js';
import {kBlendStepVox} from './constants.js';
import {bind, cover, Program, programOf} from './gl.js';
import {affineInverse, multiply, turn} from './math.js';
import {leastExtinction} from './transfer_function.js';

const kUnitsPerVolume = 3;  // texture units of a volume that is looked into, without its cells
const kUnitsBeside = 3;

/** How many volumes can be looked into at once, if some of them have cells. */
export const mostBlended = (gl, cells) =>
  Math.floor((gl.getParameter(gl.MAX_TEXTURE_IMAGE_UNITS) - kUnitsBeside) / (kUnitsPerVolume + (cells ? 1 : 0)));

/** What both ray casters read of a view. */
function viewUniforms(view) {
  return {u_half_size_at_1mm: [view.tanHalfHeight * view.aspect, view.tanHalfHeight],
    u_middle_at_1mm: [view.middleRight, 0], u_near_mm: view.near, u_far_mm: view.far,
    u_clip_plane_eye: shownInEye(view), u_up_eye: turn(view.eyeFromWorld, [0, 1, 0])};
}

/** Per pixel, where its ray first meets an active cell. */
export class Entries {
  constructor(gl) {
    this.gl = gl;
    this.faces = programOf(gl, 'cell_faces');
  }
  draw(eye, layer, volume, view, part) {
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
}

/** The surface of one volume, into the opaque layer. */
export class IsoCaster {
  constructor(gl) {
    this.gl = gl;
    this.iso = programOf(gl, 'iso');
    this.iso.use();
    this.iso.setInts({u_density: 0, u_label: 1, u_active_cell: 2, u_fine_cell: 3, u_entry_mm: 4,
      u_palette: 5, u_cell_gradient: 6});
  }
  draw(eye, volume, view, part, palette) {
    const {gl} = this;
    eye.opaque.bind(part);
    volume.bind();
    bind(gl, 4, gl.TEXTURE_2D_ARRAY, eye.entry);
    bind(gl, 5, gl.TEXTURE_2D, palette);
    this.iso.use();
    this.iso.set({...viewUniforms(view), u_iso: volume.view.iso / 65535, u_texels: volume.texels,
      u_edges_mm: volume.view.edges,
      u_texture_from_eye: affineInverse(multiply(view.eyeFromWorld, volume.worldFromTexture))});
    this.iso.setInts({u_has_labels: volume.volume.labels ? 1 : 0});
    this.iso.set(volume.gradients.uniforms());
    cover(gl);
  }
}

/** What is seen inside of all volumes together, over what stands before it. */
export class BlendCaster {
  constructor(gl, volumes) {
    Object.assign(this, {gl, volumes});
    const each = volumes.map((_, v) => `f(${v})`).join(' ');
    const bools = of => `bool[](${volumes.map(of).join(', ')})`;
    const cells = volumes.some(({plan}) => !plan.cubes) ? `#define KERF_HAS_CELLS ${bools(({plan}) => !plan.cubes)}\n` : '';
    this.cast = new Program(gl, 'blend', `#define KERF_VOLUMES ${volumes.length}\n#define KERF_EACH_VOLUME(f) ${each}\n` +
      `#define KERF_HAS_LABELS ${bools(({volume}) => volume.labels !== null)}\n${cells}`);
    this.layer = programOf(gl, 'layer');
    this.layer.use();
    this.layer.setInts({u_colour: 0, u_depth: 1});
    this.unit = kUnitsPerVolume * volumes.length;
    this.cellsUnit = this.unit + kUnitsBeside;
    const edge = Math.min(...volumes.map(({view}) => view.edge));
    this.cast.use();
    this.cast.setInts({u_by_density: this.unit, u_entry_mm: this.unit + 1, u_opaque_depth: this.unit + 2});
    this.cast.set({u_least_extinction: leastExtinction, u_step_mm: kBlendStepVox * edge});
    volumes.forEach((volume, v) => {
      const first = kUnitsPerVolume * v;
      this.cast.setInts({[`u_voxel[${v}]`]: first, [`u_material[${v}]`]: first + 1,
        [`u_active_cell[${v}]`]: first + 2});
      this.cast.set({[`u_texels[${v}]`]: volume.texels,
        [`u_surface_mm[${v}]`]: surfaceMm(volume.view.edges) + volume.transfer.borderMm,
        [`u_fade[${v}]`]: [volume.transfer.empty, volume.transfer.full]});
      if (volume.plan.cubes) return;
      this.cast.setInts({[`u_cell_gradient[${v}]`]: this.cellsUnit + v});
      for (const [name, value] of Object.entries(volume.gradients.uniforms())) this.cast.set({[`${name}[${v}]`]: value});
    });
  }
  /** After the entries of each volume, into the stage. */
  draw(eye, view, part, byDensity) {
    const {gl, unit} = this;
    eye.gathered.bind(part);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.COLOR, 1, [1, 0, 0, 0]);
    gl.disable(gl.DEPTH_TEST);
    this.cast.use();
    this.volumes.forEach((volume, v) => {
      volume.bind(kUnitsPerVolume * v);
      if (!volume.plan.cubes) bind(gl, this.cellsUnit + v, gl.TEXTURE_3D, volume.gradients.texture);
      const textureFromEye = affineInverse(multiply(view.eyeFromWorld, volume.worldFromTexture));
      // A gradient per voxel edge, or per longest one, goes to the eye's millimetres by the transposed Jacobian.
      const perTexture = volume.texels.map((n, axis) => n * volume.plan.perEdge[axis]);
      const turned = [0, 1, 2].flatMap(c => [0, 1, 2].map(r => textureFromEye[4 * r + c] * perTexture[c]));
      this.cast.set({[`u_texture_from_eye[${v}]`]: textureFromEye, [`u_eye_from_gradient[${v}]`]: turned});
    });
    bind(gl, unit, gl.TEXTURE_2D, byDensity);
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
  free() {
    this.cast.free();
  }
}
