// SPDX-License-Identifier: Apache-2.0
// The force arrow and the tool: where they stand, how long they are, and where they are drawn.
import assert from 'node:assert/strict';
import test from 'node:test';
import {fakeGl} from './fake_page.mjs';
import {ballScene, drawnAt, kDegree, near, seenAt} from './figures.mjs';
import {OrbitCamera} from './camera.js';
import {arrowOf, handOf, HandPainter, poseOf} from './tool.js';

const kHome = {yaw: 25 * kDegree, pitch: 54 * kDegree};
const scene = ballScene({size: [30, 30, 30]});  // half a diagonal: 25.98 mm
const kScaleMm = 15 * Math.sqrt(3);
const hand = (force, tip = [1, 2, 3]) => ({tip, orientation: [0, 0, 0, 1], tool: 0, force});

test('an arrow points along the force, from the surface of the tool, 0.3 sizes of the volume long for each newton', () => {
  for (const [force, direction, newton] of [[[0, 2, 0], [0, 1, 0], 2], [[0, -2, 0], [0, -1, 0], 2], [[1, 0, 0], [1, 0, 0], 1],
    [[0, 0, -0.5], [0, 0, -1], 0.5], [[3, 0, -4], [0.6, 0, -0.8], 5]]) {
    const arrow = arrowOf(scene, hand(force));
    near(arrow.foot, [1, 2, 3].map((at, i) => at + 2 * direction[i]), 1e-9, 'foot');
    near(arrow.tip, [1, 2, 3].map((at, i) => at + (2 + 0.3 * kScaleMm * newton) * direction[i]), 1e-9, 'tip');
  }
});

test('below 0.01 N there is no arrow, as there is no contact', () => {
  assert.equal(arrowOf(scene, hand([0, 0.0099, 0])), null);
  assert.ok(arrowOf(scene, hand([0, 0.0101, 0])));
  assert.equal(arrowOf(scene, hand([0, NaN, 0])), null);
});

test('a hand is where the proxy stands, feels what was sent to the motors, and is nowhere before docking', () => {
  const record = {position_mm: [1, 2, 3], proxy_offset_mm: [0.5, -0.25, 0], orientation: [0, 0, 0, 1], active_tool: 1,
    commanded_force_n: [0, 1, 0], contact_force_n: [0, 7, 0]};
  assert.deepEqual(handOf(record), {tip: [1.5, 1.75, 3], orientation: [0, 0, 0, 1], tool: 1, force: [0, 1, 0]});
  assert.equal(handOf({...record, position_mm: [NaN, 0, 0]}), null);
  assert.equal(handOf(null), null);
});

test('an orientation x, y, z, w turns the tool right-handed', () => {
  const s = Math.sqrt(0.5);
  for (const [quaternion, x, y] of [[[0, 0, s, s], [0, 1, 0], [-1, 0, 0]], [[s, 0, 0, s], [1, 0, 0], [0, 0, 1]],
    [[0, s, 0, s], [0, 0, -1], [0, 1, 0]]]) {
    const pose = poseOf({tip: [4, 5, 6], orientation: quaternion});
    near(pose.slice(0, 3), x, 1e-12, 'x');
    near(pose.slice(4, 7), y, 1e-12, 'y');
    near(pose.slice(12, 15), [4, 5, 6], 1e-12, 'place');
  }
});

/** What is drawn of a force, with the view that a page begins with. */
function drawn(what) {
  const camera = new OrbitCamera();
  camera.frame(scene.corners, 4 / 3);
  const view = camera.view(4 / 3, 100);
  const gl = fakeGl();
  what(new HandPainter(gl, scene), view);
  return {draws: gl.draws, at: point => seenAt(point, {...kHome, target: [0, 0, 0], distance: camera.distance}, 800, 600)};
}
const pixels = draw => draw.points.map(point => drawnAt(point, draw, 800, 600));
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

test('the arrow is drawn from the tool to where the force points: its cone ends there', () => {
  for (const force of [[0, 2, 0], [0, -1, 0], [1.5, 0, 0], [0, 0, 1], [0.6, -0.7, -0.8]]) {
    const {draws, at} = drawn((painter, view) => painter.drawForce(view, hand(force)));
    assert.equal(draws.length, 4);  // shaft and head, faint behind things and full before them
    const newton = Math.hypot(...force), along = share => [1, 2, 3].map((value, i) => value + share * force[i] / newton);
    const [foot, end] = [at(along(2)), at(along(2 + 0.3 * kScaleMm * newton))];
    for (const [shaft, head] of [draws.slice(0, 2), draws.slice(2)]) {
      const nearest = points => Math.min(...points.map(point => apart(point, end)));
      assert.ok(nearest(pixels(head)) < 0.01, `${force}: head`);
      assert.ok(nearest(pixels(shaft)) > 1, `${force}: the shaft ends inside of the head`);
      assert.ok(Math.min(...pixels(shaft).map(point => apart(point, foot))) < 0.01, `${force}: foot`);
    }
    near(draws[0].u_colour, [0.75, 0.13, 0.01], 1e-9, 'red');
    assert.deepEqual(draws.map(one => one.u_opacity), [0.3, 0.3, 1, 1]);
  }
});

test('the tool is drawn at its tip: the ball covers two radii around it, its shank goes up its own axis', () => {
  const {draws, at} = drawn((painter, view) => painter.drawTool(view, hand([0, 0, 0])));
  assert.equal(draws.length, 1);
  const points = pixels(draws[0]);
  const found = wanted => Math.min(...points.map(point => apart(point, wanted)));
  assert.ok(found(at([1, 0, 3])) < 0.01);   // the lowest point of the head
  assert.ok(found(at([3, 2, 3])) < 0.01);   // a side
  assert.ok(found(at([1, 2 + 2 + 16 * 2, 3])) < 0.01);  // the end of the shank, 16 radii beyond the head
});

test('where there is no tool or no force nothing is drawn', () => {
  assert.equal(drawn((painter, view) => painter.drawForce(view, hand([0, 0, 0]))).draws.length, 0);
  assert.equal(drawn((painter, view) => painter.drawTool(view, {...hand([0, 1, 0]), tool: 3})).draws.length, 0);
});
