// SPDX-License-Identifier: Apache-2.0
// Gradients of voxels as the page computes them, beside those of C++ (tests/visualizer/view/page_gradient_test.cpp).
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import {CellGradients, cellPlan, joined, surfaceVoxels} from './cell_gradients.js';
import {Volume} from './volume.js';

const stored = JSON.parse(fs.readFileSync('cell_gradients.json', 'utf8'));

function volumeOf(size, densityAt) {
  const grid = size.map(n => Math.ceil(n / 8));
  const volume = new Volume({nx: size[0], ny: size[1], nz: size[2], brick_count: grid[0] * grid[1] * grid[2], log2_brick: 3,
    bits_per_voxel: 16, off_labels: 0n});
  let at = 0;
  for (let z = 0; z < size[2]; ++z) {
    for (let y = 0; y < size[1]; ++y) {
      for (let x = 0; x < size[0]; ++x) volume.density[at++] = densityAt(x, y, z);
    }
  }
  return volume;
}
const wholeOf = ({size}) => ({low: [0, 0, 0], high: size});

/** Gradients of all cells, the border's too: by place. */
function gradientsOf(cells, boxes, made = new Map(), marksOf = null) {
  for (const box of boxes) {
    cells.blocks(box, (low, high, gradients) => {
      let at = 0;
      for (let z = low[2]; z < high[2]; ++z) {
        for (let y = low[1]; y < high[1]; ++y) {
          for (let x = low[0]; x < high[0]; ++x, at += 4) made.set(`${x},${y},${z}`, gradients ? [...gradients.subarray(at, at + 3)] : [0, 0, 0]);
        }
      }
    }, marksOf);
  }
  return made;
}

const isNear = (found, wanted, what) => {
  assert.equal(found.length, wanted.length, what);
  found.forEach((one, i) => assert.ok(Math.abs(one - wanted[i]) <= 2e-5 * Math.max(1, Math.abs(wanted[i])), `${what}: ${one}, not ${wanted[i]}`));
};

test('filters are those of C++, whichever axis is the long one', () => {
  for (const {edges, cell, numbers} of stored.plans) {
    for (const turn of [0, 1, 2]) {
      const turned = [0, 1, 2].map(axis => edges[(axis + turn) % 3]);
      const plan = cellPlan(turned.map(edge => 0.07 * edge));
      assert.deepEqual([0, 1, 2].map(axis => plan.cell[(axis + 3 - turn) % 3]), cell);
      const found = [plan.narrow, plan.wide].flatMap(taps => [0, 1, 2].map(axis => taps[(axis + 3 - turn) % 3]))
        .flatMap(({reach, smooth, slope}) => [reach, ...smooth.slice(reach), ...slope.slice(reach)]);
      isNear(found, numbers, String(turned));
    }
  }
});

test('edges that were rounded are those of cubes', () => {
  assert.deepEqual(cellPlan([0.1, 0.1004, 0.1]), cellPlan([0.1, 0.1, 0.1]));
  assert.equal(cellPlan([0.1, 0.1004, 0.1]).cubes, true);
  assert.equal(cellPlan([0.1, 0.102, 0.1]).cubes, false);
});

test('gradients are those of C++', () => {
  const volume = volumeOf([15, 12, 9], (x, y, z) => Math.max(0, 60000 - 90 * (3 * (x - 7) ** 2 + 4 * (y - 6) ** 2 + 20 * (z - 4) ** 2) +
    37 * ((7 * x + 11 * y + 13 * z) % 29)));
  for (const {edges, cell, numbers} of stored.gradients) {
    const cells = new CellGradients(volume, cellPlan(edges));
    const made = gradientsOf(cells, [cells.update(wholeOf(volume))]);
    // Cells whose middle voxel lies in the volume.
    const counts = volume.size.map((n, axis) => Math.ceil((n - (cell[axis] >> 1)) / cell[axis]));
    const found = [];
    for (let z = 0, count = 0; z < counts[2]; ++z) {
      for (let y = 0; y < counts[1]; ++y) {
        for (let x = 0; x < counts[0]; ++x) if (count++ % 17 === 0) found.push(...made.get(`${x},${y},${z}`));
      }
    }
    isNear(found, numbers, String(edges));
  }
});

