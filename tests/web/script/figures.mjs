// SPDX-License-Identifier: Apache-2.0
// What the tests of the page compute for themselves: a camera by angles, not by the page's matrices.
import assert from 'node:assert/strict';

export const kDegree = Math.PI / 180;

/** Each number of `got` within `by` of that of `wanted`; flat arrays or numbers. */
export function near(got, wanted, by, what = '') {
  const [a, b] = [got, wanted].map(value => [value].flat());
  assert.equal(a.length, b.length, what);
  a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) <= by, `${what}: ${a} and not ${b}`));
}

/** Where a point of the world is seen, in pixels from the picture's upper left corner, by a camera at `distance` from
 * `target` that looks at it from `yaw` (about +y, 0 from +z) and `pitch` above; its lens is 28 degrees high. */
export function seenAt(point, {target, yaw, pitch, distance}, width, height) {
  const [x, y, z] = point.map((value, i) => value - target[i]);
  // About y by -yaw, then about x by pitch: the camera then looks along -z.
  const right = x * Math.cos(yaw) - z * Math.sin(yaw), toward = x * Math.sin(yaw) + z * Math.cos(yaw);
  const up = y * Math.cos(pitch) - toward * Math.sin(pitch);
  const depth = distance - (y * Math.sin(pitch) + toward * Math.cos(pitch));
  const pixels = height / 2 / Math.tan(14 * kDegree) / depth;
  return [width / 2 + right * pixels, height / 2 - up * pixels];
}

/** Where a vertex lands that a program draws with these two matrices (column by column), in pixels from the upper left. */
export function drawnAt(vertex, {u_eye_from_mesh: eye, u_clip_from_eye: clip}, width, height) {
  const times = (m, v) => [0, 1, 2, 3].map(r => m[r] * v[0] + m[4 + r] * v[1] + m[8 + r] * v[2] + m[12 + r] * v[3]);
  const [x, y, , w] = times(clip, times(eye, [...vertex, 1]));
  return [(x / w + 1) / 2 * width, (1 - y / w) / 2 * height];
}

/** A scene of one volume around the origin and one ball, as scene.js makes it. */
export function ballScene({size = [20, 20, 20], spacing = 1, radius = 2} = {}) {
  const half = size.map(n => n * spacing / 2);
  const corners = [...Array(8).keys()].map(i => half.map((value, axis) => i >> axis & 1 ? value : -value));
  const main = {radius: Math.hypot(...half), solid: true, name: 'tooth'};
  return {volumes: [main], main, materials: [], corners,
    tools: [{name: 'ball', radius, profile: [[-radius, 0], [0, radius], [radius, 0]], facets: {points_mm: [], triangles: []}, shaft: []}]};
}
