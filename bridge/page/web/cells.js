// SPDX-License-Identifier: Apache-2.0

const kEdge = 8;  // voxel edges of a cell, which spans voxels 8i - 1 to 8i + 7 with both ends

/** Which cells may hold a density of `threshold` or more, as visualizer/cast/macrocells. */
export class Macrocells {
  constructor(volume, threshold) {
    this.volume = volume;
    this.threshold = threshold;
    this.grid = volume.size.map(n => Math.floor(n / kEdge) + 1);
    this.active = new Uint8Array(this.grid[0] * this.grid[1] * this.grid[2]);
  }

  index(x, y, z) {
    return (z * this.grid[1] + y) * this.grid[0] + x;
  }

  /** Takes up changed bricks: each touches its own cell and the next one on each axis. True where
   * a cell became active or inactive. */
  update(bricks) {
    const touched = new Set();
    const [gx, gy, gz] = this.grid;
    for (const id of bricks) {
      const [bx, by, bz] = this.volume.brick(id).low.map(n => n / kEdge);
      for (let z = bz; z < Math.min(bz + 2, gz); ++z) {
        for (let y = by; y < Math.min(by + 2, gy); ++y) {
          for (let x = bx; x < Math.min(bx + 2, gx); ++x) touched.add(this.index(x, y, z));
        }
      }
    }
    let flipped = false;
    for (const cell of touched) {
      const now = this.reaches(cell % gx, Math.floor(cell / gx) % gy, Math.floor(cell / gx / gy));
      flipped ||= now !== this.active[cell];
      this.active[cell] = now;
    }
    return flipped;
  }

  reaches(i, j, k) {
    const {size: [nx, ny, nz], density} = this.volume;
    const first = n => Math.max(n * kEdge - 1, 0), end = (n, most) => Math.min(n * kEdge + kEdge, most);
    for (let z = first(k); z < end(k, nz); ++z) {
      for (let y = first(j); y < end(j, ny); ++y) {
        const row = (z * ny + y) * nx, last = row + end(i, nx);
        for (let at = row + first(i); at < last; ++at) {
          if (density[at] >= this.threshold) return 1;
        }
      }
    }
    return 0;
  }

  /** x, y, z, 2 * axis + (1 on the high side) of each face between an active cell and none. */
  faces() {
    const faces = [];
    const [gx, gy, gz] = this.grid;
    const isActive = (x, y, z) => x >= 0 && y >= 0 && z >= 0 && x < gx && y < gy && z < gz &&
      this.active[this.index(x, y, z)] !== 0;
    for (let z = 0; z < gz; ++z) {
      for (let y = 0; y < gy; ++y) {
        for (let x = 0; x < gx; ++x) {
          if (!isActive(x, y, z)) continue;
          if (!isActive(x - 1, y, z)) faces.push(x, y, z, 0);
          if (!isActive(x + 1, y, z)) faces.push(x, y, z, 1);
          if (!isActive(x, y - 1, z)) faces.push(x, y, z, 2);
          if (!isActive(x, y + 1, z)) faces.push(x, y, z, 3);
          if (!isActive(x, y, z - 1)) faces.push(x, y, z, 4);
          if (!isActive(x, y, z + 1)) faces.push(x, y, z, 5);
        }
      }
    }
    return new Uint16Array(faces);
  }
}
