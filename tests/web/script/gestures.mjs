// SPDX-License-Identifier: Apache-2.0
// Gestures as a browser tells them: the hand presses while it is pressed, and at no other time.
import assert from 'node:assert/strict';
import test from 'node:test';
import {clock, pass, view} from './fake_page.mjs';
import {kLeft, kMiddle, kRight, User} from './steered.mjs';

const kAloneMs = 120;  // of a finger before it presses

/** What each does; `sees` is what the hand shall do meanwhile. After each the next press presses, or the user is stuck. */
const gestures = {
  'a press of the left button, still and moved': user => {
    user.down(kLeft);
    user.sees(true, 300);
    user.move(420, 310);
    user.sees(true, 1000);
    user.up(kLeft);
    user.sees(false, 300);
  },
  'right goes down in a press, then left goes up: a chord': user => {
    user.down(kLeft);
    user.sees(true, 100);
    user.down(kRight);
    user.sees(false, 100);
    user.up(kLeft);
    user.sees(false, 300);
    user.move(430, 300);
    user.sees(false, 1000);
    user.up(kRight);
  },
  'right goes down in a press and up again: left is to be pressed anew': user => {
    user.down(kLeft);
    user.down(kRight);
    user.up(kRight);
    user.sees(false, 200);
    user.move(430, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'left goes down while right turns the view, and stays': user => {
    user.down(kRight);
    user.move(430, 300);
    user.down(kLeft);
    user.sees(false, 200);
    user.up(kRight);
    user.move(440, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'middle goes down in a press': user => {
    user.down(kLeft);
    user.down(kMiddle);
    user.sees(false, 300);
    user.up(kMiddle);
    user.up(kLeft);
  },
  'shift goes down in a press, and nothing moves': user => {
    user.down(kLeft);
    user.sees(true, 100);
    user.key('keydown', 'Shift');
    user.sees(false, 300);
    user.key('keyup', 'Shift');
    user.move(410, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'shift is seen with a motion only, as where the keys went elsewhere': user => {
    user.down(kLeft);
    user.move(410, 300, {shiftKey: true});
    user.sees(false, 200);
    user.move(420, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'shift and a drag move the view': user => {
    user.down(kLeft, {shiftKey: true});
    user.move(500, 300, {shiftKey: true});
    user.sees(false, 200);
    user.up(kLeft);
  },
  'the capture is lost in a press': user => {
    user.down(kLeft);
    user.point('lostpointercapture');
    user.sees(false, 300);
    user.move(420, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'the pointer leaves in a press, since it was never captured': user => {
    user.down(kLeft);
    user.point('pointerleave');
    user.sees(false, 300);
    user.move(420, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'a press is cancelled': user => {
    user.down(kLeft);
    user.point('pointercancel', {buttons: 0});
    user.buttons = 0;
    user.sees(false, 300);
  },
  'the page loses the focus in a press, and its end is told to another': user => {
    user.down(kLeft);
    user.sees(true, 100);
    user.blur();
    user.sees(false, 1000);
    user.buttons = 0;
    user.move(420, 300);
    user.sees(false, 200);
  },
  'the page is hidden in a press': user => {
    user.down(kLeft);
    user.hide(true);
    user.sees(false, 1000);
    user.hide(false);
    user.sees(false, 200);
    user.move(410, 300);
    user.sees(false, 200);
    user.up(kLeft);
  },
  'the page goes in a press': user => {
    user.down(kLeft);
    view.fire('pagehide');
    user.sees(false, 300);
    user.up(kLeft);
  },
  'a button that went down elsewhere comes into the picture': user => {
    user.buttons = kLeft;
    user.move(200, 200);
    user.move(300, 300);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'the wheel takes the tool deeper in a press, and with ctrl the eye nearer': user => {
    user.down(kLeft);
    user.point('wheel', {deltaY: -100});
    user.sees(true, 200);
    user.point('wheel', {deltaY: -100, ctrlKey: true});
    user.sees(false, 200);
    user.up(kLeft);
  },
  'a key turns the view in a press': user => {
    user.down(kLeft);
    user.sees(true, 200);
    user.camera.yaw += 0.03;
    pass(80);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'the picture gets another size in a press': user => {
    user.down(kLeft);
    user.sees(true, 200);
    user.canvas.clientHeight = 500;
    pass(80);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'the picture gets another size in a press, and the pointer moves before that is seen': user => {
    user.down(kLeft);
    user.canvas.clientWidth = 700;
    user.move(410, 300);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'another scene begins in a press': user => {
    user.down(kLeft);
    user.steering.start(true);
    user.move(410, 300);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'the tool goes behind the eye in a press, which then ends': user => {
    user.down(kLeft);
    user.sees(true, 100);
    user.now.record.position_mm = [0, 0, 70];
    user.up(kLeft);
    user.sees(false, 300);
    user.now.record.position_mm = [0, 0, 0];
  },
  'a pen, then the button of its barrel': user => {
    user.kind = 'pen';
    user.down(kLeft);
    user.sees(true, 200);
    user.down(kRight);
    user.sees(false, 200);
    user.up(kRight);
    user.sees(false, 200);
    user.up(kLeft);
    user.point('pointerleave');
    user.kind = 'mouse';
    pass(1100);
  },
  'a finger that rests, and one that drags': user => {
    for (const far of [0, 30]) {
      user.touch('pointerdown', 1, 400, 300);
      for (let ms = 0; ms < kAloneMs; ms += 10) {
        user.sees(false, 10);
        user.touch('pointermove', 1, 400 + far * ms / kAloneMs, 300);
      }
      user.sees(true, 400);
      user.touch('pointerup', 1, 430, 300);
      user.sees(false, 300);
    }
  },
  'a finger that taps': user => {
    user.touch('pointerdown', 1, 400, 300);
    user.sees(false, 80);
    user.touch('pointerup', 1, 400, 300);
    user.sees(false, 500);
  },
  'a second finger ends a press, the one that stays does not press': user => {
    user.touch('pointerdown', 1, 400, 300);
    user.sees(false, kAloneMs);
    user.sees(true, 200);
    user.touch('pointerdown', 2, 500, 300);
    user.sees(false, 300);
    user.touch('pointerup', 1, 400, 300);
    user.touch('pointermove', 2, 450, 300);
    user.sees(false, 1000);
    user.touch('pointerdown', 3, 400, 300);
    user.touch('pointerup', 2, 450, 300);
    user.touch('pointermove', 3, 420, 300);
    user.sees(false, 500);
    user.touch('pointerup', 3, 420, 300);
    user.touch('pointerdown', 4, 400, 300);
    user.sees(false, kAloneMs);
    user.sees(true, 200);
    user.touch('pointerup', 4, 400, 300);
  },
  'a second finger on another part of the page': user => {
    user.touch('pointerdown', 1, 400, 300);
    user.sees(false, 50);
    user.touch('pointerdown', 2, 10, 10, {on: user.later});
    user.sees(false, 400);
    user.touch('pointerup', 2, 10, 10);
    user.touch('pointermove', 1, 410, 300);
    user.sees(false, 400);
    user.touch('pointerup', 1, 410, 300);
  },
  'a finger is cancelled, and one loses its capture': user => {
    user.touch('pointerdown', 1, 400, 300);
    pass(200);
    user.touch('pointercancel', 1, 400, 300);
    user.sees(false, 300);
    user.touch('pointerdown', 2, 400, 300);
    pass(200);
    user.touch('lostpointercapture', 2, 400, 300);
    user.touch('pointermove', 2, 420, 300);
    user.sees(false, 300);
    user.touch('pointerup', 2, 420, 300);
  },
  'a finger whose end was never told': user => {
    user.touch('pointerdown', 1, 400, 300);
    user.blur();
    user.sees(false, 300);
    user.fingers.clear();
    user.touch('pointerdown', 2, 400, 300);
    user.sees(false, kAloneMs);
    user.sees(true, 200);
    user.touch('pointerup', 2, 400, 300);
    user.sees(false, 200);
  },
  'a mouse is pressed beside a finger, and stays when that goes': user => {
    user.touch('pointerdown', 1, 400, 300);
    user.sees(false, kAloneMs);
    user.down(kLeft, {x: 500});
    user.sees(true, 200);
    user.touch('pointerup', 1, 400, 300);
    user.move(510, 300);
    user.sees(false, 300);
    user.up(kLeft);
  },
  'a finger lands beside a mouse that presses, and stays when that goes': user => {
    user.down(kLeft);
    user.touch('pointerdown', 1, 300, 300);
    user.sees(true, 300);
    user.up(kLeft);
    user.point('pointerleave');
    user.touch('pointermove', 1, 310, 300);
    user.sees(false, 1500);
    user.touch('pointerup', 1, 310, 300);
  },
};
for (const [name, gesture] of Object.entries(gestures)) {
  test(`a gesture presses while it is pressed: ${name}`, () => {
    const user = new User();
    user.move(400, 300);
    user.sees(false, 1100);
    gesture(user);
    user.sees(false, 300, 'at the end');
    assert.equal(user.fingers.size, 0);
    pass(1100);
    user.move(401, 300);
    assert.ok(user.sent.at(-1).lead, 'a mouse that hovers leads again');
    user.down(kLeft);
    user.sees(true, 300, 'the next press');
    user.up(kLeft);
    user.sees(false, 300);
  });
}

/** Numbers from 0 to 1, the same in each run. */
function numbers(seed) {
  return () => (seed = (seed * 1664525 + 1013904223) % 4294967296) / 4294967296;
}

test('a gesture of two fingers presses in none of 200 tries, whichever lands and goes first', () => {
  const next = numbers(7);
  const between = (low, high) => low + next() * (high - low);
  for (let i = 0; i < 200; ++i) {
    const user = new User();
    const at = [[between(100, 700), between(100, 500)], [between(100, 700), between(100, 500)]];
    const speed = between(0, 15);  // pixels in 10 ms
    const moves = (id, ms) => {
      for (let gone = 0; gone < ms; gone += 10) {
        for (const finger of [id].flat()) {
          at[finger] = at[finger].map(value => value + between(-speed, speed));
          user.touch('pointermove', finger, ...at[finger]);
        }
        user.sees(false, 10, `try ${i}`);
      }
    };
    user.touch('pointerdown', 0, ...at[0]);
    moves(0, between(0, 90));
    if (next() < 0.3) {  // the page hangs; then a timer may come before the event
      clock.ms += between(0, 400);
      pass(10);
    }
    user.touch('pointerdown', 1, ...at[1]);
    moves([0, 1], between(0, 400));
    const [first, last] = next() < 0.5 ? [0, 1] : [1, 0];
    user.touch('pointerup', first, ...at[first]);
    moves(last, between(0, 500));
    if (next() < 0.3) {
      user.touch('pointerdown', first, ...at[first]);
      moves([0, 1], between(0, 200));
      user.touch('pointercancel', first, ...at[first]);
      moves(last, between(0, 200));
    }
    user.touch('pointerup', last, ...at[last]);
    user.sees(false, 300, `try ${i}`);
    assert.ok(!user.sent.some(({lead}) => lead?.[2]), `try ${i}: not for a moment either`);
  }
});
