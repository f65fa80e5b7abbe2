// SPDX-License-Identifier: Apache-2.0
// The camera and what moves it: pointer, two fingers, wheel and keys over the picture.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Element, openPage, view} from './fake_page.mjs';
import {ballScene, drawnAt, kDegree, near, seenAt} from './figures.mjs';
import {clipFromEye, eyeViews, OrbitCamera, screenBounds, shownInEye} from './camera.js';

const {corners} = ballScene();
function camera(aspect = 4 / 3) {
  const made = new OrbitCamera();
  made.frame(corners, aspect);
  return made;
}
const pose = ({yaw, pitch, target, distance}) => ({yaw, pitch, target, distance});
const project = (view, point, width, height) =>
  drawnAt(point, {u_eye_from_mesh: view.eyeFromWorld, u_clip_from_eye: clipFromEye(view)}, width, height);

test('the first view looks from the front right shoulder, 54 degrees down, and leaves hardly a corner of the volume out', () => {
  const one = camera();
  near([one.yaw, one.pitch], [25 * kDegree, 54 * kDegree], 1e-12);
  near(one.target, [0, 0, 0], 1e-12);
  const seen = corners.map(corner => seenAt(corner, one, 800, 600));
  const most = Math.max(...seen.map(([x, y]) => Math.max(Math.abs(x - 400) / 4 * 3, Math.abs(y - 300))));
  near(most, 300 / 0.86, 1e-6, 'what is in a box seldom reaches its corners');
});

test('a view projects as a camera with a lens of 28 degrees does', () => {
  const one = camera();
  Object.assign(one, {yaw: 0.7, pitch: -0.3, target: [1, -2, 3], distance: 80});
  for (const point of [[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10], [-3, 8, -5]]) {
    near(project(one.view(4 / 3, 50), point, 800, 600), seenAt(point, one, 800, 600), 1e-6, `${point}`);
  }
});

test('a picture higher than wide shows as much to the sides as a square one', () => {
  const one = camera(0.5);
  const view = one.view(0.5, 50);
  near(view.tanHalfHeight, 2 * Math.tan(14 * kDegree), 1e-12);
});

test('the left eye stands left: near things are farther right in its picture, and far things farther left', () => {
  const one = Object.assign(camera(), {yaw: 0, pitch: 0, target: [0, 0, 0], distance: 60});
  const [left, right] = eyeViews(one.view(4 / 3, 50), 60);
  const x = (view, point) => project(view, point, 800, 600)[0];
  near(x(left, [0, 0, 0]), 400, 1e-6, 'at the distance of convergence');
  near(x(right, [0, 0, 0]), 400, 1e-6);
  assert.ok(x(left, [0, 0, 20]) > 401 && x(right, [0, 0, 20]) < 399);
  assert.ok(x(left, [0, 0, -20]) < 399 && x(right, [0, 0, -20]) > 401);
  // 60 mm / 30 between the eyes: at 40 mm instead of 60 a point is off by 1 mm * (1/40 - 1/60) of the lens.
  near(x(left, [0, 0, 20]) - 400, 300 / Math.tan(14 * kDegree) * (1 / 40 - 1 / 60), 1e-6);
});

