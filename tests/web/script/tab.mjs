// SPDX-License-Identifier: Apache-2.0
// The page of a tab: what its address and its controls ask of the worker, and what they write back.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import vm from 'node:vm';
import {Bridge, densities, hello, records, sceneBlock} from './bridge_end.mjs';
import {openPage, pass, view} from './fake_page.mjs';
import {texts} from './scene_texts.js';
import {scenes} from './scenes.js';

const document = openPage(fs.readFileSync('index.html', 'utf8'));
const element = id => document.getElementById(id);
const give = (name, value) => Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
const sent = [];
WebAssembly.compileStreaming = async () => 'the module';
give('Worker', class extends EventTarget {
  constructor() {
    super();
    globalThis.worker = this;
  }
  postMessage(message) { sent.push(message); }
});
// The module comes, then the network is gone: scenes are here.
give('fetch', async url => {
  if (!String(url).endsWith('kerf.wasm')) throw new TypeError('Failed to fetch');
});
vm.runInThisContext(fs.readFileSync('start.js', 'utf8'));
give('matchMedia', () => ({matches: false}));

const settled = () => new Promise(done => setImmediate(() => setImmediate(done)));
const says = message => globalThis.worker.onmessage({data: message});
/** The runs that were asked for since the last call, and `close` where nothing shall run. */
const asked = () => sent.splice(0).filter(one => one.open || one.close).map(({open, pace, seconds}) =>
  open ? {scene: open.scene, hand: open.hand, settings: open.settings, pedal: open.pedal, pace, seconds} : 'close');
async function goTo(hash) {
  location.hash = hash;
  view.fire('hashchange');
  await settled();
}
async function choose(id, value) {
  Object.assign(element(id), {value}).fire('change');
  await settled();
}

location.hash = '#scene=nosuch';
await import('./try.js');
await import('./kerf.js');
await settled();
const saidFirst = [element('state').textContent, element('missing').textContent];
says({ready: true});
await settled();

test('an address that is refused says so, and nothing runs', async () => {
  assert.deepEqual([...new Set(asked())], ['close']);
  assert.equal(element('missing').hidden, false);
  assert.match(element('missing').textContent, /^address: scene=nosuch: use phantom, touch,/);
  assert.equal(element('run-state').textContent, element('missing').textContent);
  assert.equal(element('state').textContent, 'not started');
  await goTo('#seconds=abc');
  assert.match(element('missing').textContent, /^address: seconds=abc: use 0, which/);
  assert.deepEqual(asked(), ['close']);
  pass(1000);
  assert.equal(location.hash, '#seconds=abc');
});

test('an address that is right begins its run, at once or once it is corrected', async () => {
  await goTo('#scene=touch&hand=mine&set=force.stiffness_n_per_mm=0.6&seconds=3&pace=0');
  assert.deepEqual(asked(), [{scene: texts['scenes/touch.toml'], hand: '', settings: ['force.stiffness_n_per_mm=0.6'], pedal: true,
    pace: 0, seconds: 3}]);
  assert.equal(element('missing').hidden, true);
  assert.deepEqual([element('scene').value, element('hand').value], ['touch', 'mine']);
  await goTo('#scene=touch&hand=mine&set=force.stiffness_n_per_mm=0.6&seconds=3&pace=0&iso=0.5');
  assert.deepEqual(asked(), [], 'the look alone is another one');
  await goTo('');
  assert.deepEqual(asked(), [{scene: texts['scenes/phantom.toml'], hand: texts['scenes/hands/cut_cavity.toml'], settings: [],
    pedal: false, pace: 1, seconds: 0}]);
});

test('a refused address ends the run, a control begins one', async () => {
  await goTo('#pace=abc');
  assert.deepEqual(asked(), ['close']);
  for (const late of [{opened: 1900}, {failed: 'no memory'}, {facts: {}}]) says(late);
  assert.equal(document.body.dataset.run, 'refused', 'a run that was on its way is none');
  assert.match(element('run-state').textContent, /^address: pace=abc/);
  await choose('hand', 'mine');
  assert.equal(asked().length, 1);
  assert.equal(element('missing').hidden, true);
  pass(600);
  assert.equal(location.hash, '#scene=phantom&hand=mine');
});

test('controls write the address, another scene takes nothing of the one before', async () => {
  await choose('stiffness', '0.55');
  await choose('rate', '2000');
  pass(600);
  assert.equal(location.hash, '#scene=phantom&hand=mine&set=force.stiffness_n_per_mm=0.55&set=servo.rate_hz=2000');
  assert.deepEqual(asked().at(-1).settings, ['force.stiffness_n_per_mm=0.55', 'servo.rate_hz=2000']);
  await choose('scene', 'torus');
  pass(600);
  assert.equal(location.hash, '#scene=torus&hand=mine');
  assert.deepEqual(asked().map(({settings}) => settings), [[]]);
});

