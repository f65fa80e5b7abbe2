// SPDX-License-Identifier: Apache-2.0
// Bodies in voxels of any edges, drawn by the page's own painter with shaders that show normals.
import {bind, contextOf, cover, texture} from './gl.js';
import {head, shaders} from './shaders.js';
import {Painter} from './layers.js';
import {add, affineInverse, boxCorners, cross, dot, fromAxes, length, normalized, subtract, times, transform, turn} from './math.js';
import {Volume} from './volume.js';

const kFull = 65535, kRadiusMm = 2.8, kCentre = [0.013, -0.027, 0.041];  // on no voxel
const kSize = [160, 120], kLeastFacing = 0.342;  // a normal is turned to the eye on the edge
const kEyes = [[7, 15, 19], [-22, 4, 7], [3, -9, -20]];

const canvas = document.createElement('canvas');
const gl = contextOf(canvas);

/** The fraction of a voxel that the ball fills: along z exactly, over 6x6 lines. */
function filled(at, edges) {
  const from = subtract(at, kCentre), away = length(from), reach = 0.5 * length(edges);
  if (away >= kRadiusMm + reach) return 0;
  if (away <= kRadiusMm - reach) return 1;
  let sum = 0;
  for (let line = 0; line < 36; ++line) {
    const x = from[0] + ((line % 6 + 0.5) / 6 - 0.5) * edges[0];
    const y = from[1] + ((Math.floor(line / 6) + 0.5) / 6 - 0.5) * edges[1];
    const half2 = kRadiusMm ** 2 - x * x - y * y;
    if (half2 <= 0) continue;
    const half = Math.sqrt(half2), low = from[2] - 0.5 * edges[2];
    sum += Math.max(0, Math.min(half, low + edges[2]) - Math.max(-half, low)) / edges[2];
  }
  return sum / 36;
}

/** A volume of `edges` and `density(at)` in 0..1, as a scene. */
function sceneOf(edges, size, density) {
  const grid = size.map(n => Math.ceil(n / 8));
  const volume = new Volume({nx: size[0], ny: size[1], nz: size[2], brick_count: grid[0] * grid[1] * grid[2], log2_brick: 3,
    bits_per_voxel: 16, off_labels: 0n});
  const first = size.map((n, axis) => -0.5 * (n - 1) * edges[axis]);
  const worldFromVoxel = fromAxes([edges[0], 0, 0], [0, edges[1], 0], [0, 0, edges[2]], first);
  for (let z = 0, at = 0; z < size[2]; ++z) {
    for (let y = 0; y < size[1]; ++y) {
      for (let x = 0; x < size[0]; ++x, ++at) {
        volume.density[at] = Math.round(kFull * density(transform(worldFromVoxel, [x, y, z])));
      }
    }
  }
  const corners = boxCorners([-0.5, -0.5, -0.5], size.map(n => n - 0.5), worldFromVoxel);
  const view = {volume, name: '', solid: true, worldFromVoxel, corners, iso: 32768, radius: 0.5 * length(subtract(corners[7], corners[0])),
    edges, edge: Math.min(...edges), voxelMm3: 1};
  return {volumes: [view], tools: [], materials: [{name: 'air', iso: 0, colour: [0, 0, 0]}, {name: 'ball', iso: 0.5, colour: [0, 0, 0], opacity: 0.996}],
    main: view, corners};
}

/** What is drawn: `density(at, edges)`, the views, and the normal at a point; null: this point does not count. */
const bodies = {
  partial: {density: filled, eyes: kEyes, outward: at => normalized(subtract(at, kCentre))},
  binary: {density: at => Number(length(subtract(at, kCentre)) < kRadiusMm), eyes: kEyes,
    outward: at => normalized(subtract(at, kCentre))},
  // Narrower than a thick slice, and along it: 0.45 mm wide, 0.9 deep. Of its walls what is not near an edge.
  trench: {density: ([x, y, z]) => Number(y < 1 && Math.hypot(x, z) < 2.6 && y > -1.5 && !(Math.abs(x) < 0.225 && y > 0.1)),
    eyes: [[5, 19, 1], [-5, 19, -1]],
    outward: ([x, y, z]) => y > 0.35 && y < 0.75 && Math.abs(x) < 0.4 && Math.abs(z) < 2 ? [-Math.sign(x), 0, 0] : null},
};
function bodyIn(edges, body) {
  const size = edges.map(edge => 2 * Math.ceil(kRadiusMm / edge + 2) + 1);
  return sceneOf(edges, size, at => body.density(at, edges));
}

