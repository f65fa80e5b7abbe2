// SPDX-License-Identifier: Apache-2.0
// Reads an MCAP with the readers of its own project, by the index alone, and prints what a test compares, as JSON:
//     node read.mjs FILE.mcap [SECONDS]      SECONDS: behind the first message, where to seek to
import { open } from 'node:fs/promises';
import { McapIndexedReader, McapStreamReader } from '@mcap/core';
import { parse } from '@foxglove/rosmsg';
import { MessageReader } from '@foxglove/rosmsg2-serialization';
import lz4 from 'lz4js';

const [path, seek] = process.argv.slice(2);
const file = await open(path);
let bytesRead = 0;
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const buffer = new Uint8Array(Number(length));
    await file.read(buffer, 0, buffer.length, Number(offset));
    bytesRead += buffer.length;
    return buffer;
  },
};
const decompressHandlers = { lz4: (buffer) => lz4.decompress(buffer) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const readers = new Map();
const out = { profile: reader.header.profile, indexBytes: bytesRead, channels: {}, ticks: [], first: {}, last: {}, statistics: undefined, attachments: {} };
for (const one of reader.attachmentIndexes) out.attachments[one.name] = Number(one.dataSize);
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const text = new TextDecoder().decode(schema.data);
  const definition = parse(text, { ros2: true });
  readers.set(channel.id, new MessageReader(definition));
  out.channels[channel.topic] = { schema: schema.name, encoding: channel.messageEncoding, count: 0,
    schemaEncoding: schema.encoding, definition: text, metadata: Object.fromEntries(channel.metadata) };
}
out.statistics = { messages: Number(reader.statistics.messageCount), chunks: reader.chunkIndexes.length };
const startTime = seek === undefined ? undefined : reader.statistics.messageStartTime + BigInt(Math.round(Number(seek) * 1e9));
for await (const message of reader.readMessages({ startTime })) {
  const { topic } = reader.channelsById.get(message.channelId);
  out.channels[topic].count += 1;
  if (seek !== undefined && topic !== '/kerf/tick') continue;
  const value = readers.get(message.channelId).readMessage(message.data);
  if (topic === '/kerf/tick') {
    out.ticks.push([Number(value.tick), Array.from(value.position_mm), Array.from(value.commanded_force_n),
      value.output_hash.toString(), value.crc32c, message.logTime.toString()]);
    if (seek !== undefined) break;
  } else {
    out.first[topic] ??= value;
    out.last[topic] = value;
  }
}
out.bytesRead = bytesRead;
// The stream reader checks the checksum of each chunk, and that nothing but records is there; it has them as they lie in the file.
if (seek === undefined) {
  let last = 0n;
  out.backwards = 0;
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  const size = (await file.stat()).size;
  const chunk = new Uint8Array(1 << 20);
  for (let at = 0; at < size;) {
    const { bytesRead: count } = await file.read(chunk, 0, chunk.length, at);
    stream.append(chunk.slice(0, count));
    at += count;
    for (;;) {
      const record = stream.nextRecord();
      if (record === undefined) break;
      if (record.type === 'Message') {
        if (record.logTime < last) out.backwards += 1;
        last = record.logTime;
      }
      out.records = (out.records ?? 0) + 1;
    }
  }
  out.done = stream.done();
}
await file.close();
process.stdout.write(JSON.stringify(out, (_, value) => (typeof value === 'bigint' ? value.toString() : value)));
