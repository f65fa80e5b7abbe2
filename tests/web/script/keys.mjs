// SPDX-License-Identifier: Apache-2.0
// The keyboard alone: arrows lead the tool, space presses, and what is held down ends with the focus.
import assert from 'node:assert/strict';
import test from 'node:test';
import {pass, view} from './fake_page.mjs';
import {near} from './figures.mjs';
import {kLeft, User} from './steered.mjs';

const {KeySteering} = await import('./key_steering.js');
function user(more) {
  const one = new User(more);
  new KeySteering(one.steering, one.canvas);
  one.down = (key, values) => one.canvas.fire('keydown', {key, ...values});
  one.up = (key, values) => one.canvas.fire('keyup', {key, ...values});
  one.mouseDown = () => User.prototype.down.call(one, kLeft);
  one.mouseUp = () => User.prototype.up.call(one, kLeft);
  return one;
}

test('arrows lead the tool from where it is, 5 mm in a second, page up and down along the ray', () => {
  const one = user({tool: [1, 2, 0]});
  for (const [key, way] of Object.entries({ArrowRight: [5, 0, 0], ArrowUp: [0, 5, 0], ArrowLeft: [-5, 0, 0], ArrowDown: [0, -5, 0]})) {
    one.steering.letGo();
    assert.ok(one.down(key).prevented);
    pass(980);
    one.up(key);
    near(one.goal(), [1 + way[0], 2 + way[1], 0], 1e-6, key);
    assert.equal(one.sent.at(-1).lead[2], false);
    const after = one.goal();
    pass(1000);
    assert.deepEqual(one.goal(), after, 'it stays');
  }
  one.down('PageUp');
  pass(180);
  one.up('PageUp');
  near(one.goal()[2], -1, 1e-6, 'deeper');
  assert.equal(one.stage.moved, 0);
});

test('space presses while it is down, with arrows and over a mouse that hovers', () => {
  const one = user();
  one.down(' ');
  one.sees(true, 300);
  one.down(' ', {repeat: true});
  one.down('ArrowRight');
  one.sees(true, 300);
  one.up('ArrowRight');
  one.sees(true, 300);
  one.up(' ');
  one.sees(false, 300);
  pass(1100);
  one.move(500, 300);
  const [x] = one.goal();
  one.down(' ');
  one.sees(true, 100);
  near(one.goal()[0] / (1 + 3 / Math.hypot(60, x)), x, 0.01, 'there where the mouse is');
  one.move(300, 300);
  assert.ok(one.goal()[0] > 0, 'which leads no more');
  one.up(' ');
  one.sees(false, 300);
});

test('a press by keys ends with the focus, with shift, with a view that moves, and is to be pressed anew', () => {
  const ends = [one => one.canvas.fire('blur'), one => one.blur(), one => one.hide(true), one => one.key('keydown', 'Shift'),
    one => one.camera.yaw += 0.1, one => one.steering.start(true), one => one.canvas.clientWidth = 700];
  for (const end of ends) {
    const one = user();
    one.down(' ');
    one.down('ArrowLeft');
    one.sees(true, 100);
    end(one);
    pass(80);
    one.sees(false, 300, String(end));
    one.down(' ', {repeat: true});
    one.sees(false, 300, String(end));
    one.up(' ');
    one.up('ArrowLeft');
    one.down(' ');
    one.sees(true, 100, 'anew');
    one.up(' ');
    one.hide(false);
  }
});

test('keys of the view and of the browser are not the tool\'s, nor are any beside a press of the mouse', () => {
  const one = user();
  let moved = 0;
  one.canvas.addEventListener('keydown', () => ++moved);
  for (const more of [{shiftKey: true}, {ctrlKey: true}, {altKey: true}, {metaKey: true}]) one.down('ArrowLeft', more);
  one.down('r');
  assert.deepEqual([moved, one.sent.length], [5, 0]);
  one.mouseDown();
  one.sees(true, 100);
  one.down('ArrowLeft');
  one.down(' ');
  const [x] = one.goal();
  pass(200);
  assert.equal(one.goal()[0], x);
  one.up(' ');
  one.sees(true, 100, 'the mouse is pressed still');
  one.mouseUp();
  one.sees(false, 20);
  one.up('ArrowLeft');
  one.steering.start(false);
  one.down('ArrowLeft');
  assert.equal(moved, 6, 'a hand that is a script leaves the arrows to the view');
  view.fire('keyup', {key: 'ArrowLeft'});
});
