// SPDX-License-Identifier: Apache-2.0
// The page as a whole: messages of a bridge in; texts, arrows and commands out.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import {Bridge, densities, hello, kSession, records, reply, sceneBlock} from './bridge_end.mjs';
import {clock, FakeSocket, frame as draw, openPage, pass} from './fake_page.mjs';
import {drawnAt, kDegree, near, seenAt} from './figures.mjs';

const document = openPage(fs.readFileSync('index.html', 'utf8'));
const element = id => document.getElementById(id);
const {stage} = await import('./kerf.js');
const socket = FakeSocket.all[0];
const gl = element('picture').getContext('webgl2');
const bridge = new Bridge();
const nowNs = () => BigInt(Math.round(clock.ms * 1e6)) + 5_000_000_000n;  // of the bridge's clock
let tick = 1000;

/** Rows of the figures: what stands beside each label. */
const figures = () => Object.fromEntries(element('figures').children.reduce((rows, one, i) =>
  i % 2 ? (rows.at(-1).push(one.textContent), rows) : [...rows, [one.textContent]], []));
const banner = () => element('banner').hidden ? '' : element('banner').children.map(one => one.textContent).join('');
function news(blocks = [], more = {}) {
  socket.take(bridge.frame(blocks, {tick, atNs: nowNs(), ...more}));
}
/** `ms` of a run of both arms: each arm a record in each tick of 1 ms. */
function run(ms, first, second) {
  for (const end = tick + ms; tick < end;) {
    const ticks = [];
    for (let i = 0; i < 10; ++i, ++tick) {
      const at = {tick: tick + 1, startNs: BigInt(tick) * 1_000_000n};
      ticks.push(second ? [{...at, ...first}, {...at, ...second}] : [{...at, ...first}]);
    }
    socket.take(records(ticks));
    news();
    pass(10);
  }
}

test('joins below the folder of the page, and acknowledges each frame by its number', () => {
  assert.equal(socket.address, 'ws://tooth.example:8000/view/bridge');
  socket.open();
  assert.match(element('state').textContent, /no controller yet/);
  socket.take(hello(3, nowNs()));
  assert.equal(element('teaching').hidden, false);
  news([[0, sceneBlock()], [1, densities(65535)], [2, densities(40000)]]);
  assert.equal(element('state').textContent, 'live');
  const ack = new DataView(socket.sent.at(-1));
  assert.equal(String.fromCharCode(...new Uint8Array(ack.buffer, 0, 4)), 'KBA1');
  assert.deepEqual([ack.byteLength, ack.getBigUint64(8, true), ack.getBigUint64(16, true)], [24, kSession, 1n]);
});

test('the figures are those of each arm\'s newest record', () => {
  run(1500, {force: [0, 3, -4], place: [4, 2, 2], tool: 1, depth: 0.125}, {force: [0.6, 0, 0.8], place: [6, 2, 2], tool: 0, phase: 3});
  assert.equal(element('force').textContent, '5.00 N');
  assert.deepEqual([element('bar').value, element('bar').max], [5, 3.3]);
  const {tool, depth, removed, servo, ...more} = figures();
  assert.deepEqual([tool, depth, removed, servo], ['fissure', '0.13 mm', undefined, '1000 Hz']);
  assert.deepEqual([more['second arm'], more['its tool'], more['its state']], ['1.00 N', 'ball 1 mm', 'ramping']);
  assert.equal(element('second').hidden, false);
  assert.deepEqual(['tool', 'tool2'].map(id => element(id).value), [1, 0]);
  for (const id of ['tool', 'tool2']) {
    assert.deepEqual(element(id).children.map(one => [one.textContent, one.value]), [['ball 1 mm', '0'], ['fissure', '1']]);
  }
  assert.equal(banner(), '');
});

test('of a message of several ticks the newest pair counts, each arm in its own place', () => {
  const at = i => ({tick: tick + i, startNs: BigInt(tick + i) * 1_000_000n});
  socket.take(records([1, 2, 3].map(i => [{...at(i), place: [i, 0, 0]}, {...at(i), place: [-i, 0, 0]}])));
  tick += 3;
  assert.deepEqual(stage.hands.map(({tip}) => tip[0]), [3, -3]);
  socket.take(records([[{...at(-1), place: [9, 0, 0]}, {...at(-1), place: [9, 0, 0]}]]));
  assert.deepEqual(stage.hands.map(({tip}) => tip[0]), [3, -3], 'an old one changes nothing');
});

