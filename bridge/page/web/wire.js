// SPDX-License-Identifier: Apache-2.0
// The messages of bridge/wire/messages.hpp, field by field in their order, and the records of the
// segment by the program's own layout table.
import {kAckMagic, kCommandMagic, kFrameMagic, kHelloMagic, kMaxRawBytes, kPacked, kProtocol,
  kRecordsMagic, kReplyMagic, kViewMagic, records} from './constants.js';

/**
 * Decodes one LZ4 block into all of `out`. Throws where the block is not one of exactly that
 * length; reads and writes nothing outside, whatever the bytes.
 */
export function unpack(block, out) {
  let from = 0, to = 0;
  const refuse = () => {
    throw new Error('LZ4 block: damaged');
  };
  const longer = length => {
    for (let more = 255; more === 255; length += more) {
      if (from >= block.length) refuse();
      more = block[from++];
    }
    return length;
  };
  while (from < block.length) {
    const token = block[from++];
    const literals = token >> 4 === 15 ? longer(15) : token >> 4;
    if (literals > block.length - from || literals > out.length - to) refuse();
    out.set(block.subarray(from, from + literals), to);
    from += literals;
    to += literals;
    if (from === block.length) break;  // the last sequence has literals only
    if (block.length - from < 2) refuse();
    const back = block[from] | block[from + 1] << 8;
    from += 2;
    const length = ((token & 15) === 15 ? longer(15) : token & 15) + 4;
    if (back === 0 || back > to || length > out.length - to) refuse();
    for (const end = to + length; to < end; ++to) out[to] = out[to - back];  // it may overlap itself
  }
  if (to !== out.length) refuse();
}

const kBytes = {u8: 1, char: 1, u16: 2, i16: 2, u32: 4, i32: 4, f32: 4, u64: 8, i64: 8, f64: 8};
const kGetters = {u8: 'getUint8', char: 'getUint8', u16: 'getUint16', i16: 'getInt16',
  u32: 'getUint32', i32: 'getInt32', f32: 'getFloat32', u64: 'getBigUint64', i64: 'getBigInt64',
  f64: 'getFloat64'};

/** Reads one value after the other; beyond the end it throws. */
class Cursor {
  constructor(buffer, at = 0) {
    this.view = new DataView(buffer);
    this.at = at;
  }
  next(type) {
    const value = this.view[kGetters[type]](this.at, true);
    this.at += kBytes[type];
    return value;
  }
  all(fields) {
    const values = {};
    for (const [name, type] of fields) values[name] = this.next(type);
    return values;
  }
  bytes(count) {
    if (count > this.view.byteLength - this.at) throw new Error('message: cut short');
    this.at += count;
    return new Uint8Array(this.view.buffer, this.at - count, count);
  }
}

/** A record of the segment: numbers by name, arrays where a field has several. `wanted`: which. */
export function recordAt(name, view, at, wanted = null) {
  const values = {};
  for (const [field, offset, type, count] of records[name].fields) {
    if (wanted && !wanted.has(field)) continue;
    const get = i => view[kGetters[type]](at + offset + i * kBytes[type], true);
    values[field] = count === 1 ? get(0) : Array.from({length: count}, (_, i) => get(i));
  }
  return values;
}

const kHello = [['protocol', 'u32'], ['session', 'u64'], ['configHash', 'u64'], ['abiHash', 'u64'],
  ['layoutMajor', 'u32'], ['layoutMinor', 'u32'], ['tickNs', 'u32'], ['flags', 'u32'],
  ['serverNs', 'i64'], ['startNs', 'u64'], ['volumeCount', 'u32'], ['recordBytes', 'u32'],
  ['dirtyBytes', 'u32'], ['sceneBytes', 'u32']];
const kFrame = [['flags', 'u32'], ['session', 'u64'], ['frame', 'u64'], ['tick', 'u64'],
  ['takenNs', 'i64'], ['heartbeatNs', 'i64'], ['setHash', 'u64'], ['lifecycle', 'u32'],
  ['blocks', 'u32'], ['rawBytes', 'u32'], ['payloadBytes', 'u32'], ['sentNs', 'i64']];
