// SPDX-License-Identifier: Apache-2.0
// A recording as one file: the MCAP of `kerf-record export`, whose messages are the rows of its log, and whose attachments
// are its other files (record/export/mcap_export.hpp). Read by its index, chunk by chunk, so a long one takes no memory. Layouts:
// https://mcap.dev/spec, https://github.com/lz4/lz4/blob/dev/doc.

const kMagic = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const kRecord = 9;  // opcode and length
const Opcode = {footer: 0x02, channel: 0x04, chunk: 0x06, messageIndex: 0x07, chunkIndex: 0x08, attachment: 0x09,
  attachmentIndex: 0x0a};
const kTopics = {'/kerf/tick': 'ticks.npy', '/kerf/2/tick': 'ticks-2.npy'};
const kMessageHead = 31, kCdrHead = 4;  // before the bytes of a row
const kHeaderBytes = 4096;              // of a tick log
const kKeptChunks = 2;                  // unpacked ones: of each arm
const kMost = 64 * 2 ** 20;             // bytes of a chunk, or of the summary; kMcapChunkBytes of record/export/mcap_file.hpp is 1 MiB
const kMostNames = 4096;                // bytes of an attachment beside its data
const decoder = new TextDecoder();

/** Numbers and texts of a record, in order. Throws behind its end. */
class Fields {
  constructor(bytes) {
    Object.assign(this, {bytes, view: new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), at: 0});
  }
  skip(bytes) {
    this.at += bytes;
    return this.at - bytes;
  }
  u16() {
    return this.view.getUint16(this.skip(2), true);
  }
  u32() {
    return this.view.getUint32(this.skip(4), true);
  }
  u64() {
    return Number(this.view.getBigUint64(this.skip(8), true));
  }
  take(length) {
    if (length > this.bytes.length - this.at) throw new RangeError('cut');
    return this.bytes.subarray(this.skip(length), this.at);
  }
  text() {
    return decoder.decode(this.take(this.u32()));
  }
}

/** A frame of LZ4 whose content has `size` bytes. Throws if it has not, or if that is more than a chunk has. */
export function unpackedLz4(bytes, size) {
  if (!(size <= kMost)) throw new RangeError('too large');
  const fields = new Fields(bytes), out = new Uint8Array(size);
  if (fields.u32() !== 0x184d2204) throw new RangeError('no LZ4');
  const flags = bytes[fields.at];
  fields.skip(2 + (flags & 8 ? 8 : 0) + (flags & 1 ? 4 : 0) + 1);
  let to = 0;
  for (let word; (word = fields.u32()) !== 0;) {
    const block = fields.take(word & 0x7fffffff);
    if (word >>> 31) {
      out.set(block, to);
      to += block.length;
    } else {
      to = unpackBlock(block, out, to);
    }
    if (flags & 16) fields.skip(4);
  }
  if (to !== size) throw new RangeError('cut');
  return out;
}

function unpackBlock(block, out, to) {
  let at = 0;
  const length = nibble => {
    let sum = nibble;
    if (nibble === 15) {
      let more;
      do sum += more = block[at++];
      while (more === 255);
    }
    return sum;
  };
  while (at < block.length) {
    const token = block[at++];
    const literals = length(token >> 4);
    if (!(literals <= block.length - at)) throw new RangeError('cut');
    out.set(block.subarray(at, at + literals), to);
    at += literals;
    to += literals;
    if (at >= block.length) break;  // the last sequence has no match
    if (block.length - at < 2) throw new RangeError('cut');
    const back = block[at] | block[at + 1] << 8;
    at += 2;
    const end = to + length(token & 15) + 4;
    if (back === 0 || back > to || !(end <= out.length)) throw new RangeError('no LZ4');
    for (; to < end; ++to) out[to] = out[to - back];  // byte by byte: it may overlap itself
  }
  return to;
}

/** The content of the record at `at`, of that kind. Throws before it reads more than `most` bytes. */
function recordAt(file, at, opcode, most = kMost) {
  const head = file.read(at, kRecord);
  const length = new Fields(head.subarray(1)).u64();
  if (head[0] !== opcode || length > most || length > file.size - at) throw new RangeError('cut');
  const content = file.read(at + kRecord, length);
  if (content.length !== length) throw new RangeError('cut');
  return content;
}

/** Channels, chunks and attachments, by the summary at the end of the file. */
function readSummary(file) {
  const end = file.size - kMagic.length - kRecord - 20;
  for (const at of [0, file.size - kMagic.length]) {
    if (kMagic.some((byte, i) => file.read(at, kMagic.length)[i] !== byte)) throw new RangeError('cut');
  }
  const start = new Fields(recordAt(file, end, Opcode.footer)).u64();
  if (!(start > 0 && start <= end && end - start <= kMost)) throw new RangeError('cut');  // 0: it has no summary
  const summary = new Fields(file.read(start, end - start));
  const found = {files: new Map(), chunks: [], attachments: []};
  while (summary.at < summary.bytes.length) {
    const [opcode] = summary.take(1);
    const record = new Fields(summary.take(summary.u64()));
    if (opcode === Opcode.channel) {
      const id = record.u16();
      record.u16();  // its schema
      const name = kTopics[record.text()];
      if (name) found.files.set(id, name);
    } else if (opcode === Opcode.chunkIndex) {
      record.skip(16);  // times
      const chunk = {at: record.u64(), indexes: new Map()};
      record.u64();  // its length
      const map = new Fields(record.take(record.u32()));
      while (map.at < map.bytes.length) chunk.indexes.set(map.u16(), map.u64());
      found.chunks.push(chunk);
    } else if (opcode === Opcode.attachmentIndex) {
      const at = record.u64();
      record.skip(24);  // length, times
      found.attachments.push({at, size: record.u64(), name: record.text()});
    }
  }
  return found;
}

