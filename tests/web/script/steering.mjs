// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and fingers to the place that the emulated hand shall take.
import assert from 'node:assert/strict';
import test from 'node:test';
import {clock, pass} from './fake_page.mjs';
import {near, seenAt} from './figures.mjs';
import {rig} from './steered.mjs';

/** Lengths in the plane of the tool: 60 mm away 600 pixels are 2 * 60 * tan(14 degrees). */
const mmPerPixel = 2 * 60 * Math.tan(14 * Math.PI / 180) / 600;

test('the tool goes to where the pointer is, in its own plane, and the button is up', () => {
  const {fire, sent, goal, camera} = rig();
  fire('pointermove', 400, 300);
  near(goal(), [0, 0, 0], 1e-9);
  fire('pointermove', 500, 300);
  near(goal(), [100 * mmPerPixel, 0, 0], 1e-9, 'right is +x for an eye on +z');
  fire('pointermove', 400, 200);
  near(goal(), [0, 100 * mmPerPixel, 0], 1e-9, 'up is +y');
  assert.deepEqual(sent.at(-1).lead.slice(1), [[0, 0], false]);
  Object.assign(camera, {yaw: 0.7, pitch: 0.4, target: [1, 2, 3]});
  fire('pointermove', 250, 410);
  near(seenAt(goal(), camera, 800, 600), [250, 410], 1e-6, 'under the pointer of any camera');
});

test('a press pushes 3 mm away from the eye along the ray, with the pedal down', () => {
  const {fire, sent, goal} = rig();
  fire('pointerdown', 500, 220, {buttons: 1});
  const free = [100 * mmPerPixel, 80 * mmPerPixel, 0], ray = [free[0], free[1], -60];
  near(goal(), free.map((value, i) => value + 3 * ray[i] / Math.hypot(...ray)), 1e-9);
  assert.equal(sent.at(-1).lead[2], true);
  fire('pointerup', 500, 220);
  near(goal(), free, 1e-9);
  assert.equal(sent.at(-1).lead[2], false);
});

test('a notch of the wheel to the user takes the tool 0.25 mm nearer to the eye', () => {
  const {fire, goal} = rig();
  fire('pointermove', 400, 300);
  assert.ok(fire('wheel', 400, 300, {deltaY: 100}).prevented);
  near(goal(), [0, 0, 0.25], 1e-9);
  fire('wheel', 400, 300, {deltaY: -300});
  near(goal(), [0, 0, -0.5], 1e-9);
  fire('wheel', 400, 300, {deltaY: -100 / 33, deltaMode: 1});
  near(goal(), [0, 0, -0.75], 1e-9, 'lines of 33 pixels');
});

test('a wheel over a picture that was not clicked takes the tool nowhere', () => {
  const {fire, sent, stage} = rig();
  fire('pointermove', 400, 300);
  stage.entered = false;
  const before = sent.length;
  assert.ok(!fire('wheel', 400, 300, {deltaY: 100}).prevented);
  assert.equal(sent.length, before);
});

test('the goal is never more than 15 mm behind the tool, and all lengths grow with the scene\'s scale', () => {
  const {fire, goal} = rig();
  fire('pointermove', 400, 300);
  for (let i = 0; i < 100; ++i) fire('wheel', 400, 300, {deltaY: -100});
  near(goal(), [0, 0, -15], 1e-9);
  const large = rig({scale: 2});
  large.fire('pointermove', 400, 300);
  large.fire('wheel', 400, 300, {deltaY: 100});
  near(large.goal(), [0, 0, 0.5], 1e-9);
  large.fire('pointerdown', 400, 300, {buttons: 1});
  near(large.goal(), [0, 0, 0.5 - 6], 1e-9);
});