test('the look goes into the address and comes from it', async () => {
  const {stage} = await import('./kerf.js');
  says({down: hello(3, 5_000_000_000n)});
  says({down: records([[{tick: 1, startNs: 1_000_000n, place: [4, 2, 2]}]])});
  says({down: new Bridge().frame([[0, sceneBlock()], [1, densities(65535)], [2, densities(40000)]], {tick: 1, atNs: 5_000_000_000n})});
  assert.ok(stage.scene);
  pass(600);
  assert.equal(location.hash, '#scene=torus&hand=mine', 'the first view has no words');
  stage.camera.orbit(0.1, 0.05);
  stage.touch();
  Object.assign(element('iso'), {value: 0.3}).fire('change');
  element('stereo').checked = true;
  element('stereo').fire('change');
  stage.camera.zoom(2);
  stage.touch();
  pass(600);
  const [, seen] = /&view=([-0-9.,]+)&iso=0.3&stereo=on$/.exec(location.hash);
  assert.equal(seen.split(',').length, 6);
  const hash = location.hash;
  await goTo('#scene=torus&hand=mine');
  assert.deepEqual([stage.look.iso, stage.look.stereo, element('stereo').checked, stage.viewText], [null, false, false, '']);
  await goTo(hash);
  assert.deepEqual([stage.look.iso, stage.look.stereo, element('stereo').checked, stage.viewText], [0.3, true, true, seen]);
  assert.deepEqual(asked(), []);
  await goTo('#scene=torus&hand=mine&clip=y:0.25&show=blend&opacity=enamel:0.5,gold:1');
  assert.deepEqual([element('clip').checked, element('place').value, element('plane').hidden, element('renderer').value],
    [true, 0.25, false, 'blend']);
  assert.equal(element('copied').textContent, 'opacity of gold: no such material here; there are enamel, dentine');
  says({down: hello(3, 5_000_000_000n, 78n)});
  const next = new Bridge(78n);
  says({down: next.frame([[0, sceneBlock()], [1, densities(65535)], [2, densities(40000)]], {tick: 1, atNs: 5_000_000_000n})});
  assert.deepEqual(stage.look.opacities, {enamel: 0.5}, 'what the next scene lacks is left out');
  pass(600);
  assert.equal(location.hash, '#scene=torus&hand=mine&show=blend&opacity=enamel:0.5&clip=y:0.25');
});

test('a view that came with another scene is there once the scene is, one that was moved before is not taken back', async () => {
  const {stage} = await import('./kerf.js');
  await goTo('#scene=phantom&view=10,20,30,1,2,3');
  const other = JSON.parse(JSON.stringify(stage.scene.corners)).map(corner => corner.map(value => 2 * value));
  stage.setScene({...stage.scene, corners: other});
  assert.equal(stage.viewText, '10,20,30,1,2,3');
  await goTo('#scene=torus&view=10,20,30,1,2,3');
  await choose('scene', 'touch');
  stage.setScene({...stage.scene, corners: other.map(corner => corner.map(value => value + 1))});
  assert.equal(stage.viewText, '', 'chosen by hand: the first view');
});

test('each scene of the list is inside of the page, with its hand', () => {
  for (const {name, hand} of scenes) {
    for (const path of [`scenes/${name}.toml`, `scenes/hands/${hand}.toml`]) assert.match(texts[path] ?? '', /^\w+ = /m, path);
  }
});

test('while a scene loads the page says so, not that a bridge has no controller', async () => {
  await choose('scene', 'touch');
  assert.deepEqual([element('state').textContent, document.body.dataset.state], ['loading the scene', 'loading the scene']);
  pass(10_000);
  assert.equal(element('state').textContent, 'loading the scene', 'a load is no silence');
});

test('a servo that is silent is none of a bridge', () => {
  says({down: hello(3, 5_000_000_000n, 80n)});
  pass(3500);
  assert.match(element('state').textContent, /^The servo of this tab is silent\. Trying again in 1 s\.$/);
  pass(1000);
  assert.equal(element('state').textContent, 'waiting for the servo');
});

test('a scene that fails says why in place of the picture, until the next one begins', async () => {
  says({down: hello(3, 5_000_000_000n, 79n)});
  says({down: new Bridge(79n).frame([[0, sceneBlock()], [1, densities(65535)], [2, densities(40000)]], {tick: 1, atNs: 5_000_000_000n})});
  assert.equal(element('state').textContent, 'live');
  says({failed: 'scenes/touch.toml: force.stiffness_n_per_mm: 1000: from 0 to 100'});
  const shown = () => [element('state').textContent, element('state').classList.contains('trouble'), document.body.dataset.state,
    element('missing').hidden ? '' : element('missing').textContent];
  const wanted = ['the run has failed', true, 'trouble', 'scenes/touch.toml: force.stiffness_n_per_mm: 1000: from 0 to 100'];
  assert.deepEqual(shown(), wanted);
  pass(10_000);
  assert.deepEqual(shown(), wanted, 'its silence is none of a bridge');
  await choose('scene', 'torus');
  assert.deepEqual(shown(), ['loading the scene', false, 'loading the scene', '']);
  says({failed: 'no memory'});
  says({reads: 'log'});
  assert.deepEqual(shown(), ['loading the recording', false, 'loading the recording', '']);
});

test('a servo that ends in a run is told as that', async () => {
  globalThis.worker.dispatchEvent(Object.assign(new Event('error'), {message: 'Uncaught x'}));
  await settled();
  assert.match(element('missing').textContent, /^the servo of this tab has ended \(Uncaught x\); load the page again$/);
});