/** An attachment's bytes: as many as the index says, by which they are counted before they are read. */
function attached(file, {at, size}) {
  const record = new Fields(recordAt(file, at, Opcode.attachment, size + kMostNames));
  record.skip(16);
  record.text();
  record.text();
  if (record.u64() !== size) throw new RangeError('cut');
  return record.take(size);
}

/** The rows that the messages of a channel are, behind the header of their log, as one file to read. */
class MessageRows {
  constructor(file, header, chunks, channel, rowBytes) {
    Object.assign(this, {file, header, rowBytes, kept: [], rows: 0, chunks: []});
    for (const {at, indexes} of chunks) {
      const index = indexes.get(channel);
      if (index === undefined) continue;
      const head = new Fields(file.read(index, kRecord + 6));
      const [opcode] = head.take(1);
      head.skip(8);  // its length
      head.u16();
      const count = head.u32() / 16;
      const fits = Number.isInteger(count) && count * rowBytes <= kMost;  // each row is in the chunk
      if (opcode !== Opcode.messageIndex || !fits) throw new RangeError('cut');
      this.chunks.push({at, index, first: this.rows, count});
      this.rows += count;
    }
    this.size = header.length + this.rows * rowBytes;
    if (!Number.isSafeInteger(this.size)) throw new RangeError('cut');
  }

  /** The rows of a chunk, one behind the other. */
  rowsOf(chunk) {
    const kept = this.kept.find(one => one.chunk === chunk);
    if (kept) return kept.rows;
    const record = new Fields(recordAt(this.file, chunk.at, Opcode.chunk));
    record.skip(16);
    const size = record.u64();
    record.u32();  // a checksum; each row has its own
    const packing = record.text();
    const packed = record.take(record.u64());
    if (packing !== '' && packing !== 'lz4') throw new RangeError(packing);
    const bytes = packing === 'lz4' ? unpackedLz4(packed, size) : packed;
    if (bytes.length !== size) throw new RangeError('cut');
    const index = new Fields(recordAt(this.file, chunk.index, Opcode.messageIndex));
    const rows = new Uint8Array(chunk.count * this.rowBytes);
    index.skip(6);
    for (let i = 0; i < chunk.count; ++i) {
      index.skip(8);  // its time
      const at = index.u64() + kMessageHead + kCdrHead;
      if (at + this.rowBytes > size) throw new RangeError('cut');
      rows.set(bytes.subarray(at, at + this.rowBytes), i * this.rowBytes);
    }
    this.kept = [{chunk, rows}, ...this.kept].slice(0, kKeptChunks);
    return rows;
  }

  /** Less than `length` at the end of the header and of a chunk: the reader comes again. */
  read(at, length) {
    if (at < this.header.length) return this.header.subarray(at, at + length);
    const row = Math.floor((at - this.header.length) / this.rowBytes);
    const chunk = this.chunks.find(({first, count}) => row < first + count);
    if (!chunk) return new Uint8Array(0);
    const from = at - this.header.length - chunk.first * this.rowBytes;
    return this.rowsOf(chunk).subarray(from, from + length);
  }
}

/**
 * The files of the recording in an MCAP `file`, {size, read}: Map of their place to {size, read}. `path`: its name, for
 * messages. Throws an error with one line.
 */
export function filesInMcap(file, path) {
  let summary;
  const files = new Map();
  const read = what => {
    try {
      return what();
    } catch {
      throw new Error(`${path}: cut, or no MCAP of kerf-record export; copy it again, or export it again`);
    }
  };
  read(() => summary = readSummary(file));
  const {attachments, chunks} = summary;
  if (attachments.length === 0) {
    throw new Error(`${path}: has ticks, and neither scene nor volumes; export the whole recording with this version of kerf, or drop its folder`);
  }
  const heads = new Map();
  for (const one of attachments) {
    if (one.name.endsWith('.npy.head')) {
      if (one.size === kHeaderBytes) heads.set(one.name.slice(0, -'.head'.length), read(() => attached(file, one)));
    } else {
      files.set(one.name, {size: one.size, bytes: () => read(() => attached(file, one))});
    }
  }
  for (const [channel, name] of summary.files) {
    const header = heads.get(name);
    if (!header) {
      throw new Error(`${path}: the header of ${name} is missing; export it again`);
    }
    files.set(name, read(() => new MessageRows(file, header, chunks, channel, rowBytes(header))));
  }
  return files;
}

/** Bytes of a row, by the types in the header of an NPY. */
function rowBytes(header) {
  let sum = 0;
  for (const [, bytes, count] of decoder.decode(header).matchAll(/'[<>|][a-z](\d+)'(?:, \((\d+),\))?/g)) {
    sum += Number(bytes) * Number(count ?? 1);
  }
  if (sum === 0) throw new RangeError('no columns');
  return sum;
}
