// SPDX-License-Identifier: Apache-2.0
// What a page asks for in its head is what its modules import: neither more, nor one that is found later, when its importer has come.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';

/** All that these modules import, at once or later. */
function imported(...begin) {
  const found = new Set(begin);
  for (const name of found) {
    for (const [, next] of fs.readFileSync(name, 'utf8').matchAll(/\b(?:from|import)\s*\(?\s*'\.\/([^']+)'/g)) found.add(next);
  }
  return found;
}
const named = (html, pattern) => [...html.matchAll(pattern)].map(([, name]) => name);
const preloaded = html => named(html, /<link rel="modulepreload" href="([^"]+)">/g);
const scripts = html => named(html, /<script type="module"[^>]* src="([^"]+)"/g);

for (const [page, begin] of [['index.html', ['kerf.js']], ['tab.html', ['servo.js', 'try.js']]]) {
  test(`${page} asks for its modules at once, each a single time`, () => {
    const html = fs.readFileSync(page, 'utf8');
    assert.deepEqual(scripts(html), begin);
    assert.deepEqual([...scripts(html), ...preloaded(html)].sort(), [...imported(...begin)].sort());
  });
}

test('the tab begins with its worker and the module of WebAssembly, before the rest is asked for', () => {
  const html = fs.readFileSync('tab.html', 'utf8');
  const at = text => (assert.ok(html.includes(text), text), html.indexOf(text));
  assert.ok(at('<script type="module" src="servo.js">') < at('<link rel="preload" as="fetch" crossorigin href="kerf.wasm">'));
  assert.ok(at('href="kerf.wasm"') < at('src="try.js"'));
  assert.ok(at('src="try.js"') < at('rel="modulepreload"'));
  assert.deepEqual([...imported('servo.js')], ['servo.js'], 'it waits for no other module');
});

test('what the run needs comes before what only the picture needs', () => {
  const order = preloaded(fs.readFileSync('tab.html', 'utf8'));
  assert.ok(order.indexOf('scene_texts.js') < order.indexOf('kerf.js'));
});
