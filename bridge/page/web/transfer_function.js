// SPDX-License-Identifier: Apache-2.0
// What voxels look like: palette, transfer function and texels of visualizer/scene/appearance and
// visualizer/render/volume_textures.
import {kBorderEdges, kEmptyShare, kHalfBand, kHardestOpacity, kHighestAir, kIvory, kLeastOpacity, kMaterialReach,
  kOpacityMm, kPaletteWidth, kSoftestOpacity, kWholeSoftest} from './constants.js';
import {clamp, mix} from './math.js';

const kFull = 65535;
const smoothstep = (low, high, x) => {
  const t = clamp((x - low) / (high - low), 0, 1);
  return t * t * (3 - 2 * t);
};

/** In equal ratios from the softest to the hardest; among equals the first is the softer. */
export function defaultOpacity(materials, index) {
  if (materials.length < 3) return kSoftestOpacity;
  const {iso} = materials[index];
  const softer = materials.filter((one, m) =>
    m > 0 && (one.iso < iso || (one.iso === iso && m < index))).length;
  return kSoftestOpacity * (kHardestOpacity / kSoftestOpacity) ** (softer / (materials.length - 2));
}

/** Two rows of `kPaletteWidth` linear colours with opacity: by density, and by label. */
export function palette(materials) {
  const looks = materials.map((one, label) =>
    ({iso: one.iso, label, colour: [...one.colour, one.opacity ?? defaultOpacity(materials, label)]})).slice(1)
    .sort((a, b) => a.iso - b.iso);
  const rows = new Float32Array(8 * kPaletteWidth);
  for (let i = 0; i < kPaletteWidth; ++i) {
    let colour = looks[0]?.colour ?? kIvory;
    for (const look of looks.slice(1)) {
      const share = smoothstep(look.iso - kHalfBand, look.iso + kHalfBand, i / (kPaletteWidth - 1));
      colour = colour.map((value, k) => mix(value, look.colour[k], share));
    }
    rows.set(colour, 4 * i);
    rows.set(kIvory, 4 * (kPaletteWidth + i));
  }
  for (const {label, colour} of looks) {
    if (label < kPaletteWidth) rows.set(colour, 4 * (kPaletteWidth + label));
  }
  if (materials.length > 0) rows.set([...materials[0].colour, 0], 4 * kPaletteWidth);
  return rows;
}

/** The median of the densities below `iso`, rounded down to 8 bits. */
function airLevel(density, iso) {
  const step = Math.floor(density.length / (1 << 20)) | 1;
  const counts = new Uint32Array(256);
  let below = 0;
  for (let i = 0; i < density.length; i += step) {
    if (density[i] >= iso) continue;
    ++counts[density[i] >> 8];
    ++below;
  }
  let median = 0;
  for (let passed = counts[0]; 2 * passed < below; passed += counts[median]) ++median;
  return median << 8;
}

/** As `make_transfer_function`: densities (0..1) from which something is seen and from which all of it, how much of the
 * material that shows outside of a surface, and the lowest density seen. */
export function transferFunction(view, materials) {
  const {labels, density} = view.volume;
  const softest = Math.min(...materials.slice(1).map(one => one.iso));
  const air = labels ? 0 : airLevel(density, view.iso);
  let full = labels && materials.length > 1 ? kWholeSoftest * softest : view.iso / kFull;
  full = clamp(full, 2 / 255, 1);
  const emptyOfAll = Math.min(air / kFull, kHighestAir * full);
  const longest = Math.max(...view.edges);
  const ramp = (1 - kEmptyShare) / (labels ? 1 : Math.max(longest / kOpacityMm, 1));
  const empty = full - Math.max(ramp * (full - emptyOfAll), 1 / kFull);
  return {empty, full, borderMm: kBorderEdges * ramp * longest,
    lowestSeen: Math.max(1, Math.floor(Math.max(0, empty - 0.5 / 255) * kFull))};
}

export const leastExtinction = -Math.log2(1 - kLeastOpacity) / kOpacityMm;  // per mm

/** Of a part of a gradient, a step over two edges being 1. */
export const gradientByte = part => Math.trunc(part * 127 + 128.5);
const densityByte = density => Math.floor((density * 255 + 32767) / kFull);

/**
 * Gradient (128 + 127 g) and density in 8 bits for each voxel of a box, from the corners of the
 * cube around it, with air outside. With `skipAir` null where all of it has no density at all.
 */
export function gradientTexels(volume, low, high, skipAir) {
  const {size: [nx, ny, nz], density} = volume;
  const wide = high[0] - low[0] + 2, tall = high[1] - low[1] + 2, deep = high[2] - low[2] + 2;
  const field = new Uint16Array(wide * tall * deep);
  let any = 0;
  for (let z = Math.max(low[2] - 1, 0); z < Math.min(high[2] + 1, nz); ++z) {
    for (let y = Math.max(low[1] - 1, 0); y < Math.min(high[1] + 1, ny); ++y) {
      const to = ((z - low[2] + 1) * tall + y - low[1] + 1) * wide - low[0] + 1;
      const from = (z * ny + y) * nx;
      for (let x = Math.max(low[0] - 1, 0); x < Math.min(high[0] + 1, nx); ++x) {
        any |= field[to + x] = density[from + x];
      }
    }
  }
  if (skipAir && any === 0) return null;
  const texels = new Uint8Array(4 * (wide - 2) * (tall - 2) * (deep - 2));
  const byte = sum => gradientByte(sum / (4 * kFull));
  const up = wide, far = wide * tall;
  let out = 0;
  for (let z = 1; z < deep - 1; ++z) {
    for (let y = 1; y < tall - 1; ++y) {
      for (let x = 1, at = (z * tall + y) * wide + 1; x < wide - 1; ++x, ++at) {
        const a = at - up - far, b = at + up - far, c = at - up + far, d = at + up + far;
        const a0 = field[a - 1], a1 = field[a + 1], b0 = field[b - 1], b1 = field[b + 1];
        const c0 = field[c - 1], c1 = field[c + 1], d0 = field[d - 1], d1 = field[d + 1];
        texels[out++] = byte(a1 - a0 + b1 - b0 + c1 - c0 + d1 - d0);
        texels[out++] = byte(b0 + b1 - a0 - a1 + d0 + d1 - c0 - c1);
        texels[out++] = byte(c0 + c1 - a0 - a1 + d0 + d1 - b0 - b1);
        texels[out++] = densityByte(field[at]);
      }
    }
  }
  return texels;
}