function viewFrom(eye) {
  const backward = normalized(eye), right = normalized(cross([0, 1, 0], backward));
  const eyeFromWorld = affineInverse(fromAxes(right, cross(backward, right), backward, eye));
  return {eyeFromWorld, aspect: kSize[0] / kSize[1], middleRight: 0, near: 10, far: 40, tanHalfHeight: 0.16, shown: [0, 0, 0, 1]};
}

/** The texels of a texture, four floats each. */
function readTexels(from) {
  const stages = [[gl.VERTEX_SHADER, shaders.shown.vertex],
    [gl.FRAGMENT_SHADER, 'uniform sampler2D u_from; out vec4 o; void main() { o = texelFetch(u_from, ivec2(gl_FragCoord.xy), 0); }']];
  const program = gl.createProgram();
  for (const [kind, text] of stages) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, head + text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  const to = texture(gl, gl.TEXTURE_2D, gl.RGBA32F, gl.NEAREST, kSize);
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, to, 0);
  gl.viewport(0, 0, ...kSize);
  gl.disable(gl.SCISSOR_TEST);
  gl.disable(gl.DEPTH_TEST);
  gl.disable(gl.BLEND);
  gl.useProgram(program);
  gl.uniform1i(gl.getUniformLocation(program, 'u_from'), 0);
  bind(gl, 0, gl.TEXTURE_2D, from);
  cover(gl);
  const values = new Float32Array(4 * kSize[0] * kSize[1]);
  gl.readPixels(0, 0, ...kSize, gl.RGBA, gl.FLOAT, values);
  gl.deleteFramebuffer(framebuffer);
  gl.deleteTexture(to);
  gl.deleteProgram(program);
  return values;
}

/** What normals.frag has written. */
function shownNormal([r, g, b]) {
  const x = r * 16 + (g >> 4), y = (g & 15) * 256 + b;
  const n = [x / 4095 * 2 - 1, y / 4095 * 2 - 1];
  return [...n, Math.sqrt(Math.max(0, 1 - n[0] ** 2 - n[1] ** 2))];
}

/** In place of the light where a volume is looked into: the angle between the normal and the ball's, in degrees. */
const blendAsItIs = shaders.blend.fragment;
function showAngles({edges, worldFromVoxel}) {
  const lit = 'lit(material.rgb, normal, to_eye, u_up_eye, 1.0)';
  if (!blendAsItIs.includes(lit)) throw new Error(`translucent_sample.frag has no ${lit}; name what it has`);
  const vec3 = values => `vec3(${values.map(one => one.toFixed(9)).join(', ')})`;
  const first = subtract(worldFromVoxel.slice(12, 15), kCentre);
  shaders.blend.fragment = blendAsItIs.replace(lit, 'vec3(off_degrees(v, p, normal), 1.0, 0.0)').replace('vec4 material_of(', `
float off_degrees(int v, vec3 p, vec3 normal) {
  vec3 mm = (p * u_texels[v] - 1.5) * ${vec3(edges)} + ${vec3(first)};
  vec3 wanted = vec3(0.0);
  for (int axis = 0; axis < 3; ++axis) wanted += mm[axis] * normalize(u_eye_from_gradient[v][axis]);
  return degrees(2.0 * asin(min(0.5 * length(normalize(wanted) - normal), 1.0)));
}
vec4 material_of(`);
}

const kDegrees = 180 / Math.PI;