const kRecords = [['flags', 'u32'], ['session', 'u64'], ['ring', 'u32'], ['count', 'u32'],
  ['first', 'u64'], ['stride', 'u32'], ['rawBytes', 'u32'], ['payloadBytes', 'u32'],
  ['reserved', 'u32']];
const kDirtyRing = 1, kPairsRing = 2;
const kReply = [['sequence', 'u32'], ['status', 'u32'], ['index', 'u32']];

function payload(cursor, head) {
  if (head.rawBytes > kMaxRawBytes) throw new Error('message: too long');
  const bytes = cursor.bytes(head.payloadBytes);
  if (!(head.flags & kPacked)) {
    if (bytes.length !== head.rawBytes) throw new Error('message: of no length');
    return bytes;
  }
  const raw = new Uint8Array(head.rawBytes);
  unpack(bytes, raw);
  return raw;
}

const kReaders = {
  [kHelloMagic](cursor) {
    const hello = {kind: 'hello', ...cursor.all(kHello)};
    if (hello.protocol !== kProtocol || hello.recordBytes !== records.TickRecord.bytes ||
        hello.dirtyBytes !== records.DirtyRecord.bytes) {
      throw new Error('hello: of another version; load the page again');
    }
    const text = new TextDecoder().decode(cursor.bytes(64));
    hello.buildId = text.slice(0, (text + '\0').indexOf('\0'));
    hello.volumes = [];
    for (let v = 0; v < hello.volumeCount; ++v) {
      const at = cursor.at;
      cursor.bytes(records.VolumeDescriptor.bytes);
      hello.volumes.push(recordAt('VolumeDescriptor', cursor.view, at));
    }
    return hello;
  },
  [kFrameMagic](cursor) {
    const frame = {kind: 'frame', ...cursor.all(kFrame)};
    if (frame.blocks > kMaxRawBytes / 512) throw new Error('frame: too many blocks');
    frame.versions = Array.from({length: frame.blocks}, () => cursor.next('u64'));
    frame.ids = Array.from({length: frame.blocks}, () => cursor.next('u32'));
    frame.payload = payload(cursor, frame);
    return frame;
  },
  [kRecordsMagic](cursor) {
    const message = {kind: 'records', ...cursor.all(kRecords)};
    message.record = message.ring === kDirtyRing ? 'DirtyRecord' : 'TickRecord';
    message.arms = message.ring === kPairsRing ? 2 : 1;  // records of a tick, the first arm's first
    const raw = payload(cursor, message);
    message.view = new DataView(raw.buffer, raw.byteOffset, raw.byteLength);
    if (message.count * message.arms * records[message.record].bytes !== raw.length) {
      throw new Error('records: of no length');
    }
    return message;
  },
  [kReplyMagic]: cursor => ({kind: 'reply', ...cursor.all(kReply)}),
  [kViewMagic](cursor) {
    const presenter = cursor.next('u32'), three = () => [0, 1, 2].map(() => cursor.next('f64'));
    return {kind: 'view', presenter, eye: three(), target: three(), up: three()};
  },
};

/** What a message says, by `kind`; throws for what is none of version 1. */
export function read(buffer) {
  const cursor = new Cursor(buffer);
  const reader = kReaders[cursor.next('u32')];
  if (!reader) throw new Error('message: unknown');
  return reader(cursor);
}

function message(bytes, fields) {
  const view = new DataView(new ArrayBuffer(bytes));
  let at = 0;
  for (const value of fields) {
    if (typeof value === 'bigint') view.setBigUint64(at, value, true);
    else view.setUint32(at, value, true);
    at += typeof value === 'bigint' ? 8 : 4;
  }
  return view.buffer;
}
export const ack = (session, frame) => message(24, [kAckMagic, 0, session, frame]);
/** Of an arm: 0 the first, 1 the second. */
export const command = (kind, argument, sequence, arm = 0) =>
  message(16, [kCommandMagic, kind + 0x10000 * arm, argument, sequence]);
/** Of who presents it; null: presents no longer. */
export function presentedView(view) {
  const data = new DataView(message(80, [kViewMagic, view ? 1 : 0]));
  [...view?.eye ?? [0, 0, 1], ...view?.target ?? [0, 0, 0], ...view?.up ?? [0, 1, 0]].forEach((value, i) =>
    data.setFloat64(8 + 8 * i, value, true));
  return data.buffer;
}