test('after cuts they are those of the whole volume made anew, and none beyond the reach differs', () => {
  let seed = 7;
  const random = n => (seed = seed * 1103515245 + 12345 & 0x7fffffff) % n;
  for (const edges of [[1, 1, 1], [1, 1, 1.5], [1, 1, 2], [5, 1, 1], [1, 2, 8], [1, 1, 100]]) {
    const plan = cellPlan(edges);
    const volume = volumeOf([40, 33, 21], (x, y, z) => Math.hypot(x - 20, y - 16, z - 10) < 9 ? 65535 : random(900));
    const cells = new CellGradients(volume, plan);
    let made = gradientsOf(cells, [cells.update(wholeOf(volume))]);
    for (let cut = 0; cut < 4; ++cut) {
      const low = volume.size.map(n => 8 * random(Math.ceil(n / 8)));
      const high = low.map((n, axis) => Math.min(n + 8, volume.size[axis]));
      for (let i = 0; i < 60; ++i) {
        const [x, y, z] = low.map((n, axis) => n + random(high[axis] - n));
        volume.density[(z * 33 + y) * 40 + x] = random(65536);
      }
      const before = made;
      const box = cells.update({low, high});
      made = gradientsOf(cells, [box], new Map(made));
      const other = new CellGradients(volume, plan);
      assert.deepEqual(made, gradientsOf(other, [other.update(wholeOf(volume))]), String(edges));
      for (const [place, gradient] of made) {
        const at = place.split(',').map(Number);
        // A voxel beside a cell lies at most a cell and a half from its middle.
        const far = at.some((n, axis) => (n + 1.5) * plan.cell[axis] < low[axis] - plan.reach[axis] ||
          (n - 0.5) * plan.cell[axis] > high[axis] + plan.reach[axis]);
        if (far) assert.deepEqual(gradient, before.get(place));
      }
    }
  }
});

test('voxels that a point of the surface lies between have the gradient that they have among all, the others none', () => {
  const size = [40, 37, 35], iso = 30000;
  const volume = volumeOf(size, (x, y, z) => Math.hypot(x - 34, y - 16, z - 10) < 12 && x !== 30 ? 65535 : 9 * ((7 * x + 11 * y + 13 * z) % 29));
  const solid = at => at.every((n, axis) => n >= 0 && n < size[axis]) && volume.density[(at[2] * size[1] + at[1]) * size[0] + at[0]] >= iso;
  const cells = new CellGradients(volume, cellPlan([1, 1, 1])), box = cells.update(wholeOf(volume));
  const all = gradientsOf(cells, [box]);
  const marked = gradientsOf(cells, [box], new Map(), (low, high) => surfaceVoxels(volume, iso, low, high));
  let count = 0;
  for (const [place, gradient] of marked) {
    const at = place.split(',').map(Number);
    const around = Array.from({length: 27}, (_, i) => solid(at.map((n, axis) => n + Math.floor(i / 3 ** axis) % 3 - 1)));
    const lies = around.includes(true) && around.includes(false);
    assert.deepEqual(gradient, lies ? all.get(place) : [0, 0, 0], place);
    count += lies ? 1 : 0;
  }
  assert.ok(count > 2000 && count < 0.2 * marked.size, `${count} of ${marked.size}`);
});

test('layers one upon the other are filtered as one box, cuts far from each other as two', () => {
  const layer = (z, x = 0) => ({low: [x, 0, z - 7], high: [x + 30, 30, z + 15]});
  assert.deepEqual(joined([layer(0), layer(8), layer(16)]), [{low: [0, 0, -7], high: [30, 30, 31]}]);
  assert.deepEqual(joined([layer(0), layer(0, 200)]), [layer(0), layer(0, 200)]);
  assert.deepEqual(joined([]), []);
});
