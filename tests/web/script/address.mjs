// SPDX-License-Identifier: Apache-2.0
// The words behind # in the address: what they may be, and that what is written is read as it was.
import assert from 'node:assert/strict';
import test from 'node:test';
import {openPage, pass, view} from './fake_page.mjs';

const document = openPage('<body><input id="link" readonly hidden><p id="copied"></p></body>');
const {Address, address, copyLink, hashOf, readHash, viewOf, viewText} = await import('./address.js');
const {runKeys, runPairs} = await import('./run_keys.js');
const keys = {...runKeys, ...address.keys};
const whyNot = hash => {
  try {
    readHash(hash, keys);
  } catch ({message}) {
    assert.ok(!message.includes('\n'));
    return message;
  }
  assert.fail(`${hash} is taken`);
};

test('an address with a value that is none is refused with what it may be', () => {
  assert.match(whyNot('#scene=nosuch'), /^address: scene=nosuch: use phantom, touch, .*, paper_small$/);
  assert.match(whyNot('#scene='), /use phantom/);
  assert.match(whyNot('#scene=Phantom'), /use phantom/);
  assert.equal(whyNot('#hand=yours'), 'address: hand=yours: use script, mine');
  for (const text of ['abc', '', '-1', '1e3', '0x10', 'NaN', 'Infinity', '2000000', '0.0001', '1 2', '٣']) {
    assert.match(whyNot(`#seconds=${text}`), /use 0, which has no end, or a number from 0.001 to 1000000$/, text);
  }
  for (const text of ['abc', '-1', '0.001', '101', 'Infinity']) assert.match(whyNot(`#pace=${text}`), /from 0.01 to 100$/, text);
  for (const text of ['abc', '=1', 'a=']) assert.match(whyNot(`#set=${text}`), /use KEY=VALUE/, text);
  for (const text of ['1,2,3,4,5', '1,2,0,4,5,6', '1,90,3,4,5,6', '1,2,3,4,5,x', '1,2,3,4,5,6,7', '1,2,3,4,5,1e9']) {
    assert.match(whyNot(`#view=${text}`), /use YAW,PITCH,DISTANCE/, text);
  }
  for (const text of ['surface', 'iso,', 'iso;blend']) assert.match(whyNot(`#show=${text}`), /use iso or blend/, text);
  for (const text of ['2', 'x', '-0.1']) assert.match(whyNot(`#iso=${text}`), /use a number from/, text);
  for (const text of ['enamel', 'enamel:2', ':1', 'enamel:', 'a:1,b']) assert.match(whyNot(`#opacity=${text}`), /MATERIAL:NUMBER/, text);
  for (const text of ['w:0.5', 'z', 'z:2', 'zz:1', ':1']) assert.match(whyNot(`#clip=${text}`), /x, y or z/, text);
  for (const text of ['off', '1', '']) assert.match(whyNot(`#stereo=${text}`), /use on$/, text);
});

test('a key that is none, or is given twice, is refused; a long value is cut', () => {
  assert.match(whyNot('#sceen=touch'), /^address: sceen=touch: no such key; there are scene, hand, set, /);
  assert.match(whyNot('#toString=1'), /no such key/);
  assert.match(whyNot('#top'), /^address: top=: no such key/);
  assert.equal(whyNot('#pace=0&pace=1'), 'address: pace=1: pace is given twice; leave one of them');
  assert.ok(whyNot(`#scene=${'x'.repeat(5000)}`).length < 200);
  assert.deepEqual(readHash('', keys), {});
  assert.deepEqual(readHash('#', keys), {});
});

test('what is written is read as it was', () => {
  const run = {scene: 'touch', hand: 'mine', sets: new Map([['force.stiffness_n_per_mm', '0.4'], ['a.b', 'ä "&=+%#,1"']]), seconds: 2.5, pace: 0};
  const read = readHash(hashOf(runPairs(run)), keys);
  assert.deepEqual(read, {scene: 'touch', hand: 'mine', set: [...run.sets], seconds: 2.5, pace: 0});
  assert.equal(hashOf(runPairs({...run, sets: new Map(), hand: 'script', seconds: 0, pace: 1})), '#scene=touch');
  assert.deepEqual(readHash('#show=blend,iso&iso=0.5&opacity=a b:0.5,c:1&clip=y:0.25&stereo=on', keys),
    {show: ['blend', 'iso'], iso: 0.5, opacity: {'a b': 0.5, c: 1}, clip: {axis: 1, at: 0.25}, stereo: true});
  const seen = {yaw: 7 * Math.PI, pitch: -0.5, distance: 61.237, target: [1, -2.005, -0.0001]};
  const text = viewText(seen);
  assert.equal(text, '180,-28.65,61.24,1,-2,0');
  assert.equal(viewText(viewOf(readHash(`#view=${text}`, keys).view)), text);
});

test('the address follows the page each half second, and the page the address', () => {
  const page = new Address(), told = [];
  page.keys = keys;
  let iso = '';
  page.parts.push(() => [['scene', 'touch'], ...(iso ? [['iso', iso]] : [])]);
  page.hearers.push(values => told.push(values));
  page.refusers.push(why => told.push(why));
  location.hash = '#scene=touch&iso=0.4';
  page.start();
  assert.deepEqual(told.splice(0), [{scene: 'touch', iso: 0.4}]);
  iso = '0.5';
  pass(600);
  assert.equal(location.hash, '#scene=touch&iso=0.5');
  location.hash = '#scene=nosuch';
  view.fire('hashchange');
  assert.match(told[0], /use phantom/);
  pass(2000);
  assert.equal(location.hash, '#scene=nosuch', 'it may be corrected');
  location.hash = '#scene=touch';
  view.fire('hashchange');
  assert.deepEqual(told.slice(1), ['', {scene: 'touch'}]);
  history.replaceState = () => { throw new Error('SecurityError'); };
  pass(1000);
  assert.equal(page.link(), 'http://tooth.example:8000/view/#scene=touch&iso=0.5', 'a sandboxed frame has a link too');
});

test('a link is copied; without a clipboard it is there to be copied', async () => {
  const [field, line] = ['link', 'copied'].map(id => document.getElementById(id));
  location.href = 'http://tooth.example:8000/view/?token=secret#iso=0.3';
  location.hash = '';
  const copied = [];
  const give = clipboard => Object.defineProperty(globalThis, 'navigator', {value: {clipboard}, configurable: true});
  give({writeText: async text => copied.push(text)});
  await copyLink(field, line, '; and more');
  assert.deepEqual(copied, ['http://tooth.example:8000/view/'], 'no token');
  assert.deepEqual([field.hidden, line.textContent], [true, 'link copied; and more']);
  for (const clipboard of [undefined, {writeText: async () => { throw new Error('NotAllowedError'); }}]) {
    give(clipboard);
    let selected = false;
    field.select = () => selected = true;
    await copyLink(field, line, '');
    assert.deepEqual([field.hidden, field.value, selected, line.textContent], [false, copied[0], true, 'copy this address']);
  }
});
