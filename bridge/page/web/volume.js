// SPDX-License-Identifier: Apache-2.0
// A volume as the page holds it, in bricks, and which of its cells rays may pass over.

const kBrick = 8, kBrickVoxels = 512;

/** One volume as it is held: densities and labels, x fastest, and which bricks are new. */
export class Volume {
  constructor(descriptor) {
    const {nx, ny, nz} = descriptor;
    this.descriptor = descriptor;
    this.size = [nx, ny, nz];
    this.grid = this.size.map(n => Math.ceil(n / kBrick));
    this.bricks = this.grid[0] * this.grid[1] * this.grid[2];
    if (this.bricks !== descriptor.brick_count || descriptor.log2_brick !== 3 ||
        descriptor.bits_per_voxel !== 16) {
      throw new Error('hello: a volume of another version; load the page again');
    }
    this.density = new Uint16Array(nx * ny * nz);
    this.labels = descriptor.off_labels !== 0n ? new Uint8Array(nx * ny * nz) : null;
    this.came = new Uint8Array(this.bricks);
    this.first = new Map();    // brick -> its densities when they came, of bricks that changed since
    this.changed = new Set();  // bricks of `first` whose removed material is not counted yet
    this.removed = new Map();  // brick -> what was, by material
    this.listeners = new Set();  // sets of bricks to be taken up
  }

  brick(id) {
    const [gx, gy] = this.grid;
    const at = [id % gx, Math.floor(id / gx) % gy, Math.floor(id / gx / gy)];
    const low = at.map(i => i * kBrick);
    return {low, high: low.map((i, axis) => Math.min(i + kBrick, this.size[axis]))};
  }
  brickId(x, y, z) {
    return (z * this.grid[1] + y) * this.grid[0] + x;
  }

  /** Calls `row(from, to, count)` for each row of a brick: places in the brick and in the volume. */
  rows(id, row) {
    const {low, high} = this.brick(id);
    for (let z = low[2]; z < high[2]; ++z) {
      for (let y = low[1]; y < high[1]; ++y) {
        row(((z - low[2]) * kBrick + y - low[1]) * kBrick,
          (z * this.size[1] + y) * this.size[0] + low[0], high[0] - low[0]);
      }
    }
  }

  putDensity(id, block) {
    if (this.came[id]) {
      if (this.holds(id, block)) return;  // it came once more
      if (!this.first.has(id)) this.first.set(id, this.copyOf(id));
    }
    this.rows(id, (from, to, count) => {
      for (let i = 0; i < count; ++i) {
        this.density[to + i] = block[2 * (from + i)] | block[2 * (from + i) + 1] << 8;
      }
    });
    if (this.came[id]) this.changed.add(id);
    this.came[id] = 1;
    for (const listener of this.listeners) listener.add(id);
  }

  putLabels(id, block) {
    let differs = 0;
    this.rows(id, (from, to, count) => {
      for (let i = 0; i < count; ++i) {
        differs |= this.labels[to + i] ^ block[from + i];
        this.labels[to + i] = block[from + i];
      }
    });
    if (differs === 0) return;
    for (const listener of this.listeners) listener.add(id);
  }

  holds(id, block) {
    let differs = 0;
    this.rows(id, (from, at, count) => {
      for (let i = 0; i < count; ++i) {
        differs |= this.density[at + i] ^ (block[2 * (from + i)] | block[2 * (from + i) + 1] << 8);
      }
    });
    return differs === 0;
  }

  copyOf(id) {
    const copy = new Uint16Array(kBrickVoxels);
    this.rows(id, (to, from, count) => copy.set(this.density.subarray(from, from + count), to));
    return copy;
  }

  /** A set that gets the bricks which come from now on, and all that are there. */
  follow() {
    const all = new Set(Array(this.bricks).keys());
    this.listeners.add(all);
    return all;
  }
  forget(listener) {
    this.listeners.delete(listener);
  }

  /** Voxels of solid that are gone since each brick came, by material; `materialOf(label, density)`. As `solid_gone` in
      shared/volume/material.hpp: a voxel was solid from the density `solidFrom(label)`, and has lost 1 - now / first. */
  removedVoxels(materialOf, materials, solidFrom) {
    for (const id of this.changed) {
      const gone = new Float64Array(materials), first = this.first.get(id);
      this.rows(id, (from, at, count) => {
        for (let i = 0; i < count; ++i) {
          const was = first[from + i], lost = was - this.density[at + i];
          // A reset gives back what was gone before this page came.
          if (lost < 0) first[from + i] = this.density[at + i];
          const label = this.labels ? this.labels[at + i] : 0;
          if (lost > 0 && was >= solidFrom(label)) gone[materialOf(label, was)] += lost / was;
        }
      });
      this.removed.set(id, gone);
    }
    if (this.changed.size > 0 || !this.sums) {
      this.sums = new Float64Array(materials);
      for (const gone of this.removed.values()) gone.forEach((voxels, m) => this.sums[m] += voxels);
    }
    this.changed.clear();
    return this.sums;
  }
}

