// SPDX-License-Identifier: Apache-2.0
// A client of the bridge, by Foxglove's own client and reader of ROS 2 messages. Prints a line when its subscriptions are
// in force, and at its end what a test compares, as JSON:
//     node client.mjs follow URL [TOPIC...]    until the run has ended: each message, of all topics without a name
//     node client.mjs leave URL                unsubscribes after some messages: what comes after that
//     node client.mjs die URL                  is killed between two messages
//     node client.mjs refused URL              what a read-only server answers
//     node client.mjs open URL                 the status of the answer to the handshake
// The environment variable PROTOCOLS has what it offers, with commas between.
import protocol from '@foxglove/ws-protocol';
import { parse } from '@foxglove/rosmsg';
import { MessageReader } from '@foxglove/rosmsg2-serialization';
import { WebSocket } from 'ws';

const [mode, url, ...topics] = process.argv.slice(2);
const protocols = (process.env.PROTOCOLS ?? 'foxglove.sdk.v1,foxglove.websocket.v1').split(',').filter(Boolean);
const ws = new WebSocket(url, protocols);
const out = { protocol: '', infos: [], channels: {}, statuses: [], messages: {}, afterwards: 0, wrongTimes: 0 };
const print = (value) => process.stdout.write(JSON.stringify(value, (_, item) => {
  if (typeof item === 'bigint') return item.toString();
  return ArrayBuffer.isView(item) ? Array.from(item) : item;
}) + '\n');
let isFinished = false;
const finish = () => {
  if (isFinished) return;
  isFinished = true;
  print(out);
  ws.terminate();
};

if (mode === 'open') {
  ws.on('unexpected-response', (_, response) => {
    let body = '';
    response.on('data', (part) => { body += part; });
    response.on('end', () => {
      print({ status: response.statusCode, body });
      process.exit(0);
    });
  });
  ws.on('open', () => {
    print({ status: 101, protocol: ws.protocol });
    process.exit(0);
  });
} else {
  const client = new protocol.FoxgloveClient({ ws });
  const readers = new Map(), subscribed = new Map();
  let now = 0n, isAnswered = false;
  client.on('open', () => { out.protocol = ws.protocol; });
  client.on('error', (error) => { out.error = String(error); });
  client.on('serverInfo', (info) => out.infos.push(info));
  client.on('time', ({ timestamp }) => { now = timestamp; });
  client.on('advertise', (channels) => {
    for (const channel of channels) {
      const { id, topic, encoding, schemaName, schema, schemaEncoding } = channel;
      out.channels[topic] = { encoding, schemaName, schemaEncoding };
      out.messages[topic] = [];
      readers.set(id, new MessageReader(parse(schema, { ros2: true })));
      if (mode !== 'refused' && (topics.length === 0 || topics.includes(topic))) {
        subscribed.set(client.subscribe(id), { id, topic });
      }
    }
    if (mode === 'refused') {
      client.advertise({ topic: '/x', encoding: 'json', schemaName: 'x' });
      client.getParameters([], 'id');
      client.setParameters([{ name: 'x', value: 1 }], 'id');
      client.sendMessage(1, new Uint8Array([1, 2, 3]));
      client.sendServiceCallRequest({ serviceId: 1, callId: 1, encoding: 'cdr', data: new DataView(new ArrayBuffer(4)) });
      client.subscribeConnectionGraph();
      client.fetchAsset('package://x', 1);
      client.subscribe(99);
      client.unsubscribe(98);
      ws.send('no JSON');
    }
    client.unsubscribe(4_000_000_000);  // its answer comes when all before it is in force
  });
  client.on('status', (status) => {
    out.statuses.push(status);
    if (status.message.includes('4000000000')) {
      if (mode === 'refused') return finish();
      process.stdout.write('subscribed\n');
    }
    if (status.message.includes('4000000001')) {
      isAnswered = true;
      setTimeout(finish, 500);
    }
    if (mode === 'follow' && status.message.includes('has ended')) finish();
  });
  client.on('message', ({ subscriptionId, timestamp, data }) => {
    if (isAnswered) out.afterwards += 1;
    const { id, topic } = subscribed.get(subscriptionId);
    if (timestamp !== now) out.wrongTimes += 1;
    out.messages[topic].push({ at: timestamp, value: readers.get(id).readMessage(data) });
    if (mode === 'die' && out.messages[topic].length === 100) process.kill(process.pid, 'SIGKILL');
    if (mode === 'leave' && out.messages[topic].length === 100 && topic === '/kerf/tick') {
      for (const subscription of subscribed.keys()) client.unsubscribe(subscription);
      client.unsubscribe(4_000_000_001);
    }
  });
  client.on('close', (event) => {
    out.closed = event.code;
    finish();
  });
}
