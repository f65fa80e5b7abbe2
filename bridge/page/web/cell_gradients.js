// SPDX-License-Identifier: Apache-2.0
// Gradients of voxels with unequal edges, as `adaptive` of visualizer/scene/gradient: the voxels are
// gathered into cells that are nearly cubes, and these filtered by mm. The shader takes for a point
// what lies between the centres of cells (followed.frag).
import {kAdaptedAgree, kAdaptedDiffer, kCubic, kMiddle, kMostInCell, kNarrowPerLongest, kSurfaceSlope,
  kWidePerLongest, kWidePerShortest} from './constants.js';
import {clamp} from './math.js';

const kFull = 65535;
const axes = [0, 1, 2];
const countOf = ([x, y, z]) => x * y * z;
const extentOf = (low, high) => high.map((n, axis) => n - low[axis]);
const cellsIn = ({low, high}) => countOf(extentOf(low, high));
const largest = values => values.reduce((a, b) => Math.max(a, b));

/** The quadratic spline of a spread in cells, and its derivative: {reach, smooth, slope, smoothSum, slopeSum}. */
function spline(spread) {
  const apart = 2 * spread;
  const reach = clamp(Math.ceil(1.5 * apart) - 1, 1, kMiddle);
  const taps = {reach, smooth: new Float32Array(2 * reach + 1), slope: new Float32Array(2 * reach + 1),
    smoothSum: 0, slopeSum: 0};
  for (let i = -reach; i <= reach; ++i) {
    const at = Math.abs(i / apart), rest = Math.max(1.5 - at, 0);
    const down = at < 0.5 ? 2 * at : rest;
    taps.smooth[reach + i] = at < 0.5 ? 0.75 - at * at : 0.5 * rest * rest;
    taps.slope[reach + i] = i < 0 ? -down : down;
    taps.smoothSum += taps.smooth[reach + i];
    taps.slopeSum += i * taps.slope[reach + i];
  }
  return taps;
}

/** As `GradientPlan::surface_mm`, of voxels with these edges. */
export function surfaceMm(edges) {
  const longest = largest(edges), shortest = Math.min(...edges);
  // The difference over two edges, by which cubes are shaded, is a mean of slopes that spread by the root of 1/3.
  const spread = longest < kCubic * shortest ? Math.sqrt(1 / 3) : kNarrowPerLongest;
  const s = Math.hypot(spread, 0.5), steepest = 2 / (Math.sqrt(2 * Math.PI) * s);
  return s * Math.sqrt(2 * Math.log(Math.max(steepest / kSurfaceSlope, 1))) * longest;
}

/** As `GradientPlan` of C++, of the edges of a voxel: {cell, perEdge, narrow, wide, reachCells, reach}. Null for cubes:
 * their gradient is that of the shader alone. */
export function cellPlan(edges) {
  const longest = largest(edges), shortest = Math.min(...edges);
  if (longest < kCubic * shortest) return null;
  const cell = edges.map(edge => Math.trunc(Math.min(longest / edge + 0.01, kMostInCell)));
  const wideMm = Math.max(kWidePerShortest * shortest, kWidePerLongest * longest);
  const cellMm = edges.map((edge, axis) => cell[axis] * edge);
  const narrow = cellMm.map(mm => spline(kNarrowPerLongest * longest / mm));
  const wide = cellMm.map(mm => spline(wideMm / mm));
  const reachCells = axes.map(axis => Math.max(narrow[axis].reach, wide[axis].reach));
  return {cell, perEdge: edges.map(edge => edge / longest), narrow, wide, reachCells,
    // Of voxels: one lies between the centres of two cells.
    reach: axes.map(axis => cell[axis] === 1 ? reachCells[axis] :
      cell[axis] * (reachCells[axis] + 1) + (cell[axis] >> 1))};
}

/** Boxes, one after the other, of which neighbours became one if that has no more cells. */
export function joined(boxes) {
  const made = [];
  for (const box of boxes) {
    const last = made.at(-1) ?? box;
    const both = {low: last.low.map((n, axis) => Math.min(n, box.low[axis])),
      high: last.high.map((n, axis) => Math.max(n, box.high[axis]))};
    const fits = cellsIn(both) <= cellsIn(last) + cellsIn(box);
    made.splice(fits ? -1 : made.length, 1, fits ? both : box);
  }
  return made;
}

/** Numbers of a box, x fastest. */
const fieldOf = size => ({size, values: new Float32Array(countOf(size))});

/** Taps along one axis, which becomes shorter by their reach at both ends. */
function filtered(from, axis, taps, reach) {
  const size = from.size.slice();
  size[axis] -= 2 * reach;
  const to = fieldOf(size);
  const [nx, ny] = from.size, {values: input} = from, {values: output} = to;
  const stride = [1, nx, nx * ny][axis];
  let out = 0;
  for (let z = 0; z < size[2]; ++z) {
    for (let y = 0; y < size[1]; ++y) {
      const row = (z * ny + y) * nx + reach * stride;
      for (let at = row, end = row + size[0]; at < end; ++at) {
        let sum = taps[reach] * input[at];
        // In pairs, so that a slope is 0 where all voxels are alike.
        for (let i = 1, far = stride; i <= reach; ++i, far += stride) {
          sum += taps[reach + i] * input[at + far] + taps[reach - i] * input[at - far];
        }
        output[out++] = sum;
      }
    }
  }
  return to;
}

/** Divides by what a step from air to full density over two edges gives, of the longest edge. */
const scaleOf = (slope, smooth, other, perCell) =>
  1 / (0.5 * slope.slopeSum * smooth.smoothSum * other.smoothSum * kFull * perCell);

