// SPDX-License-Identifier: Apache-2.0
// Gradients of voxels, as `adaptive` of visualizer/scene/gradient: a narrow filter, and the direction of a wide one
// where this hardly differs. Voxels with unequal edges are gathered into cells that are nearly cubes, and these filtered
// by mm. The shader takes for a point what lies between the centres of cells (followed.frag).
import {kAdaptedAgree, kAdaptedDiffer, kCubic, kFaridSlope, kFaridSmooth, kMiddle, kMostInCell, kNarrowPerLongest,
  kSurfaceSlope, kWidePerLongest, kWidePerShortest, kWideSlope, kWideSmooth} from './constants.js';
import {clamp} from './math.js';

const kFull = 65535;
const axes = [0, 1, 2];
const countOf = size => size.reduce((count, n) => count * n);
const extentOf = (low, high) => high.map((n, axis) => n - low[axis]);
const cellsIn = ({low, high}) => countOf(extentOf(low, high));
const largest = values => values.reduce((a, b) => Math.max(a, b));

/** Taps along one axis, from `reach` cells before the middle to `reach` after it, and their sums: a slope's is that of a
 * ramp of one step per cell. A smoothing is even, a slope odd. */
function tapsOf(smooth, slope) {
  const reach = smooth.length >> 1, sum = (all, value) => all.reduce((total, one, i) => total + value(one, i - reach), 0);
  return {reach, smooth: Float32Array.from(smooth), slope: Float32Array.from(slope),
    smoothSum: sum(smooth, one => one), slopeSum: sum(slope, (one, i) => i * one)};
}

/** The quadratic spline of a spread in cells, and its derivative. */
function spline(spread) {
  const apart = 2 * spread;
  const reach = clamp(Math.ceil(1.5 * apart) - 1, 1, kMiddle);
  const smooth = [], slope = [];
  for (let i = -reach; i <= reach; ++i) {
    const at = Math.abs(i / apart), rest = Math.max(1.5 - at, 0);
    const down = at < 0.5 ? 2 * at : rest;
    smooth.push(Math.fround(at < 0.5 ? 0.75 - at * at : 0.5 * rest * rest));
    slope.push(Math.fround(i < 0 ? -down : down));
  }
  return tapsOf(smooth, slope);
}

/** Standard deviation of the smoothing whose derivative the slope is. */
const spreadOf = ({reach, slope, slopeSum}) =>
  Math.sqrt(slope.reduce((third, one, i) => third + (i - reach) ** 3 * one, 0) / (3 * slopeSum));

/** As `GradientPlan::surface_mm`, of voxels with these edges. */
export function surfaceMm(edges) {
  const {cubes, narrow} = cellPlan(edges), longest = largest(edges);
  const s = Math.hypot(cubes ? spreadOf(narrow[0]) : kNarrowPerLongest, 0.5), steepest = 2 / (Math.sqrt(2 * Math.PI) * s);
  return s * Math.sqrt(2 * Math.log(Math.max(steepest / kSurfaceSlope, 1))) * longest;
}

