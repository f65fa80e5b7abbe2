// SPDX-License-Identifier: Apache-2.0
// One arm in a tab, under Node: prints what is said to a scene of two, and how commands for each arm are answered, as JSON:
//   node --experimental-default-type=module tests/web/commands_module.js MODULE ROOT
import fs from 'node:fs';
import path from 'node:path';
import {KerfModule} from '../../web/page/kerf_module.js';

const [module, root] = process.argv.slice(2);
const wasm = new WebAssembly.Module(fs.readFileSync(module));
const read = name => fs.readFileSync(path.join(root, 'scenes', name), 'utf8');
const found = {refused: null, answers: {}};
try {
  new KerfModule(wasm).open({name: 'scenes/two_arms.toml', scene: read('two_arms.toml'), hand: '', settings: []});
} catch (problem) {
  found.refused = problem.message;
}

const kerf = new KerfModule(wasm);
kerf.open({name: 'scenes/phantom.toml', scene: read('phantom.toml'), hand: read('hands/cut_cavity.toml'), settings: []});
kerf.step(16, 0);
kerf.news();
/** Status of the reply to a command to take a tool: 0 accepted, 1 busy, 2 refused. */
function answered(arm, tool, sequence) {
  const asked = new DataView(new ArrayBuffer(16));
  [...'KBC1'].forEach((letter, i) => asked.setUint8(i, letter.charCodeAt(0)));
  asked.setUint16(4, 1, true);
  asked.setUint16(6, arm, true);
  asked.setUint32(8, tool, true);
  asked.setUint32(12, sequence, true);
  kerf.take(asked.buffer);
  kerf.step(16, 0);
  const replies = [...kerf.news()].map(message => new DataView(message))
    .filter(view => view.getUint32(0, true) === 0x3152424b && view.getUint32(4, true) === sequence);
  return replies.length === 1 ? replies[0].getUint32(8, true) : null;
}
for (const [i, [arm, tool]] of [[0, 1], [1, 1], [0, 99], [0, 0]].entries()) found.answers[`arm ${arm}, tool ${tool}`] = answered(arm, tool, 40 + i);
console.log(JSON.stringify(found));
