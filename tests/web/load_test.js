// SPDX-License-Identifier: Apache-2.0
// The scenes of tests/replay/inputs/loads.txt, loaded in WebAssembly:  node load_test.js MODULE ROOT
// Prints a line for each; exit code 1 if a hash is not the known one, or if fewer than `kFewest` could be loaded.
import {readFileSync} from 'node:fs';
import {KerfModule} from '../../web/page/kerf_module.js';

const kFewest = 16;  // the fluted bur is a file, which a tab cannot read
const [file, root] = process.argv.slice(2);
const compiled = new WebAssembly.Module(readFileSync(file));
const known = readFileSync(`${root}/tests/replay/inputs/loads.txt`, 'utf8').trim().split('\n').map(line => line.split(' '));
let equal = 0, differ = 0;
for (const [scene, hash] of known) {
  const module = new KerfModule(compiled);
  const bytes = new TextEncoder().encode(`scenes/${scene}.toml\0${readFileSync(`${root}/scenes/${scene}.toml`, 'utf8')}`);
  module.bytesAt(module.calls.room(bytes.length), bytes.length).set(bytes);
  let found;
  try {
    found = new TextDecoder().decode(module.left(module.calls.load_hash(bytes.length)).slice());
  } catch (problem) {
    console.log(`left out  ${problem.message}`);
    continue;
  }
  if (found === hash) ++equal; else ++differ;
  console.log(`${found === hash ? 'equal    ' : 'DIFFERS  '} ${scene} ${found}`);
}
process.exit(differ > 0 || equal < kFewest ? 1 : 0);