/** {p99, median, pixels, error}: angles in degrees between the normals that are drawn and a body's. */
export function anglesOf(edges, kind, name = 'partial') {
  const body = bodies[name];
  const scene = bodyIn(edges, body);
  showAngles(scene.main);
  const painter = new Painter(gl, scene, () => kind);
  painter.take();
  painter.fit(1, ...kSize);
  const [eye] = painter.eyes;
  const isIso = kind === 'iso';
  const angles = [];
  for (const from of body.eyes) {
    const view = viewFrom(from);
    painter.draw(0, view, [], [], null);
    const toWorld = affineInverse(view.eyeFromWorld);
    const depth = readTexels(isIso ? eye.opaque.depth : eye.gathered.colours[1]);
    const shown = readTexels(isIso ? eye.opaque.colours[0] : eye.gathered.colours[0]);
    for (let i = 0; i < kSize[0] * kSize[1]; ++i) {
      const d = depth[4 * i];
      if (d >= 1) continue;
      const {near: n, far: f} = view;
      const t = 2 * f * n / (f + n - (2 * d - 1) * (f - n));
      const ndc = [(i % kSize[0] + 0.5) / kSize[0] * 2 - 1, (Math.floor(i / kSize[0]) + 0.5) / kSize[1] * 2 - 1];
      const inEye = [ndc[0] * view.tanHalfHeight * view.aspect * t, ndc[1] * view.tanHalfHeight * t, -t];
      const outward = body.outward(transform(toWorld, inEye));
      if (!outward) continue;
      const wanted = turn(view.eyeFromWorld, outward);
      if (name !== 'trench' && -dot(wanted, normalized(inEye)) < kLeastFacing) continue;
      const colour = [...shown.slice(4 * i, 4 * i + 3)];
      if (!isIso) {
        if (colour[1] > 0) angles.push(colour[0] / colour[1]);
        continue;
      }
      const normal = shownNormal(colour.map(c => Math.round(255 * c)));
      angles.push(2 * Math.asin(Math.min(0.5 * length(subtract(normal, wanted)), 1)) * kDegrees);
    }
  }
  painter.free();
  angles.sort((a, b) => a - b);
  return {p99: angles[Math.floor(0.99 * angles.length)], median: angles[angles.length >> 1], pixels: angles.length, error: gl.getError()};
}

/** Pixels that differ between a picture of which parts were drawn anew after cuts, and one that was made anew: [first eye's
 * view, ...]; and how many of them the cuts changed. */
export function wrongAfterCuts(edges, kind) {
  const scene = bodyIn(edges, bodies.partial);
  const {volume} = scene.main;
  shaders.blend.fragment = blendAsItIs;
  const view = viewFrom(kEyes[0]);
  const painter = new Painter(gl, scene, () => kind);
  const shownBy = one => readTexels(one.eyes[0].stage.colours[0]);
  painter.take();
  painter.fit(1, ...kSize);
  painter.draw(0, view, [], [], null);
  let before = shownBy(painter), wrong = 0, changed = 0, drawn = 0;
  const differing = (a, b) => a.reduce((sum, value, i) => sum + (value !== b[i]), 0);
  for (const at of [[1.2, 1.6, 1.9], [0.2, 2.2, 1.7], [-0.6, 1.1, 2.4]]) {
    // A ball of 0.4 mm is cut, as bricks of 8^3 voxels come.
    const size = volume.size, middle = at.map((mm, axis) => mm / edges[axis] + 0.5 * (size[axis] - 1));
    for (let id = 0; id < volume.bricks; ++id) {
      const block = new Uint8Array(1024);
      volume.rows(id, (to, from, count) => {
        for (let i = 0; i < count; ++i) {
          const place = from + i, voxel = [place % size[0], Math.floor(place / size[0]) % size[1], Math.floor(place / size[0] / size[1])];
          const far = Math.hypot(...voxel.map((n, axis) => (n - middle[axis]) * edges[axis]));
          const density = far < 0.4 ? 0 : volume.density[place];
          block[2 * (to + i)] = density & 255;
          block[2 * (to + i) + 1] = density >> 8;
        }
      });
      volume.came[id] = 1;
      volume.putDensity(id, block);
    }
    drawn += painter.draw(0, view, [], [], painter.take()) < kSize[0] * kSize[1];
    const anew = new Painter(gl, scene, () => kind);
    anew.take();
    anew.fit(1, ...kSize);
    anew.draw(0, view, [], [], null);
    const now = shownBy(painter);
    wrong += differing(now, shownBy(anew));
    changed += differing(now, before);
    before = now;
    anew.free();
  }
  painter.free();
  return {wrong, changed, drawn, error: gl.getError()};
}
