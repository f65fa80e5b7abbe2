// SPDX-License-Identifier: Apache-2.0
// The bridge's end of the talk, by hand as bridge/wire/messages.hpp and shared/segment/layout_table.hpp have it: a run of one
// volume of 16 x 8 x 8 voxels of 0.5 mm, which are two bricks, and two tools.

export const kSession = 77n;
export const kSceneText = JSON.stringify({volumes: [{name: 'tooth', solid: true}], device: {workspace_scale: 1},
  materials: [{name: 'air', iso: 0, colour: [0, 0, 0]}, {name: 'enamel', iso: 0.75, colour: [1, 1, 1]},
    {name: 'dentine', iso: 0.5, colour: [1, 1, 0]}],
  tools: [{name: 'ball 1 mm', profile: [[-0.5, 0], [0, 0.5], [0.5, 0]]}, {name: 'fissure', profile: [[-1, 0], [0, 0.6], [1, 0]]}]});

/** A message of so many bytes, filled by [type, offset, values...]; type `text` for letters. */
export function message(size, fields) {
  const view = new DataView(new ArrayBuffer(size));
  const put = {u8: [1, 'setUint8'], u16: [2, 'setUint16'], u32: [4, 'setUint32'], u64: [8, 'setBigUint64'], f32: [4, 'setFloat32'],
    f64: [8, 'setFloat64'], text: [1, 'setUint8']};
  for (const [type, at, ...values] of fields) {
    const [bytes, set] = put[type], all = type === 'text' ? [...values[0]].map(c => c.charCodeAt(0)) : values;
    all.forEach((value, i) => view[set](at + i * bytes, type === 'u64' ? BigInt(value) : value, true));
  }
  return view.buffer;
}

/** `mayCommand` and `twoArms`: bits 1 and 2. */
export const hello = (flags, atNs, session = kSession) => message(144 + 128, [['text', 0, 'KBH1'], ['u32', 4, 1], ['u64', 8, session],
  ['u32', 40, 1_000_000, flags], ['u64', 48, atNs, 1n], ['u32', 64, 1, 496, 64, kSceneText.length], ['text', 80, 'test'],
  // The volume: size, brick of 2^3, 16 bits, bricks, spacing, origin, iso of one half, not turned, no labels.
  ['u16', 144, 16, 8, 8], ['u8', 150, 3, 16], ['u32', 152, 2, 1, 1, 2], ['f64', 168, 0.5, 0.5, 0.5, 0.25, 0.25, 0.25],
  ['u32', 244, 32768], ['f32', 248, 0, 0, 0, 1]]);

const u64 = x => BigInt.asUintN(64, x);
/** Of one block in the sum over all that is held. */
function mixed(id, version, session) {
  let z = u64((version ^ session) * 0x9e3779b97f4a7c15n + BigInt(id) * 0xd1342543de82ef95n + 1n);
  z = u64((z ^ z >> 30n) * 0xbf58476d1ce4e5b9n);
  z = u64((z ^ z >> 27n) * 0x94d049bb133111ebn);
  return z ^ z >> 31n;
}

/** A bridge that remembers what it has sent of one run. */
export class Bridge {
  frames = 0;
  versions = new Map();
  constructor(session = kSession) { this.session = session; }

  /** `blocks`: [id, bytes of 1024]; `ageMs`: of the servo's last sign of life. */
  frame(blocks, {tick, atNs, ageMs = 0, lifecycle = 1, ended = false}) {
    for (const [id] of blocks) this.versions.set(id, BigInt(2 * tick + 2));
    const hash = u64([...this.versions].reduce((sum, [id, version]) => sum + mixed(id, version, this.session), 0n));
    const raw = 1024 * blocks.length, head = 80 + 12 * blocks.length;
    const buffer = message(head + raw, [['text', 0, 'KBF1'], ['u32', 4, 2 | (ended ? 4 : 0)], ['u64', 8, this.session, ++this.frames, tick, atNs,
      atNs - BigInt(ageMs * 1e6), hash], ['u32', 56, lifecycle, blocks.length, raw, raw], ['u64', 72, atNs],
      ...blocks.map(([id], i) => ['u64', 80 + 8 * i, this.versions.get(id)]),
      ...blocks.map(([id], i) => ['u32', 80 + 8 * blocks.length + 4 * i, id])]);
    blocks.forEach(([, bytes], i) => new Uint8Array(buffer).set(bytes, head + 1024 * i));
    return buffer;
  }
}

/** A block of 512 densities, all one. */
export const densities = value => new Uint8Array(new Uint16Array(512).fill(value).buffer);
export function sceneBlock() {
  const block = new Uint8Array(1024);
  block.set(new TextEncoder().encode(kSceneText));
  return block;
}

/** Records of ticks: of each tick one, or of two arms a pair. */
export function records(ticks, session = kSession) {
  const arms = ticks[0].length, bytes = 496 * arms * ticks.length;
  return message(48 + bytes, [['text', 0, 'KBS1'], ['u64', 8, session], ['u32', 16, arms === 2 ? 2 : 0, ticks.length], ['u64', 24, 1n],
    ['u32', 32, 1, bytes, bytes, 0], ...ticks.flat().flatMap((record, i) => {
      const at = 48 + 496 * i, {tick, startNs, flags = 0, place = [0, 0, 0], force = [0, 0, 0], proxy = [0, 0, 0], phase = 4, tool = 0, fault = 0, depth = 0} = record;
      return [['u64', at + 8, tick, startNs], ['u32', at + 32, flags], ['f64', at + 64, ...place], ['f32', at + 88, 0, 0, 0, 1],
        ['f32', at + 116, ...force], ['f32', at + 152, ...proxy], ['u16', at + 170, phase], ['u32', at + 380, tool, fault], ['f32', at + 392, depth]];
    })]);
}
export const reply = (sequence, status) => message(16, [['text', 0, 'KBR1'], ['u32', 4, sequence, status, 0]]);
