// SPDX-License-Identifier: Apache-2.0
// How the tab's servo begins, and what is said where its module does not come or may not run: a plain sentence, never the engine's words.
import assert from 'node:assert/strict';
import test from 'node:test';

const give = (name, value) => Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
const kSound = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0);
const bytesOf = bytes => async () => ({ok: true, arrayBuffer: async () => bytes.buffer.slice(0)});
const {compile} = WebAssembly;
let count = 0;

const otherType = async answer => {
  await answer;
  throw new TypeError('Incorrect response MIME type');
};
/** A page that begins: how its module comes, by the stream first. */
async function begin({fetch, compiles = compile, streams = otherType}) {
  give('Worker', class extends EventTarget {});
  give('fetch', fetch);
  Object.assign(WebAssembly, {compile: compiles, compileStreaming: streams});
  return import(`./servo.js?${++count}`);
}
const failed = async how => (await begin(how)).compiled.then(() => 'it came', problem => problem.message);

test('a sound module comes by its stream, and by its bytes from a server that gives it no type of its own', async () => {
  const asked = [];
  const sound = async url => { asked.push(String(url)); return bytesOf(kSound)(); };
  const {compiled} = await begin({fetch: sound, streams: async answer => { await answer; return 'by the stream'; }});
  assert.equal(await compiled, 'by the stream');
  assert.equal(asked.length, 1);
  assert.match(asked[0], /kerf\.wasm$/);
  assert.ok(await (await begin({fetch: sound})).compiled instanceof WebAssembly.Module);
  const old = await begin({fetch: sound, streams: undefined});
  assert.ok(await old.compiled instanceof WebAssembly.Module);
});

test('an error of the worker before the page listens is not lost', async () => {
  const {worker, broken} = await begin({fetch: bytesOf(kSound)});
  worker.dispatchEvent(Object.assign(new Event('error'), {message: 'blocked'}));
  assert.equal((await broken).message, 'blocked');
});

test('a browser without workers: why, and nothing is begun', async () => {
  const here = globalThis.Worker;
  give('Worker', undefined);
  const {lack, worker} = await import(`./servo.js?${++count}`);
  give('Worker', here);
  assert.match(lack, /no workers/);
  assert.equal(worker, null);
});

test('the worker is ready once it has the module, and not before', async () => {
  const posted = [];
  give('postMessage', message => posted.push(message));
  give('setTimeout', () => {});
  give('onmessage', null);
  await import('./worker.js');
  onmessage({data: {close: true}});
  assert.deepEqual(posted, []);
  onmessage({data: {module: await compile(kSound)}});
  assert.deepEqual(posted, [{ready: true}]);
});

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
