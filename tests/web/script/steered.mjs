// SPDX-License-Identifier: Apache-2.0
// A steering without a page, and a user whose mouse, pen and fingers send what a browser sends.
import assert from 'node:assert/strict';
import {clock, Element, openPage, pass, view} from './fake_page.mjs';
import {ballScene} from './figures.mjs';

const page = openPage('<body></body>');
const {OrbitCamera} = await import('./camera.js');
const {Steering} = await import('./steering.js');

/** A page whose camera looks along -z at a tool in the origin, from 60 mm. */
export function rig({scale = 1, tool = [0, 0, 0]} = {}) {
  const parent = new Element('section'), canvas = Object.assign(new Element('canvas'), {clientWidth: 800, clientHeight: 600});
  parent.append(canvas);
  const camera = new OrbitCamera();
  camera.frame(ballScene().corners, 4 / 3);
  Object.assign(camera, {yaw: 0, pitch: 0, target: [0, 0, 0], distance: 60});
  const stage = {canvas, scene: {}, entered: true, views: (wide, high) => [camera.view(wide / high, 55)], moved: 0};
  canvas.addEventListener('pointermove', () => ++stage.moved);
  canvas.addEventListener('wheel', () => ++stage.moved);
  const sent = [];
  const now = {record: {position_mm: tool, proxy_offset_mm: [0, 0, 0]}};
  const steering = new Steering({stage, now, heldNow: () => ({sceneJson: {device: {workspace_scale: scale}}})},
    {postMessage: message => sent.push(message)});
  steering.start(true);
  const fire = (kind, x, y, more = {}) => canvas.fire(kind, {pointerType: 'mouse', pointerId: 1, offsetX: x, offsetY: y, ...more});
  return {canvas, camera, parent, stage, sent, now, steering, fire, goal: () => sent.at(-1).lead[0]};
}

export const kLeft = 1, kRight = 2, kMiddle = 4;
const kStaleMs = 250;  // after which the hand itself lets go (GuidedHand)

/** `sees(presses, ms)`: time goes by, in each 10 ms of which the hand presses or does not. */
export class User {
  constructor(more) {
    Object.assign(this, rig(more), {x: 400, y: 300, buttons: 0, kind: 'mouse', fingers: new Map(), heard: 0, toldMs: -Infinity});
    this.later = new Element('aside');  // what else is on the page
  }
  /** A mouse or pen, at once: where it goes, with what held. */
  point(type, {x = this.x, y = this.y, ...more} = {}) {
    Object.assign(this, {x, y});
    return this.fire(type, x, y, {pointerType: this.kind, buttons: this.buttons, isPrimary: true, ...more});
  }
  move(x, y, more) { this.point('pointermove', {x, y, ...more}); }
  /** Of several buttons the first one down and the last one up alone are told as such. */
  down(button, more) {
    const first = this.buttons === 0;
    this.buttons |= button;
    this.point(first ? 'pointerdown' : 'pointermove', more);
  }
  up(button, more) {
    this.buttons &= ~button;
    this.point(this.buttons === 0 ? 'pointerup' : 'pointermove', more);
    if (this.buttons === 0) this.point('lostpointercapture', more);
  }
  touch(type, id, x, y, {on = this.canvas} = {}) {
    if (type === 'pointerdown') this.fingers.set(id, {on, isPrimary: this.fingers.size === 0});
    const finger = this.fingers.get(id);
    const event = {pointerType: 'touch', pointerId: id, isPrimary: finger.isPrimary, offsetX: x, offsetY: y};
    const ends = type === 'pointerup' || type === 'pointercancel';
    finger.on.fire(type, {...event, buttons: ends ? 0 : 1});
    if (!ends) return;
    this.fingers.delete(id);
    finger.on.fire('lostpointercapture', event);
  }
  key(type, key, more) { return view.fire(type, {key, ...more}); }
  hide(hidden) {
    page.hidden = hidden;
    page.documentElement.fire('visibilitychange');
  }
  blur() { view.fire('blur'); }

  /** Whether the hand presses, from what it was told. */
  get presses() {
    for (; this.heard < this.sent.length; ++this.heard) {
      const {lead} = this.sent[this.heard];
      Object.assign(this, {last: lead ? lead[2] : false, toldMs: clock.ms});
    }
    return this.last === true && clock.ms - this.toldMs <= kStaleMs;
  }
  sees(presses, ms, name = '') {
    for (let gone = 0; gone < ms; gone += 10) {
      assert.equal(this.presses, presses, `${name} after ${gone} ms`);
      pass(10);
    }
  }
}
