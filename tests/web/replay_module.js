// SPDX-License-Identifier: Apache-2.0
// Replays recordings in kerf.wasm under Node, without a page, and prints one line of JSON for each:
//   node --experimental-default-type=module tests/web/replay_module.js MODULE MOST PATH...
// MOST: bytes that a tab unpacks. PATH: a folder, as it would be dropped, or a file.
import fs from 'node:fs';
import path from 'node:path';
import {KerfModule} from '../../web/page/kerf_module.js';
import {readyRecording} from '../../web/page/log_files.js';
import {ReplayTurn} from '../../web/page/replay_turn.js';

const [module, most, ...dropped] = process.argv.slice(2);
const cpuMs = () => Object.values(process.cpuUsage()).reduce((sum, us) => sum + us / 1000, 0);
const compiled = new WebAssembly.Module(fs.readFileSync(module));

/** Files of a folder with their paths from its parent on, as a browser has them. */
function filesIn(top) {
  const from = path.dirname(top);
  const all = fs.statSync(top).isDirectory() ?
    fs.readdirSync(top, {recursive: true}).map(name => path.join(top, name)).filter(name => fs.statSync(name).isFile()) : [top];
  return all.map(name => ({path: path.relative(from, name), size: fs.statSync(name).size, name}));
}

/** A file read piece by piece, as a page reads a File. */
function piecesOf({name, size}) {
  return {size, read: (at, length) => {
    const to = new Uint8Array(length), file = fs.openSync(name);
    const done = fs.readSync(file, to, 0, length, at);
    fs.closeSync(file);
    return to.subarray(0, done);
  }};
}

/** Goes to a tick and back, after which all must be as before. */
function returnsTo(kerf, tick) {
  const before = kerf.facts().output_hash, volumes = kerf.volumeHash();
  const {tick: last} = kerf.facts();
  for (const goal of [tick, last]) {
    kerf.replayGo(goal);
    while (!kerf.replayPrepare(100));
    if (kerf.facts().tick !== goal) return false;
  }
  return kerf.facts().output_hash === before && kerf.volumeHash() === volumes;
}

async function opened(one) {
  const ready = await readyRecording(filesIn(one), async ({name}) => new Uint8Array(fs.readFileSync(name)), piecesOf, Number(most));
  const kerf = new KerfModule(compiled);
  kerf.openReplay(ready);
  return kerf;
}

/** The tick at which the page's worker rests. */
function restsAt(kerf) {
  const turn = new ReplayTurn(kerf, () => {});
  do turn.slot(false);
  while (turn.playing);
  return kerf.facts().tick;
}

for (const one of dropped) {
  try {
    const kerf = await opened(one);
    const began = cpuMs();
    while (!kerf.replayPrepare(256));
    let messages = 0;
    for (; !kerf.replayStopped; kerf.replayStep(64)) messages += kerf.news().length;
    const stepped = cpuMs();
    const facts = kerf.facts();
    const volume_hash = kerf.volumeHash();
    console.log(JSON.stringify({...facts, volume_hash, messages, rests_at: facts.difference ? restsAt(await opened(one)) : 0,
      returns: returnsTo(kerf, Math.max(Math.ceil(facts.tick / 3), facts.first_tick)),
      times_real_time: facts.tick * facts.tick_ns / 1e6 / (stepped - began),
      memory_mib: kerf.calls.memory.buffer.byteLength / 2 ** 20}));
  } catch (problem) {
    console.log(JSON.stringify({failed: problem.message}));
  }
}