test('a fault of the second arm is told as its own, that of the first one comes before it', () => {
  run(300, {}, {fault: 3, phase: 5, flags: 1 << 6});
  assert.equal(figures()['its state'], 'overspeed');
  assert.equal(banner(), 'Second arm: Fault overspeed: tip faster than the limit; no force until parked at rest.');
  assert.ok(element('banner').classList.contains('alarm'));
  run(300, {fault: 1, phase: 5, flags: 1 << 6}, {fault: 3, phase: 5, flags: 1 << 6});
  assert.equal(banner(), 'Fault stale_input: no report for 20 ms; no force until parked at rest.');
  run(300, {}, {flags: 1 << 11});
  assert.equal(banner(), 'Second arm: No free place for this tool here, so it feels nothing: lead it into air.');
  run(300, {flags: 1 << 12}, {flags: 1 << 10});
  assert.equal(banner(), 'The shaft touches: it cuts nothing.');
  assert.ok(!element('banner').classList.contains('alarm'));
  run(300, {}, {flags: 1 << 10});
  assert.equal(banner(), 'Second arm: Pressed on what may not be cut.');
});

test('the plot has the first arm\'s force above its depth, new at the right, and the peak of five seconds', () => {
  const canvas = element('plot');
  Object.assign(canvas, {clientWidth: 500, clientHeight: 200});
  run(5500, {force: [0, 1, 0], depth: 0.05}, {force: [9, 0, 0]});
  run(1000, {force: [0, 0.25, 0], depth: 0.2}, {force: [9, 0, 0]});
  const pen = canvas.getContext('2d');
  const texts = pen.texts.slice(-4).map(one => one.text);
  assert.deepEqual(texts, ['force, 5 s, peak', '1.00 N', 'depth, 5 s, peak', '0.20 mm']);
  const [force, depth] = pen.lines.slice(-2);
  near(force.at(-1)[0], 500, 1e-6);
  near(force.at(0)[0], 0, 1);
  // Each half is 100 high with 18 for words and 4 below: a force of a quarter of the peak is a quarter of 76 up.
  near(force.at(-1)[1], 19 + 76 * 0.75, 1e-4);
  near(force.at(0)[1], 19, 1e-4);
  near(depth.at(-1)[1], 119, 1e-4);
  near(depth.at(0)[1], 119 + 76 * 0.75, 1e-4);
});

test('removed volume is what has gone of each brick, by material, in mm3', () => {
  news([[1, densities(65535 - 6554)], [2, densities(20000)]]);
  run(300, {}, {});
  // 512 voxels of 0.125 mm3: a tenth of enamel, and half of what was dentine, whatever its density.
  const enamel = 512 * 0.125 * 6554 / 65535, dentine = 512 * 0.125 * 20000 / 40000;
  const shown = figures(), sum = shown['removed since joining'];
  assert.deepEqual([shown.enamel, shown.dentine, sum], [enamel, dentine, enamel + dentine].map(mm3 => `${mm3.toFixed(2)} mm³`));
});

test('an arrow for each arm, from its own tool, drawn where its force points', () => {
  const [first, second] = [{force: [0, 2, 0], place: [4, 2, 2], tool: 1}, {force: [-1, 0, 0], place: [6, 2, 2], proxy: [0, 0.5, 0], tool: 0}];
  run(100, first, second);
  pass(500);
  for (let i = 0; i < 6; ++i) draw();  // small ones first, until the page knows what a pixel costs
  gl.draws.length = 0;
  run(10, first, {...second, place: [6, 2, 2.001]});
  draw();
  const {camera} = stage;
  near([camera.yaw, camera.pitch], [25 * kDegree, 54 * kDegree], 1e-12);
  near(camera.target, [4, 2, 2], 1e-9);  // the middle of a volume of 8 x 4 x 4 mm
  const at = point => seenAt(point, camera, 800, 600);
  const scale = Math.hypot(4, 2, 2);  // half its diagonal
  const ends = [[4, 2 + 0.6 + 0.3 * scale * 2, 2], [6 - 0.5 - 0.3 * scale, 2.5, 2.001]].map(at);
  const reds = gl.draws.filter(one => one.u_opacity === 1 && one.u_colour[0] === 0.75);
  assert.equal(reds.length, 4);  // shaft and head of each
  [reds[1], reds[3]].forEach((head, arm) => {
    const points = head.points.map(point => drawnAt(point, head, 800, 600));
    assert.ok(Math.min(...points.map(([x, y]) => Math.hypot(x - ends[arm][0], y - ends[arm][1]))) < 0.05, `arm ${arm}`);
  });
  const tools = gl.draws.filter(one => one.u_colour[0] === 0.6);
  assert.equal(tools.length, 2);
});