/** The gradient's parts of the cells within `field`, which reaches as far beyond them as the taps do. */
function partsOf([x, y, z], field, perCell) {
  const smoothX = filtered(field, 0, x.smooth, x.reach), slopeX = filtered(field, 0, x.slope, x.reach);
  const along = (from, last, a, b, c, axis) => ({values: filtered(from, 2, last, z.reach).values,
    scale: scaleOf(a, b, c, perCell[axis])});
  return [along(filtered(slopeX, 1, y.smooth, y.reach), z.smooth, x, y, z, 0),
    along(filtered(smoothX, 1, y.slope, y.reach), z.smooth, y, z, x, 1),
    along(filtered(smoothX, 1, y.smooth, y.reach), z.slope, z, x, y, 2)];
}

/** In place, `narrow` with the direction of `wide` where this hardly differs. */
function adapt(gradients, wide) {
  for (let i = 0, at = 0; at < gradients.length; ++i, at += 4) {
    const [ax, ay, az] = [gradients[at], gradients[at + 1], gradients[at + 2]];
    const [bx, by, bz] = wide.map(({values, scale}) => scale * values[i]);
    const a = ax * ax + ay * ay + az * az, b = bx * bx + by * by + bz * bz;
    if (!(a > 0 && b > 0)) continue;
    const cosine = (ax * bx + ay * by + az * bz) / Math.sqrt(a * b);
    const part = clamp((cosine - kAdaptedDiffer) / (kAdaptedAgree - kAdaptedDiffer), 0, 1);
    if (part === 0) continue;
    const own = 1 - part, other = part * Math.sqrt(a / b);
    const mixed = [own * ax + other * bx, own * ay + other * by, own * az + other * bz];
    const back = Math.sqrt(a) / Math.hypot(...mixed);
    for (const axis of axes) gradients[at + axis] = back * mixed[axis];
  }
}

const kBlock = 32;  // cells of an edge: most of a volume is air, or solid, and has no gradient

/** The cells of a volume: their mean densities, and gradients out of these. A border of cells one wide is
 * around it, since a voxel on the edge lies between the first cell and it. */
export class CellGradients {
  constructor(volume, plan) {
    Object.assign(this, {volume, plan});
    this.grid = volume.size.map((n, axis) => Math.ceil(n / plan.cell[axis]));
    this.means = new Float32Array(countOf(this.grid));
    this.perCell = axes.map(axis => plan.perEdge[axis] * plan.cell[axis]);
  }

  /** Takes up the changed voxels of a box. Returns the box of cells whose gradients may have changed, the border's too. */
  update({low, high}) {
    const {cell, reachCells} = this.plan;
    const from = low.map((n, axis) => Math.floor(n / cell[axis]));
    const to = high.map((n, axis) => Math.ceil(n / cell[axis]));
    this.gather(from, to);
    return {low: from.map((n, axis) => Math.max(n - reachCells[axis], -1)),
      high: to.map((n, axis) => Math.min(n + reachCells[axis], this.grid[axis] + 1))};
  }

  gather(low, high) {
    const {volume: {size: [nx, ny, nz], density}, grid: [gx, gy], means, plan: {cell: [cx, cy, cz]}} = this;
    const share = 1 / (cx * cy * cz);
    for (let z = low[2] * cz; z < Math.min(high[2] * cz, nz); ++z) {
      for (let y = low[1] * cy; y < Math.min(high[1] * cy, ny); ++y) {
        const from = (z * ny + y) * nx, to = (Math.floor(z / cz) * gy + Math.floor(y / cy)) * gx;
        const isFirst = z % cz === 0 && y % cy === 0;
        for (let i = low[0]; i < high[0]; ++i) {
          let sum = 0;
          for (let x = i * cx; x < Math.min((i + 1) * cx, nx); ++x) sum += density[from + x];
          means[to + i] = (isFirst ? 0 : means[to + i]) + sum * share;
        }
      }
    }
  }

  /** The mean densities of a box, zeros outside of the volume. */
  field(low, high) {
    const field = fieldOf(extentOf(low, high));
    const [nx, ny] = field.size, {grid, means} = this;
    const x0 = Math.max(low[0], 0), x1 = Math.min(high[0], grid[0]);
    for (let z = Math.max(low[2], 0); z < Math.min(high[2], grid[2]); ++z) {
      for (let y = Math.max(low[1], 0); y < Math.min(high[1], grid[1]); ++y) {
        const row = (z * grid[1] + y) * grid[0];
        field.values.set(means.subarray(row + x0, row + x1), ((z - low[2]) * ny + y - low[1]) * nx + x0 - low[0]);
      }
    }
    return field;
  }

  /** Calls `put(low, high, gradients)` for each block of a box: four numbers a cell, the last is nothing; null: none has one. */
  blocks({low, high}, put) {
    for (let z = low[2]; z < high[2]; z += kBlock) {
      for (let y = low[1]; y < high[1]; y += kBlock) {
        for (let x = low[0]; x < high[0]; x += kBlock) {
          const from = [x, y, z], to = from.map((n, axis) => Math.min(n + kBlock, high[axis]));
          put(from, to, this.gradients(from, to));
        }
      }
    }
  }

  gradients(low, high) {
    const {plan, perCell} = this;
    const around = taps => this.field(low.map((n, axis) => n - taps[axis].reach),
      high.map((n, axis) => n + taps[axis].reach));
    const field = around(plan.narrow);
    if (field.values.every(value => value === field.values[0])) return null;
    const narrow = partsOf(plan.narrow, field, perCell);
    const gradients = new Float32Array(4 * narrow[0].values.length);
    for (const axis of axes) {
      const {values, scale} = narrow[axis];
      for (let i = 0; i < values.length; ++i) gradients[4 * i + axis] = scale * values[i];
    }
    adapt(gradients, partsOf(plan.wide, around(plan.wide), perCell));
    return gradients;
  }
}