const unitByte = value => Math.round(clamp(value, 0, 1) * 255);

/**
 * Colour and opacity of each voxel by its label. One without takes the mean of the labelled voxels
 * around, the nearer the heavier; where there are none, the material of its density.
 */
export class MaterialTexels {
  constructor(volume, rows) {
    this.volume = volume;
    const bytes = Uint8Array.from(rows, unitByte);
    this.byDensity = bytes.subarray(0, 4 * kPaletteWidth);
    this.byLabel = bytes.subarray(4 * kPaletteWidth);
    this.looks = rows.subarray(4 * kPaletteWidth);
    this.around = [];  // {x, y, z, step through the labels, weight}
    const [nx, ny] = volume.size, reach = kMaterialReach;
    for (let z = -reach; z <= reach; ++z) {
      for (let y = -reach; y <= reach; ++y) {
        for (let x = -reach; x <= reach; ++x) {
          const far = x * x + y * y + z * z;
          if (far > 0) this.around.push({x, y, z, step: (z * ny + y) * nx + x, weight: 1 / far});
        }
      }
    }
    this.steps = Int32Array.from(this.around, one => one.step);
  }

  /** Of a box; in blocks of 8^3, since most have no label anywhere near. */
  of(low, high) {
    const texels = new Uint8Array(4 * (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]));
    for (let z = low[2]; z < high[2]; z += 8) {
      for (let y = low[1]; y < high[1]; y += 8) {
        for (let x = low[0]; x < high[0]; x += 8) {
          const from = [x, y, z];
          this.fill(texels, low, high, from, from.map((n, axis) => Math.min(n + 8, high[axis])));
        }
      }
    }
    return texels;
  }

  /** The part `from` .. `to` of the box `low` .. `high`. */
  fill(texels, low, high, from, to) {
    const {size: [nx, ny], density, labels} = this.volume;
    const near = this.anyLabel(from, to);
    for (let z = from[2]; z < to[2]; ++z) {
      for (let y = from[1]; y < to[1]; ++y) {
        let out = 4 * (((z - low[2]) * (high[1] - low[1]) + y - low[1]) * (high[0] - low[0]) + from[0] - low[0]);
        for (let x = from[0], at = (z * ny + y) * nx + x; x < to[0]; ++x, ++at, out += 4) {
          if (labels[at] !== 0) {
            this.take(texels, out, this.byLabel, labels[at]);
          } else if (!near || !this.meanAround(texels, out, x, y, z, at)) {
            this.take(texels, out, this.byDensity, densityByte(density[at]));
          }
        }
      }
    }
  }

  take(texels, out, row, index) {
    for (let k = 0; k < 4; ++k) texels[out + k] = row[4 * index + k];
  }

  anyLabel(from, to) {
    const {size: [nx, ny, nz], labels} = this.volume;
    const reach = kMaterialReach;
    const last = [nx, ny, nz].map((n, axis) => Math.min(to[axis] + reach, n));
    for (let z = Math.max(from[2] - reach, 0); z < last[2]; ++z) {
      for (let y = Math.max(from[1] - reach, 0); y < last[1]; ++y) {
        const row = (z * ny + y) * nx;
        for (let x = Math.max(from[0] - reach, 0); x < last[0]; ++x) if (labels[row + x] !== 0) return true;
      }
    }
    return false;
  }

  meanAround(texels, out, x, y, z, at) {
    const {size: [nx, ny, nz], labels} = this.volume;
    const {steps, around, looks} = this;
    const reach = kMaterialReach;
    const inside = x >= reach && y >= reach && z >= reach && x < nx - reach && y < ny - reach && z < nz - reach;
    let r = 0, g = 0, b = 0, opacity = 0, weights = 0;
    for (let i = 0; i < steps.length; ++i) {
      if (!inside) {
        const one = around[i];
        const [px, py, pz] = [x + one.x, y + one.y, z + one.z];
        if (px < 0 || py < 0 || pz < 0 || px >= nx || py >= ny || pz >= nz) continue;
      }
      const label = labels[at + steps[i]];
      if (label === 0) continue;
      const {weight} = around[i];
      r += weight * looks[4 * label];
      g += weight * looks[4 * label + 1];
      b += weight * looks[4 * label + 2];
      opacity += weight * looks[4 * label + 3];
      weights += weight;
    }
    if (weights === 0) return false;
    texels[out] = unitByte(r / weights);
    texels[out + 1] = unitByte(g / weights);
    texels[out + 2] = unitByte(b / weights);
    texels[out + 3] = unitByte(opacity / weights);
    return true;
  }
}