/** As `GradientPlan` of C++, of the edges of a voxel: {cubes, cell, perEdge, narrow, wide, reachCells, reach}. */
export function cellPlan(edges) {
  const longest = largest(edges), shortest = Math.min(...edges);
  const cubes = longest < kCubic * shortest;
  const cell = edges.map(edge => cubes ? 1 : Math.trunc(Math.min(longest / edge + 0.01, kMostInCell)));
  const wideMm = Math.max(kWidePerShortest * shortest, kWidePerLongest * longest);
  const cellMm = edges.map((edge, axis) => cell[axis] * edge);
  const narrow = cellMm.map(mm => cubes ? tapsOf(kFaridSmooth, kFaridSlope) : spline(kNarrowPerLongest * longest / mm));
  const wide = cellMm.map(mm => cubes ? tapsOf(kWideSmooth, kWideSlope) : spline(wideMm / mm));
  const reachCells = axes.map(axis => Math.max(narrow[axis].reach, wide[axis].reach));
  return {cubes, cell, perEdge: edges.map(edge => cubes ? 1 : edge / longest), narrow, wide, reachCells,
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

const scratch = [];
const kGradients = 7;  // slot

/** Numbers of a box, x fastest, of any value, until the next one in this slot: a block needs megabytes of them. */
function fieldOf(size, slot) {
  const count = countOf(size);
  if (!(scratch[slot]?.length >= count)) scratch[slot] = new Float32Array(count);
  return {size, values: scratch[slot].subarray(0, count)};
}

/** Of each row along x of a box, the part that is wanted: from `first` to before `end`. */
class Rows {
  constructor(size, first = size[0], end = 0) {
    const rows = size[1] * size[2];
    Object.assign(this, {size, first: new Int16Array(rows).fill(first), end: new Int16Array(rows).fill(end)});
  }
  take(row, first, end) {
    this.first[row] = Math.min(this.first[row], first);
    this.end[row] = Math.max(this.end[row], end);
  }
  /** What taps along y (axis 1) or z read for them, of a box that is larger by their reach at both ends. */
  readAlong(axis, reach) {
    const size = this.size.slice();
    size[axis] += 2 * reach;
    const made = new Rows(size), step = axis === 1 ? 1 : size[1];
    for (let z = 0, row = 0; z < this.size[2]; ++z) {
      for (let y = 0; y < this.size[1]; ++y, ++row) {
        const first = this.first[row], end = this.end[row];
        for (let i = 0, to = z * size[1] + y; first < end && i <= 2 * reach; ++i, to += step) made.take(to, first, end);
      }
    }
    return made;
  }
}

/** What is wanted of taps along one axis, which becomes shorter by their reach at both ends. `sign` is 1 if they are even
 * and -1 if they are odd: a slope is 0 where all voxels are alike. */
function filtered(from, axis, taps, reach, sign, rows, slot) {
  const to = fieldOf(rows.size, slot), half = taps.slice(reach);
  const [nx, ny] = from.size, {values: input} = from, {values: output} = to;
  const stride = [1, nx, nx * ny][axis];
  for (let z = 0, row = 0, out = 0; z < rows.size[2]; ++z) {
    for (let y = 0; y < rows.size[1]; ++y, ++row, out += rows.size[0]) {
      const begin = (z * ny + y) * nx + reach * stride, end = rows.end[row];
      for (let x = rows.first[row]; x < end; ++x) {
        const at = begin + x;
        let sum = half[0] * input[at];
        for (let i = 1, far = stride; i <= reach; ++i, far += stride) {
          sum += half[i] * (input[at + far] + sign * input[at - far]);
        }
        output[out + x] = sum;
      }
    }
  }
  return to;
}

/** Divides by what a step from air to full density over two edges gives, of the longest edge. */
const scaleOf = (slope, smooth, other, perCell) =>
  1 / (0.5 * slope.slopeSum * smooth.smoothSum * other.smoothSum * kFull * perCell);

/** The gradient's parts of the wanted cells within `field`, which reaches as far beyond them as the taps do. */
function partsOf([x, y, z], field, perCell, rows) {
  const forZ = rows.readAlong(2, z.reach), forY = forZ.readAlong(1, y.reach);
  const smooth = (slot, from, axis, {smooth: taps, reach}, wanted) => filtered(from, axis, taps, reach, 1, wanted, slot);
  const slope = (slot, from, axis, {slope: taps, reach}, wanted) => filtered(from, axis, taps, reach, -1, wanted, slot);
  const smoothX = smooth(1, field, 0, x, forY), slopeX = slope(2, field, 0, x, forY);
  const part = (found, a, b, c, axis) => ({values: found.values, scale: scaleOf(a, b, c, perCell[axis])});
  return [part(smooth(4, smooth(3, slopeX, 1, y, forZ), 2, z, rows), x, y, z, 0),
    part(smooth(5, slope(3, smoothX, 1, y, forZ), 2, z, rows), y, z, x, 1),
    part(slope(6, smooth(3, smoothX, 1, y, forZ), 2, z, rows), z, x, y, 2)];
}

/** The gradients of the wanted cells that are marked, if `marks` is there, and the rows of those that are not 0. They lie
 * in memory that the next block takes. */
function gathered(parts, rows, marks) {
  const [{values: xs, scale: sx}, {values: ys, scale: sy}, {values: zs, scale: sz}] = parts;
  const {values: gradients} = fieldOf([4, ...rows.size], kGradients), sloped = new Rows(rows.size);
  gradients.fill(0);
  for (let row = 0; row < rows.first.length; ++row) {
    for (let x = rows.first[row]; x < rows.end[row]; ++x) {
      const i = row * rows.size[0] + x;
      if (marks && (marks[row] >>> x & 1) === 0) continue;
      const gx = sx * xs[i], gy = sy * ys[i], gz = sz * zs[i];
      if (gx === 0 && gy === 0 && gz === 0) continue;
      gradients[4 * i] = gx;
      gradients[4 * i + 1] = gy;
      gradients[4 * i + 2] = gz;
      sloped.take(row, x, x + 1);
    }
  }
  return {gradients, sloped};
}

/** In place, the narrow gradients of these rows with the direction of the wide ones where this hardly differs. */
function adapt(gradients, wide, rows) {
  const [{values: xs, scale: sx}, {values: ys, scale: sy}, {values: zs, scale: sz}] = wide;
  for (let row = 0; row < rows.first.length; ++row) {
    for (let x = rows.first[row]; x < rows.end[row]; ++x) {
      const i = row * rows.size[0] + x, at = 4 * i;
      const ax = gradients[at], ay = gradients[at + 1], az = gradients[at + 2];
      const bx = sx * xs[i], by = sy * ys[i], bz = sz * zs[i];
      const a = ax * ax + ay * ay + az * az, b = bx * bx + by * by + bz * bz;
      if (!(a > 0 && b > 0)) continue;
      const cosine = (ax * bx + ay * by + az * bz) / Math.sqrt(a * b);
      const part = clamp((cosine - kAdaptedDiffer) / (kAdaptedAgree - kAdaptedDiffer), 0, 1);
      if (part === 0) continue;
      const own = 1 - part, other = part * Math.sqrt(a / b);
      const mx = own * ax + other * bx, my = own * ay + other * by, mz = own * az + other * bz;
      const back = Math.sqrt(a / (mx * mx + my * my + mz * mz));
      gradients[at] = back * mx;
      gradients[at + 1] = back * my;
      gradients[at + 2] = back * mz;
    }
  }
}

/** Which voxels of a block a point of the surface lies between, a word for each row and a bit for each voxel; null: none.
 * A point lies between eight voxels, of which some have the iso density and some have not: so those with another one around
 * them that differs. A row of a block, with a voxel at both ends, is a word. */
export function surfaceVoxels({size: [nx, ny, nz], density}, iso, low, high) {
  const [wide, tall, deep] = extentOf(low, high);
  const solid = new Int32Array((tall + 2) * (deep + 2));  // outside of the volume there is air
  for (let z = Math.max(low[2] - 1, 0); z < Math.min(high[2] + 1, nz); ++z) {
    for (let y = Math.max(low[1] - 1, 0); y < Math.min(high[1] + 1, ny); ++y) {
      const from = (z * ny + y) * nx;
      let row = 0;
      for (let x = Math.max(low[0] - 1, 0); x < Math.min(high[0] + 1, nx); ++x) {
        if (density[from + x] >= iso) row |= 1 << x - low[0] + 1;
      }
      solid[(z - low[2] + 1) * (tall + 2) + y - low[1] + 1] = row;
    }
  }
  const marks = new Int32Array(tall * deep), inside = -1 >>> 32 - wide;
  let found = 0;
  for (let z = 0, row = 0; z < deep; ++z) {
    for (let y = 0; y < tall; ++y, ++row) {
      let some = 0, all = -1;
      for (let k = z; k < z + 3; ++k) {
        for (let at = k * (tall + 2) + y, j = 0; j < 3; ++j, ++at) {
          some |= solid[at];
          all &= solid[at];
        }
      }
      found |= marks[row] = (some | some >>> 1 | some >>> 2) & ~(all & all >>> 1 & all >>> 2) & inside;
    }
  }
  return found ? marks : null;
}

/** From the first marked voxel of each row to the last one. */
function markedRows(size, marks) {
  const rows = new Rows(size);
  marks.forEach((word, row) => word && rows.take(row, 31 - Math.clz32(word & -word), 32 - Math.clz32(word)));
  return rows;
}

function isFlat(values) {
  let i = 0;
  while (i < values.length && values[i] === values[0]) ++i;
  return i === values.length;
}

// Cells of an edge: most of a volume is air, or solid, and has no gradient. With one more at both ends, bits of a word.
const kBlock = 30;

/** The cells of a volume: their mean densities, and gradients out of these. A border of cells one wide is
 * around it, since a voxel on the edge lies between the first cell and it. */
export class CellGradients {
  constructor(volume, plan) {
    Object.assign(this, {volume, plan});
    this.grid = volume.size.map((n, axis) => Math.ceil(n / plan.cell[axis]));
    this.areVoxels = countOf(plan.cell) === 1;
    this.means = this.areVoxels ? volume.density : new Float32Array(countOf(this.grid));
    this.perCell = axes.map(axis => plan.perEdge[axis] * plan.cell[axis]);
  }

  /** Takes up the changed voxels of a box. Returns the box of cells whose gradients may have changed, the border's too. */
  update({low, high}) {
    const {cell, reachCells} = this.plan;
    const from = low.map((n, axis) => Math.floor(n / cell[axis]));
    const to = high.map((n, axis) => Math.ceil(n / cell[axis]));
    if (!this.areVoxels) this.gather(from, to);
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
    const field = fieldOf(extentOf(low, high), 0);
    field.values.fill(0);
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

  /** Calls `put(low, high, gradients)` for each block of a box: four numbers a cell, the last is nothing, until `put`
   * returns; null: none has one. `marksOf(low, high)`: of which cells, as `surfaceVoxels`. Without it, of all. */
  blocks({low, high}, put, marksOf = null) {
    for (let z = low[2]; z < high[2]; z += kBlock) {
      for (let y = low[1]; y < high[1]; y += kBlock) {
        for (let x = low[0]; x < high[0]; x += kBlock) {
          const from = [x, y, z], to = from.map((n, axis) => Math.min(n + kBlock, high[axis]));
          const marks = marksOf?.(from, to);
          put(from, to, marks === null ? null : this.gradients(from, to, marks));
        }
      }
    }
  }

  /** Of the marked cells, else of all. The wide filter costs five times as much as the narrow one, and is taken where that
   * finds anything. */
  gradients(low, high, marks) {
    const {plan, perCell} = this, size = extentOf(low, high);
    const around = taps => this.field(low.map((n, axis) => n - taps[axis].reach),
      high.map((n, axis) => n + taps[axis].reach));
    const field = around(plan.narrow);
    if (isFlat(field.values)) return null;
    const wanted = marks ? markedRows(size, marks) : new Rows(size, 0, size[0]);
    const {gradients, sloped} = gathered(partsOf(plan.narrow, field, perCell, wanted), wanted, marks);
    adapt(gradients, partsOf(plan.wide, around(plan.wide), perCell, sloped), sloped);
    return gradients;
  }
}
