// SPDX-License-Identifier: Apache-2.0
// What the tab's servo says where its module does not come or may not run: a plain sentence, never the engine's words.
import assert from 'node:assert/strict';
import test from 'node:test';

const give = (name, value) => Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
const kSound = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0);
const bytesOf = bytes => async () => ({ok: true, arrayBuffer: async () => bytes.buffer.slice(0)});
const {compile} = WebAssembly;
let count = 0;

/** What a new worker posts. */
async function begun({fetch, compiles = compile}) {
  const posted = [];
  give('onmessage', null);
  give('postMessage', message => posted.push(message));
  give('fetch', fetch);
  give('setTimeout', () => {});
  WebAssembly.compile = compiles;
  await import(`./worker.js?${++count}`);
  while (!posted.length) await new Promise(done => setImmediate(done));
  return posted;
}
const failed = async how => (await begun(how))[0].failed;

test('a sound module is ready', async () => assert.deepEqual(await begun({fetch: bytesOf(kSound)}), [{ready: true}]));

test('a module that does not come: the network, a status, half of it, a page in its place', async () => {
  const offline = async () => { throw new TypeError('Failed to fetch'); };
  assert.match(await failed({fetch: offline}), /^kerf.wasm: did not come.*load the page again/);
  const cut = async () => ({ok: true, arrayBuffer: offline});
  assert.match(await failed({fetch: cut}), /^kerf.wasm: did not come/);
  const absent = async () => ({ok: false, status: 404, arrayBuffer: async () => new ArrayBuffer(0)});
  assert.equal(await failed({fetch: absent}), 'kerf.wasm: 404; serve the whole folder');
  assert.match(await failed({fetch: bytesOf(new TextEncoder().encode('<!doctype html>'))}), /something else came in its place/);
  assert.match(await failed({fetch: bytesOf(new Uint8Array(0))}), /something else came in its place/);
});

test('a module that may not run: no SIMD, a policy in the words of any engine, no memory', async () => {
  assert.match(await failed({fetch: bytesOf(Uint8Array.of(...kSound, 99))}), /no WebAssembly with SIMD; use a newer one/);
  for (const error of [new WebAssembly.CompileError('WebAssembly.compile(): Refused to compile'), new EvalError('Refused to create')]) {
    const compiles = async () => { throw error; };
    assert.match(await failed({fetch: bytesOf(kSound), compiles}), /^A policy.*'wasm-unsafe-eval' to its script-src\.$/);
  }
  const compiles = async () => { throw new RangeError('Out of memory'); };
  assert.match(await failed({fetch: bytesOf(kSound), compiles}), /^memory: none is left/);
});
