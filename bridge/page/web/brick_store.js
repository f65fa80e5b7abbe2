// SPDX-License-Identifier: Apache-2.0
// What this page holds of a run: scene text and volumes, block by block with their versions. What is
// shown changes from one pass to the next one, never to a part of it.
import {kLastOfPass} from './constants.js';
import {Volume} from './volume.js';

const u64 = x => BigInt.asUintN(64, x);

/** As bridge/wire/messages.hpp. */
export function mixed(id, version) {
  let z = u64(version * 0x9e3779b97f4a7c15n + BigInt(id) * 0xd1342543de82ef95n + 1n);
  z = u64((z ^ z >> 30n) * 0xbf58476d1ce4e5b9n);
  z = u64((z ^ z >> 27n) * 0x94d049bb133111ebn);
  return z ^ z >> 31n;
}

const kTextBytes = 1024, kDensityBytes = 1024, kLabelBytes = 512;

export class Held {
  /** Nothing yet of the run that a hello tells of. Volumes of `before` stay shown until theirs come. */
  constructor(hello, before = null) {
    this.hello = hello;
    const same = before?.hello.session === hello.session ? before : null;
    this.text = new Uint8Array(Math.ceil(hello.sceneBytes / kTextBytes) * kTextBytes);
    this.volumes = same?.volumes ?? hello.volumes.map(described => new Volume(described));
    this.planes = [];
    this.count = 0;
    const plane = (bytes, count, take) => {
      this.planes.push({bytes, first: this.count, take});
      this.count += count;
    };
    plane(kTextBytes, this.text.length / kTextBytes, (i, block) => this.text.set(block, i * kTextBytes));
    for (const volume of this.volumes) {
      plane(kDensityBytes, volume.bricks, (i, block) => volume.putDensity(i, block));
    }
    for (const volume of this.volumes) {
      if (volume.labels) plane(kLabelBytes, volume.bricks, (i, block) => volume.putLabels(i, block));
    }
    this.versions = new BigUint64Array(this.count);
    this.missing = this.count;
    this.sum = 0n;
    this.late = same?.late ?? false;  // something was cut away before it came here
    this.passes = 0;
    this.shown = same?.shown ?? false;  // the volumes were whole once, so a picture may have them
    this.waiting = [];                  // of a pass that has not ended: calls that apply a block
  }

  /** Takes a frame; what it changes is applied with the last one of its pass. Throws where it is none
   * of this run, or what is held is not what it says. */
  apply(frame) {
    const {session} = this.hello;
    if (frame.session !== session) throw new Error('frame: of another run');
    let at = 0;
    for (let i = 0; i < frame.blocks; ++i) {
      const id = frame.ids[i], version = frame.versions[i];
      if (id >= this.count || version === 0n) throw new Error('frame: names no block');
      const plane = this.planes.findLast(one => one.first <= id);
      if (frame.payload.length - at < plane.bytes) throw new Error('frame: cut short');
      const block = frame.payload.subarray(at, at + plane.bytes);
      // A run's first pass fills what nobody shows yet.
      if (this.shown) this.waiting.push(() => plane.take(id - plane.first, block));
      else plane.take(id - plane.first, block);
      if (this.waiting.length > this.count) throw new Error('frame: the pass never ends');
      at += plane.bytes;
      const old = this.versions[id];
      if (version <= old) throw new Error('frame: a block is not newer than before');
      if (old) this.sum -= mixed(id, old ^ session);
      else --this.missing;
      if (!old && this.passes === 0 && version > 2n) this.late = true;
      this.sum = u64(this.sum + mixed(id, version ^ session));
      this.versions[id] = version;
    }
    if (at !== frame.payload.length) throw new Error('frame: too long');
    if (this.sum !== frame.setHash) throw new Error('frame: what is held here is not what was sent');
    if (!(frame.flags & kLastOfPass)) return;
    if (!this.complete) throw new Error('frame: the pass ends with blocks missing');
    for (const apply of this.waiting) apply();
    this.waiting = [];
    this.shown = true;
    ++this.passes;
  }

  get complete() {
    return this.missing === 0;
  }
  get sceneJson() {
    return JSON.parse(new TextDecoder().decode(this.text.subarray(0, this.hello.sceneBytes)));
  }
}
