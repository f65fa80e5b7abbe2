// SPDX-License-Identifier: Apache-2.0
// Runs a scene of kerf in kerf.wasm under Node, without a page, and prints its hashes and times of the processor:
//   node --experimental-default-type=module tests/web/run_module.js MODULE ROOT SCENE HAND SECONDS [KEY=VALUE...]
import fs from 'node:fs';
import path from 'node:path';
import {KerfModule} from '../../web/page/kerf_module.js';

const [module, root, scene, hand, seconds, ...settings] = process.argv.slice(2);
const cpuMs = () => Object.values(process.cpuUsage()).reduce((sum, us) => sum + us / 1000, 0);
const read = name => fs.readFileSync(path.join(root, 'scenes', name), 'utf8');
try {
  const kerf = new KerfModule(new WebAssembly.Module(fs.readFileSync(module)));
  const began = cpuMs();
  kerf.open({name: `scenes/${scene}`, scene: read(scene), hand: hand ? read(hand) : '', settings});
  const opened = cpuMs();
  const most = Math.round(Number(seconds) * kerf.rateHz);
  let messages = 0, bytes = 0;
  const ack = new DataView(new ArrayBuffer(24));
  while (kerf.step(16, most) === 16) {
    for (const message of kerf.news()) {
      ++messages;
      bytes += message.byteLength;
      const view = new DataView(message);
      if (view.getUint32(0, true) !== 0x3146424b) continue;  // KBF1: acknowledged
      ack.setUint32(0, 0x3141424b, true);
      ack.setBigUint64(8, view.getBigUint64(8, true), true);
      ack.setBigUint64(16, view.getBigUint64(16, true), true);
      kerf.take(ack.buffer);
    }
  }
  const stepped = cpuMs();
  const facts = kerf.facts();
  console.log(JSON.stringify({...facts, volume_hash: kerf.volumeHash(), load_cpu_ms: Math.round(opened - began),
    run_cpu_ms: Math.round(stepped - opened), times_real_time: facts.ticks / facts.rate_hz / ((stepped - opened) / 1000),
    messages, bytes, memory_mib: kerf.calls.memory.buffer.byteLength / 2 ** 20}));
} catch (problem) {
  console.error(problem.message);
  process.exitCode = 2;
}
