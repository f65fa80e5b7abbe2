// SPDX-License-Identifier: Apache-2.0
// The cells that let rays pass over what is empty, against every voxel.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {FineCells, Macrocells} from './volume.js';

const size = [19, 8, 21], bricksAcross = size.map(n => Math.ceil(n / 8)), threshold = 30000;
const density = new Uint16Array(size[0] * size[1] * size[2]);
const volume = {size, density, brick: id => ({low: [id % bricksAcross[0], Math.floor(id / bricksAcross[0]) % bricksAcross[1],
  Math.floor(id / bricksAcross[0] / bricksAcross[1])].map(n => 8 * n)})};

/** Whether a voxel from `low` to `high`, both included, reaches the threshold. */
function reaches(low, high) {
  for (let z = Math.max(low[2], 0); z <= Math.min(high[2], size[2] - 1); ++z) {
    for (let y = Math.max(low[1], 0); y <= Math.min(high[1], size[1] - 1); ++y) {
      for (let x = Math.max(low[0], 0); x <= Math.min(high[0], size[0] - 1); ++x) {
        if (density[(z * size[1] + y) * size[0] + x] >= threshold) return true;
      }
    }
  }
  return false;
}

test('a bit of a fine cell is set where a corner of its cell of eight voxels reaches the threshold', () => {
  const cells = new Macrocells(volume, threshold), fine = new FineCells(volume, cells);
  let random = 1;
  const next = n => (random = random * 48271 % 2147483647) % n;
  for (let round = 0; round < 12; ++round) {
    for (let i = 0; i < 6; ++i) {
      density[next(density.length)] = round < 8 ? [threshold, 65535, threshold - 1][i % 3] : 0;
    }
    const touched = cells.touched(Array.from({length: bricksAcross[0] * bricksAcross[1] * bricksAcross[2]}, (_, id) => id));
    cells.update(touched);
    assert.deepEqual(fine.update(touched), {low: [0, 0, 0], high: fine.grid});
    fine.octants.forEach((octants, i) => {
      const at = [i % fine.grid[0], Math.floor(i / fine.grid[0]) % fine.grid[1], Math.floor(i / fine.grid[0] / fine.grid[1])];
      for (let bit = 0; bit < 8; ++bit) {
        const low = at.map((n, axis) => 2 * n - 1 + (bit >> axis & 1));
        assert.equal((octants >> bit & 1) === 1, reaches(low, low.map(n => n + 1)), `cell ${at}, octant ${bit}`);
      }
    });
  }
});

test('a changed brick is followed in the cells that it touches, and in no others', () => {
  const cells = new Macrocells(volume, threshold), fine = new FineCells(volume, cells);
  density.fill(65535);
  const touched = cells.touched([0]);
  cells.update(touched);
  assert.deepEqual(fine.update(touched), {low: [0, 0, 0], high: [8, 5, 8]});
  assert.equal(fine.octants[0], 0xff);
  assert.equal(fine.octants[8], 0);
  assert.equal(fine.update(new Set()), null);
});