test('an arm whose place is unknown is not drawn, the other one is, whichever it is', () => {
  for (const idle of [0, 1]) {
    const hands = [0, 1].map(arm => ({force: [0, 1, 0], place: arm === idle ? [NaN, 0, 0] : [4 + 2 * arm, 2, 2]}));
    run(100, ...hands);
    assert.deepEqual([stage.hands[idle], stage.hands[1 - idle]?.tip], [null, hands[1 - idle].place]);
    draw();
    gl.draws.length = 0;
    hands[1 - idle].place = [4, 2, 2.001];
    run(10, ...hands);
    draw();
    const drawn = [0.6, 0.75].map(grey => gl.draws.filter(one => one.u_opacity === 1 && one.u_colour[0] === grey).length);
    assert.deepEqual(drawn, [1, 2], 'a tool, an arrow of two parts');
  }
});

test('a hand is drawn anew where it was and where it is, that of either arm', () => {
  const [view] = stage.views(800, 600);
  const hand = x => ({tip: [x, 2, 2], orientation: [0, 0, 0, 1], tool: 0, force: [0, 0, 0]});
  const redrawn = (hands, before) => stage.painter.partsOf(view, hands, before, [], 800, 600).stage;
  const whole = redrawn([hand(6)], [hand(7)]);
  for (const [now, before] of [[[hand(1), hand(6)], [hand(1), hand(7)]], [[hand(6), hand(1)], [hand(7), hand(1)]],
    [[null, hand(6)], [null, hand(7)]], [[hand(6), null], [hand(7), null]]]) {
    assert.deepEqual(redrawn(now, before), whole);
  }
  for (const other of [hand(1), null]) {
    for (const [a, b] of [[[other, null], [other, hand(7)]], [[null, other], [hand(7), other]]]) {
      assert.deepEqual(redrawn(a, b), redrawn([null], [hand(7)]), 'it goes');
      assert.deepEqual(redrawn(b, a), redrawn([hand(7)], [null]), 'it comes');
    }
  }
  assert.deepEqual(redrawn([hand(1)], [hand(1), hand(7)]), redrawn([null], [hand(7)]), 'the next run has one arm');
  assert.deepEqual(redrawn([hand(1), hand(7)], [hand(1)]), redrawn([hand(7)], [null]), 'it has a second one again');
});

test('a choice of tool that is open stays as it is, that of the other arm follows its arm', () => {
  for (const [open, other] of [['tool', 'tool2'], ['tool2', 'tool']]) {
    run(300, {tool: 0}, {tool: 0});
    document.activeElement = element(open);
    element(open).value = '1';
    element(other).value = 'another';
    run(300, {tool: 0}, {tool: 0});
    assert.deepEqual([element(open).value, element(other).value], ['1', 0]);
    document.activeElement = document.body;
    run(300, {tool: 1}, {tool: 1});
    assert.deepEqual([element(open).value, element(other).value], [1, 1]);
  }
});

test('commands go to the arm that was meant, each is answered by its own number', () => {
  const last = () => {
    const view = new DataView(socket.sent.at(-1));
    return [String.fromCharCode(...new Uint8Array(view.buffer, 0, 4)), view.getUint16(4, true), view.getUint16(6, true), view.getUint32(8, true)];
  };
  const sequence = () => new DataView(socket.sent.at(-1)).getUint32(12, true);
  Object.assign(element('tool'), {value: '1'}).fire('change');
  assert.deepEqual(last(), ['KBC1', 1, 0, 1]);
  const ofFirst = sequence();
  Object.assign(element('tool2'), {value: '1'}).fire('change');
  assert.deepEqual(last(), ['KBC1', 1, 1, 1]);
  const ofSecond = sequence();
  socket.take(reply(ofFirst, 0));
  assert.equal(element('reply').textContent, 'tool: done');
  socket.take(reply(ofSecond, 2));
  assert.equal(element('reply').textContent, "second arm's tool: refused");
  element('hold').click();
  assert.deepEqual(last(), ['KBC1', 2, 0, 1]);
  element('go').click();
  assert.deepEqual(last(), ['KBC1', 2, 0, 0]);
  socket.take(reply(sequence(), 1));
  assert.equal(element('reply').textContent, 'go on: busy, try again');
  const before = socket.sent.length;
  element('reset').click();
  assert.equal(socket.sent.length, before, 'asks first');
  assert.match(element('reset').textContent, /press again/);
  element('reset').click();
  assert.deepEqual(last(), ['KBC1', 3, 0, 0]);
  element('reset').click();
  for (let i = 0; i < 4; ++i, news()) pass(900);
  element('reset').click();  // after three seconds this is a first press again
  assert.equal(socket.sent.filter(one => one.byteLength === 16).length, 5);
});