test('a clip plane goes to the eye: a point is as far on its shown side there as in the world', () => {
  const one = Object.assign(camera(), {yaw: 0.7, pitch: -0.3, target: [1, -2, 3], distance: 80});
  const view = {...one.view(4 / 3, 50), shown: [0, -1, 0, 2]};
  const plane = shownInEye(view), m = view.eyeFromWorld;
  for (const [x, y, z] of [[0, 0, 0], [1, 2, 3], [-4, 9, 2]]) {
    const eye = [0, 1, 2].map(r => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
    near(plane[0] * eye[0] + plane[1] * eye[1] + plane[2] * eye[2] + plane[3], 2 - y, 1e-9);
  }
});

test('bounds on the screen hold all corners, from the lowest row, with a pixel of room', () => {
  const one = Object.assign(camera(), {yaw: 0, pitch: 0, target: [0, 0, 0], distance: 60});
  const box = screenBounds([[0, 5, 0], [5, 5, 0]], one.view(4 / 3, 50), 800, 600);
  const [[x0, y0], [x1]] = [[0, 5, 0], [5, 5, 0]].map(point => seenAt(point, one, 800, 600));
  assert.deepEqual(box, {x0: Math.floor(x0 - 1), x1: Math.ceil(x1 + 1), y0: Math.floor(600 - y0 - 1), y1: Math.ceil(600 - y0 + 1)});
});

// -- What moves it

openPage('<body></body>');
const {listen} = await import('./stage.js');
function rig() {
  const parent = new Element('section'), canvas = Object.assign(new Element('canvas'), {clientWidth: 800, clientHeight: 600});
  parent.append(canvas);
  const stage = {canvas, camera: camera(), scene: {}, touched: 0, touch() { ++this.touched; }};
  const keys = [];
  const unheard = [];
  listen(stage, {r: () => keys.push('r')}, () => unheard.push('wheel'));
  return {canvas, stage, keys, unheard, camera: stage.camera};
}

test('a drag to the right turns the scene to the right, a drag up shows it from below', () => {
  const {canvas, camera: one, stage} = rig();
  const before = seenAt([0, 0, 10], one, 800, 600), pitch = one.pitch;
  canvas.fire('pointerdown', {pointerId: 1, clientX: 400, clientY: 300});
  canvas.fire('pointermove', {pointerId: 1, clientX: 430, clientY: 300, buttons: 1});
  near(one.yaw, 25 * kDegree - Math.PI * 30 / 600, 1e-12, 'half a turn for the height of the picture');
  assert.ok(seenAt([0, 0, 10], one, 800, 600)[0] > before[0] + 5, 'what is in front goes with the pointer');
  canvas.fire('pointermove', {pointerId: 1, clientX: 430, clientY: 270, buttons: 1});
  near(one.pitch, pitch - Math.PI * 30 / 600, 1e-12);
  assert.equal(stage.touched, 2);
  canvas.fire('pointerup', {pointerId: 1});
  canvas.fire('pointermove', {pointerId: 1, clientX: 0, clientY: 0});
  assert.equal(stage.touched, 2);
});

test('pitch ends 89 degrees above and below', () => {
  const one = camera();
  one.orbit(0, 9);
  near(one.pitch, -89 * kDegree, 1e-12);
  one.orbit(0, -9);
  near(one.pitch, 89 * kDegree, 1e-12);
});

test('shift or the middle button moves the scene with the pointer, pixel for pixel', () => {
  for (const how of [{shiftKey: true, buttons: 1}, {buttons: 4}]) {
    const {canvas, camera: one} = rig();
    const [x, y] = seenAt([0, 0, 0], one, 800, 600);
    canvas.fire('pointerdown', {pointerId: 1, clientX: 400, clientY: 300});
    canvas.fire('pointermove', {pointerId: 1, clientX: 437, clientY: 281, ...how});
    near(seenAt([0, 0, 0], one, 800, 600), [x + 37, y - 19], 1e-6);
  }
});

test('two fingers apart are nearer, by the ratio of their distances; together they move by their middle', () => {
  const {canvas, camera: one} = rig();
  const {distance} = one;
  canvas.fire('pointerdown', {pointerId: 1, clientX: 350, clientY: 300});
  canvas.fire('pointerdown', {pointerId: 2, clientX: 450, clientY: 300});
  canvas.fire('pointermove', {pointerId: 2, clientX: 550, clientY: 300});  // from 100 to 200 pixels
  near(one.distance, distance / 2, 1e-9);
});

test('the wheel is the page\'s own until the picture was clicked, and again while another page has the focus', () => {
  const {canvas, camera: one, unheard} = rig();
  const click = () => canvas.fire('pointerdown', {pointerId: 1}), leaves = [() => {}, () => canvas.fire('blur'), () => view.fire('blur')];
  for (const leave of leaves) {
    leave();
    const was = one.distance;
    assert.ok(!canvas.fire('wheel', {deltaY: -200}).prevented);
    assert.deepEqual([one.distance, unheard.splice(0).length], [was, 1]);
    leave === leaves[0] ? click() : canvas.focus();
    assert.ok(canvas.fire('wheel', {deltaY: -200}).prevented);
    assert.ok(one.distance < was);
  }
});

test('the wheel: away from the user is nearer by a tenth each 100 pixels or 3 lines', () => {
  const {canvas, camera: one} = rig();
  canvas.focus();
  const {distance} = one;
  assert.ok(canvas.fire('wheel', {deltaY: -200}).prevented);
  near(one.distance, distance * 0.81, 1e-9);
  canvas.fire('wheel', {deltaY: 3, deltaMode: 1});
  near(one.distance, distance * 0.81 / 0.9 ** 0.99, 1e-9);
  for (let i = 0; i < 200; ++i) one.zoom(-1);
  near(one.distance, 20 * Math.hypot(10, 10, 10), 1e-9, 'no farther than 20 sizes');
});

test('keys: arrows turn, with shift they move, plus and minus zoom; other keys are the page\'s own', () => {
  const step = 0.03;
  const after = (key, how = {}) => {
    const {canvas, camera: one, keys} = rig();
    const before = pose(one);
    const event = canvas.fire('keydown', {key, ...how});
    return {event, one, before, keys};
  };
  const {one: left, before} = after('ArrowLeft');
  near(left.yaw, before.yaw + Math.PI * step, 1e-12);
  near(after('ArrowRight').one.yaw, before.yaw - Math.PI * step, 1e-12);
  near(after('ArrowUp').one.pitch, before.pitch - Math.PI * step, 1e-12);
  near(after('ArrowDown').one.pitch, before.pitch + Math.PI * step, 1e-12);
  const {one: moved} = after('ArrowRight', {shiftKey: true});
  near(seenAt([0, 0, 0], moved, 800, 600), [400 + 600 * step, 300], 1e-6);
  near(after('+').one.distance, before.distance * 0.9, 1e-9);
  near(after('=').one.distance, before.distance * 0.9, 1e-9);
  near(after('-').one.distance, before.distance / 0.9, 1e-9);
  assert.deepEqual(after('r').keys, ['r']);
  const {event, one} = after('ArrowLeft', {ctrlKey: true});  // the browser's
  assert.ok(!event.prevented);
  assert.deepEqual(pose(one), before);
  assert.ok(!after('x').event.prevented);
});
