// SPDX-License-Identifier: Apache-2.0
// Vectors are arrays of three numbers, matrices sixteen numbers column by column, as GL takes them.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = a => Math.hypot(a[0], a[1], a[2]);
export const normalized = a => times(a, 1 / length(a));
export const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const mix = (a, b, share) => a + (b - a) * share;
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

export const identity = () => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
export const column = (m, i) => [m[4 * i], m[4 * i + 1], m[4 * i + 2]];

export function multiply(a, b) {
  const m = new Array(16).fill(0);
  for (let c = 0; c < 4; ++c) {
    for (let r = 0; r < 4; ++r) {
      for (let k = 0; k < 4; ++k) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return m;
}

/** m times the point p. */
export const transform = (m, p) => add(turn(m, p), column(m, 3));
/** m times the direction v. */
export const turn = (m, v) => [0, 1, 2].map(r => m[r] * v[0] + m[4 + r] * v[1] + m[8 + r] * v[2]);

/** From axes and origin. */
export const fromAxes = (x, y, z, at) => [...x, 0, ...y, 0, ...z, 0, ...at, 1];
export const translated = (m, by) =>
  fromAxes(column(m, 0), column(m, 1), column(m, 2), transform(m, by));
export const scaled = (m, by) =>
  fromAxes(times(column(m, 0), by[0]), times(column(m, 1), by[1]), times(column(m, 2), by[2]),
    column(m, 3));

export const determinant = m => dot(column(m, 0), cross(column(m, 1), column(m, 2)));

/** Upper left 3x3 of the transposed inverse: what takes normals. */
export function normalMatrix(m) {
  const [x, y, z] = [column(m, 0), column(m, 1), column(m, 2)];
  const by = 1 / determinant(m);
  return [...times(cross(y, z), by), ...times(cross(z, x), by), ...times(cross(x, y), by)];
}

/** Of a matrix whose last row is 0 0 0 1. */
export function affineInverse(m) {
  const n = normalMatrix(m);
  const inverse = [n[0], n[3], n[6], 0, n[1], n[4], n[7], 0, n[2], n[5], n[8], 0, 0, 0, 0, 1];
  const back = turn(inverse, column(m, 3));
  return [...inverse.slice(0, 12), -back[0], -back[1], -back[2], 1];
}

/** Stands at `at`, turned by the quaternion x, y, z, w; not turned where it has no length. */
export function rigid(at, q) {
  const size = Math.hypot(...q);
  const [x, y, z, w] = size > 0 ? Array.from(q, part => part / size) : [0, 0, 0, 1];
  return fromAxes([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], at);
}

/** The eight corners of the box from `low` to `high` that stands at `pose`. */
export function boxCorners(low, high, pose = identity()) {
  const corners = [];
  for (let i = 0; i < 8; ++i) {
    corners.push(transform(pose, [i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1],
      i & 4 ? high[2] : low[2]]));
  }
  return corners;
}