test('the picture\'s own wheel and drags are the camera\'s: with shift, ctrl, another button', () => {
  const {fire, stage, sent} = rig();
  fire('pointermove', 400, 300);
  const before = sent.length;
  fire('wheel', 400, 300, {deltaY: 100, shiftKey: true});
  fire('wheel', 400, 300, {deltaY: 100, ctrlKey: true});
  assert.equal(sent.length, before);
  fire('pointermove', 450, 300, {shiftKey: true, buttons: 1});
  fire('pointermove', 450, 300, {buttons: 2});
  assert.deepEqual(sent.slice(before), [{release: true}]);
  assert.equal(stage.moved, 4);
  fire('pointermove', 460, 300);
  fire('wheel', 460, 300, {deltaY: 100});
  assert.equal(stage.moved, 4, 'what leads the tool moves no camera');
});

test('one finger leads, and presses once it is alone for 120 ms; fingers that do not press lead only', () => {
  const {fire, sent, steering, goal} = rig();
  const finger = (kind, id, x, y) => fire(kind, x, y, {pointerType: 'touch', pointerId: id, buttons: 1, isPrimary: true});
  finger('pointerdown', 1, 400, 300);
  near(goal(), [0, 0, 0], 1e-9);
  pass(110);
  near(goal(), [0, 0, 0], 1e-9);
  pass(10);
  near(goal(), [0, 0, -3], 1e-9);
  assert.equal(sent.at(-1).lead[2], true);
  finger('pointerup', 1, 400, 300);
  assert.deepEqual(sent.at(-1), {release: true});
  steering.fingersPress = false;
  finger('pointerdown', 3, 400, 300);
  pass(400);
  near(goal(), [0, 0, 0], 1e-9);
  assert.equal(sent.at(-1).lead[2], false);
});

test('the first of mouse and finger leads, a mouse that hovers until it stood still for a second', () => {
  const {fire, sent} = rig();
  const touch = {pointerType: 'touch', pointerId: 7, buttons: 1, isPrimary: true};
  fire('pointermove', 500, 300);
  const before = sent.length;
  clock.ms += 900;
  fire('pointerdown', 300, 300, touch);
  assert.equal(sent.length, before, 'the mouse still leads');
  fire('pointerup', 300, 300, touch);
  clock.ms += 200;
  fire('pointerdown', 300, 300, touch);
  near(sent.at(-1).lead[0][0] < 0, true, 0);
  fire('pointermove', 500, 300);
  assert.ok(sent.at(-1).lead[0][0] < 0, 'now the finger does');
});

test('a goal goes out again each 80 ms, or the hand would let go; it ends where the mouse leaves', () => {
  const {fire, sent} = rig();
  fire('pointermove', 500, 300);
  const before = sent.length;
  pass(800);
  assert.equal(sent.length - before, 10);
  fire('pointerleave', 500, 300);
  assert.deepEqual(sent.at(-1), {release: true});
  const after = sent.length;
  pass(800);
  assert.equal(sent.length, after);
});

test('nothing is led before there is a tool, behind the eye, or while the hand is a script', () => {
  const none = rig();
  none.now.record = null;
  none.fire('pointermove', 400, 300);
  none.now.record = {position_mm: [NaN, 0, 0], proxy_offset_mm: [0, 0, 0]};
  none.fire('pointermove', 400, 300);
  assert.deepEqual(none.sent, []);
  const behind = rig({tool: [0, 0, 70]});
  behind.fire('pointermove', 400, 300);
  assert.deepEqual(behind.sent, []);
  const script = rig();
  script.steering.start(false);
  script.fire('pointermove', 400, 300);
  assert.deepEqual(script.sent, []);
  assert.equal(script.stage.moved, 1);
});

test('another size of the picture lets go: the pointer is over another place until it moves', () => {
  const {fire, canvas, sent, goal} = rig();
  fire('pointermove', 500, 300);
  canvas.clientWidth = 400;
  pass(80);
  assert.deepEqual(sent.at(-1), {release: true});
  fire('pointermove', 250, 300);
  assert.ok(goal()[0] > 0, 'it leads again');
});

test('the place of the tool is that of its proxy: the depth of the goal is that of what is seen', () => {
  const {fire, now, goal} = rig();
  now.record = {position_mm: [0, 0, 5], proxy_offset_mm: [0, 0, 2]};
  fire('pointermove', 400, 300);
  near(goal(), [0, 0, 7], 1e-9);
});
