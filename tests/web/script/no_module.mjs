// SPDX-License-Identifier: Apache-2.0
// The page of a tab whose module does not come: it says why, and goes on saying it.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import vm from 'node:vm';
import {openPage, pass, view} from './fake_page.mjs';

const document = openPage(fs.readFileSync('index.html', 'utf8'));
const element = id => document.getElementById(id);
Object.defineProperty(globalThis, 'Worker', {configurable: true, value: class extends EventTarget {
  constructor() {
    super();
    globalThis.worker = this;
  }
  postMessage() {}
}});
let comes;
const answer = new Promise(resolve => comes = resolve);
globalThis.fetch = () => answer;
WebAssembly.compileStreaming = async stream => {
  if (!(await stream).ok) throw new TypeError('HTTP status code is not ok');
};
Object.defineProperty(globalThis, 'navigator', {configurable: true, value: {onLine: false}});
Object.defineProperty(globalThis, 'matchMedia', {configurable: true, value: () => ({matches: false})});
Object.assign(globalThis.location, {protocol: 'http:'});
vm.runInThisContext(fs.readFileSync('start.js', 'utf8'));
await import('./try.js');
const settled = () => new Promise(done => setImmediate(() => setImmediate(done)));
await settled();
const shown = () => [element('state').textContent, element('missing').hidden ? '' : element('missing').textContent];

test('until the module is there the page loads, and no bridge is named', () => {
  assert.deepEqual(shown(), ['loading', '']);
  pass(10_000);
  assert.deepEqual(shown(), ['loading', '']);
});

test('a servo that does not start says the cause and the cure', async () => {
  globalThis.worker.dispatchEvent(new Event('error'));
  await settled();
  assert.match(shown()[1], /^The servo of this tab did not start\. A part of this page did not come\. This machine is offline/);
  assert.equal(shown()[0], 'not started');
});

test('a module that did not come stays told, whatever the address and the controls do', async () => {
  const why = 'kerf.wasm: 404; serve the whole folder';
  comes({ok: false, status: 404, arrayBuffer: async () => new ArrayBuffer(0)});
  await settled();
  await import('./kerf.js');
  await settled();
  assert.deepEqual(shown(), ['not started', why]);
  for (const hash of ['#scene=nosuch', '#scene=touch']) {
    location.hash = hash;
    view.fire('hashchange');
    assert.deepEqual(shown(), ['not started', why]);
  }
  element('again').click();
  pass(10_000);
  assert.deepEqual(shown(), ['not started', why]);
});