const kCellEdge = 8;  // voxel edges of a cell, which spans voxels 8i - 1 to 8i + 7 with both ends

/** Which cells may hold a density of `threshold` or more, as visualizer/cast/macrocells. */
export class Macrocells {
  constructor(volume, threshold) {
    this.volume = volume;
    this.threshold = threshold;
    this.grid = volume.size.map(n => Math.floor(n / kCellEdge) + 1);
    this.active = new Uint8Array(this.grid[0] * this.grid[1] * this.grid[2]);
  }

  index(x, y, z) {
    return (z * this.grid[1] + y) * this.grid[0] + x;
  }

  /** The cells that touch these bricks: each its own and the next one on each axis. */
  touched(bricks) {
    const touched = new Set();
    const [gx, gy, gz] = this.grid;
    for (const id of bricks) {
      const [bx, by, bz] = this.volume.brick(id).low.map(n => n / kCellEdge);
      for (let z = bz; z < Math.min(bz + 2, gz); ++z) {
        for (let y = by; y < Math.min(by + 2, gy); ++y) {
          for (let x = bx; x < Math.min(bx + 2, gx); ++x) touched.add(this.index(x, y, z));
        }
      }
    }
    return touched;
  }

  at(cell) {
    const [gx, gy] = this.grid;
    return [cell % gx, Math.floor(cell / gx) % gy, Math.floor(cell / gx / gy)];
  }

  /** Computes the `touched` cells again. True where a cell became active or inactive. */
  update(touched) {
    let flipped = false;
    for (const cell of touched) {
      const now = this.reaches(...this.at(cell));
      flipped ||= now !== this.active[cell];
      this.active[cell] = now;
    }
    return flipped;
  }

  reaches(i, j, k) {
    const {size: [nx, ny, nz], density} = this.volume;
    const first = n => Math.max(n * kCellEdge - 1, 0), end = (n, most) => Math.min(n * kCellEdge + kCellEdge, most);
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

const kFineEdge = 2;  // voxel edges of a fine cell, which spans voxels 2i - 1 to 2i + 1

/** Of cells of two voxel edges, a bit x + 2y + 4z for each octant that may hold a density of the threshold
 * of `cells`, which are larger: as visualizer/cast/macrocells. */
export class FineCells {
  constructor(volume, cells) {
    this.volume = volume;
    this.cells = cells;
    this.grid = volume.size.map(n => Math.floor(n / kFineEdge) + 1);
    this.octants = new Uint8Array(this.grid[0] * this.grid[1] * this.grid[2]);
  }

  /** Computes those within the `touched` larger cells again. Returns the box around them, or null. */
  update(touched) {
    const box = {low: [...this.grid], high: [0, 0, 0]};
    const per = kCellEdge / kFineEdge;
    for (const cell of touched) {
      const low = this.cells.at(cell).map(n => n * per);
      const high = low.map((n, axis) => Math.min(n + per, this.grid[axis]));
      this.fill(low, high, this.cells.active[cell] !== 0);
      box.low = box.low.map((n, axis) => Math.min(n, low[axis]));
      box.high = box.high.map((n, axis) => Math.max(n, high[axis]));
    }
    return touched.size > 0 ? box : null;
  }

  fill(low, high, active) {
    const [gx, gy] = this.grid;
    for (let z = low[2]; z < high[2]; ++z) {
      for (let y = low[1]; y < high[1]; ++y) {
        const row = (z * gy + y) * gx;
        for (let x = low[0]; x < high[0]; ++x) this.octants[row + x] = active ? this.octantsOf(x, y, z) : 0;
      }
    }
  }

  octantsOf(i, j, k) {
    const {size: [nx, ny, nz], density} = this.volume, {threshold} = this.cells;
    const first = n => Math.max(2 * n - 1, 0), end = (n, most) => Math.min(2 * n + 2, most);
    let octants = 0;
    for (let z = first(k); z < end(k, nz); ++z) {
      for (let y = first(j); y < end(j, ny); ++y) {
        const row = (z * ny + y) * nx;
        for (let x = first(i); x < end(i, nx); ++x) {
          if (density[row + x] < threshold) continue;
          // A voxel in the middle belongs to the octants on both sides of it.
          octants |= kSides[x - 2 * i + 1] & kSides[y - 2 * j + 4] & kSides[z - 2 * k + 7];
        }
      }
    }
    return octants;
  }
}

// The octants that a voxel on the low side, in the middle, on the high side of each axis belongs to.
const kSides = [0x55, 0xff, 0xaa, 0x33, 0xff, 0xcc, 0x0f, 0xff, 0xf0];
