// SPDX-License-Identifier: Apache-2.0
// A presented view: its messages, the camera that follows it, and who moves it.
import assert from 'node:assert/strict';
import test from 'node:test';
import {ballScene, near} from './figures.mjs';
import {kViewMagic} from './constants.js';
import {OrbitCamera} from './camera.js';
import {isView, Presenter, SharedView} from './views.js';
import {presentedView, read} from './wire.js';

const kView = {eye: [3, 40, 50], target: [1, 2, 3], up: [0.5, 1, 0]};

function messageOf(presenter, {eye, target, up}) {
  const view = new DataView(new ArrayBuffer(80));
  view.setUint32(0, kViewMagic, true);
  view.setUint32(4, presenter, true);
  [...eye, ...target, ...up].forEach((value, i) => view.setFloat64(8 + 8 * i, value, true));
  return view.buffer;
}

/** A stage with a scene, without a picture. */
function shared() {
  const camera = new OrbitCamera();
  camera.frame(ballScene().corners, 1);
  const told = [], sent = [], box = () => ({checked: false});
  const stage = {camera, scene: {}, touched: 0, touch: () => ++stage.touched};
  const views = new SharedView(stage, {send: view => sent.push(view), say: text => told.push(text), follow: box(), present: box()});
  clearInterval(views.timer);
  return {views, stage, camera, told, sent};
}
const hear = (views, presenter, view = kView) => views.take(read(messageOf(presenter, view)));

test('a view goes over the wire as the program has it', () => {
  assert.deepEqual(read(messageOf(1, kView)), {kind: 'view', presenter: 1, ...kView});
  assert.deepEqual([...new Uint8Array(presentedView(kView))], [...new Uint8Array(messageOf(1, kView))]);
  assert.equal(read(presentedView(null)).presenter, 0);
  assert.throws(() => read(messageOf(1, kView).slice(0, 79)));
});

test('a camera looks from a view at any roll, and its pose is that view', () => {
  for (const view of [kView, {eye: [0, 9, 0], target: [0, 0, 0], up: [1, 0, 0]}, {eye: [0, -9, 0], target: [0, 0, 0], up: [0, 0, 1]},
    {eye: [5, 0, 0], target: [0, 0, 0], up: [0, -1, 0.2]}]) {
    const {camera} = shared();
    camera.lookFrom(view);
    const m = camera.view(1, 30).eyeFromWorld;
    const seen = at => [0, 1, 2].map(r => m[r] * at[0] + m[4 + r] * at[1] + m[8 + r] * at[2] + m[12 + r]);
    near(seen(view.eye), [0, 0, 0], 1e-9);
    near(seen(view.target).slice(0, 2), [0, 0], 1e-9);
    const [x, y] = seen(view.eye.map((value, i) => value + view.up[i]));
    assert.ok(Math.abs(x) < 1e-9 && y > 0, `${x} ${y}`);
    near(camera.pose().eye, view.eye, 1e-9);
  }
});

test('a follower shows the presented view until its user moves the camera', () => {
  const {views, stage, camera, told} = shared();
  const home = camera.pose();
  hear(views, Presenter.another);
  views.step();
  near(camera.pose().eye, home.eye, 1e-9, 'who does not follow keeps its view');
  views.follow.checked = true;
  views.step();
  near(camera.pose().eye, kView.eye, 1e-9);
  hear(views, Presenter.another, {...kView, eye: [9, 40, 50]});
  views.step();
  near(camera.pose().eye, [9, 40, 50], 1e-9);
  assert.ok(views.follow.checked && stage.touched === 2);
  camera.orbit(0.1, 0);
  views.step();
  assert.ok(!views.follow.checked);
  assert.equal(told.at(-1), 'your own view from here on');
  const own = camera.pose();
  hear(views, Presenter.another);
  views.step();
  near(camera.pose().eye, own.eye, 1e-9);
});

test('a presenter that goes leaves its last view, and a view that is none changes nothing', () => {
  const {views, camera, told} = shared();
  views.follow.checked = true;
  hear(views, Presenter.another);
  for (const wrong of [{...kView, eye: [NaN, 0, 0]}, {...kView, eye: kView.target}, {...kView, up: [0, 0, 0]},
    {...kView, eye: [Infinity, 0, 0]}, {eye: [0, 5, 0], target: [0, 0, 0], up: [0, 2, 0]}]) {
    assert.ok(!isView(wrong));
    hear(views, Presenter.another, wrong);
    assert.equal(told.at(-1), 'the presented view is none; it is left out');
    near(camera.pose().eye, kView.eye, 1e-9);
  }
  hear(views, Presenter.nobody);
  assert.equal(told.at(-1), 'the presenter has gone: this is the last view');
  near(camera.pose().eye, kView.eye, 1e-9);
});

test('who presents sends each new view once, follows none, and stops where another one presents', () => {
  const {views, camera, told, sent} = shared();
  views.present.checked = true;
  views.step();
  views.step();
  assert.equal(sent.length, 1);
  near(sent[0].eye, camera.pose().eye, 1e-9);
  hear(views, Presenter.receiver, {...sent[0], eye: [9, 9, 9]});  // an older one of its own comes back
  camera.pan(0.1, 0);
  views.step();
  assert.equal(sent.length, 2);
  hear(views, Presenter.another);
  views.step();
  assert.equal(sent.at(-1), null);
  assert.ok(!views.present.checked);
  assert.equal(told.at(-1), 'another viewer presents its view already');
});