test('sliders: iso for all volumes, opacity in equal ratios from a thousandth to one', () => {
  const iso = element('iso');
  assert.equal(iso.value, 32768 / 65535);
  const opacities = ['opacity1', 'opacity2'].map(element);
  assert.equal(element('opacity0'), null, 'none for air');
  // Of two materials the harder one shows a tenth, the softer one four tenths: shares of three decades.
  near(opacities.map(one => Number(one.value)), [1 + Math.log10(0.1) / 3, 1 + Math.log10(0.4) / 3], 1e-9);
  Object.assign(opacities[0], {value: 2 / 3}).fire('change');
  assert.deepEqual(stage.look.opacities, {enamel: 0.1});
  Object.assign(opacities[1], {value: 0}).fire('change');
  assert.deepEqual(stage.look.opacities, {enamel: 0.1, dentine: 0});
  Object.assign(iso, {value: 0.3}).fire('change');
  assert.equal(stage.look.iso, 0.3);
  assert.equal(stage.painter.solids[0].view.iso, Math.round(0.3 * 65535));
  stage.setLook({iso: null, opacities: {}});
});

test('the clip plane hides what lies beyond its place along its axis', () => {
  element('clip').checked = true;
  element('place').value = '0.25';
  element('clip').fire('change');
  near(stage.views(800, 600)[0].shown, [0, 0, -1, 1], 1e-9, 'z above 1 mm of 4');
  assert.equal(element('plane').hidden, false);
  element('clip').checked = false;
  element('clip').fire('change');
  near(stage.views(800, 600)[0].shown, [0, 0, 0, 1], 1e-9);
});

test('a servo without a sign of life for 100 ms is stale, with the age of the picture', () => {
  run(20, {}, {});
  news([], {ageMs: 90});
  assert.equal(element('state').textContent, 'live');
  news([], {ageMs: 2500});
  pass(300);
  assert.equal(element('state').textContent, 'stale');
  assert.match(banner(), /^Stale: no news from the servo. This picture is 2 s old.$/);
  assert.deepEqual([figures().servo, figures()['data age']], ['–', '–']);
});

test('held, ended and gone are three things', () => {
  news([], {lifecycle: 2});
  pass(200);
  assert.equal(banner(), 'Held: no cutting and no force.');
  news([], {lifecycle: 3, ended: true});
  pass(200);
  assert.equal(banner(), 'The controller has ended: this is the final state.');
  news([], {lifecycle: 1, ended: true});
  pass(200);
  assert.match(banner(), /^The controller is gone: this is its last state. This picture is \d s old.$/);
  assert.equal(element('state').textContent, 'ended');
});

test('after three silent seconds it joins again, and a run of one arm has no second one', () => {
  pass(4000);
  const next = FakeSocket.all.at(-1);
  assert.notEqual(next, socket);
  next.open();
  assert.equal(element('state').textContent, 'connected; the bridge has no controller yet');
  next.take(hello(0, nowNs(), 78n));
  assert.equal(element('teaching').hidden, true);
  pass(300);
  assert.equal(element('force').textContent, '–');
  assert.equal(figures()['second arm'], undefined);
  const one = new Bridge(78n);
  assert.equal(element('second').hidden, false);  // of the run before, which is shown until this one is here
  next.take(records([[{tick: 1, startNs: 1_000_000n, force: [0, 2, 0], place: [4, 2, 2]}]], 78n));
  next.take(one.frame([[0, sceneBlock()], [1, densities(65535)], [2, densities(40000)]], {tick: 1, atNs: nowNs()}));
  pass(300);
  assert.equal(element('second').hidden, true);
  assert.equal(element('force').textContent, '2.00 N');
  assert.equal(stage.hands.length, 1);
});
