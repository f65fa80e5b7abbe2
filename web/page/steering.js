// SPDX-License-Identifier: Apache-2.0
// Pointer and fingers lead the emulated hand, as visualizer/app/hand_control does: the tool follows the pointer in the
// plane of the picture, the wheel takes it nearer or farther, and a press pushes it away from the eye.
import {kMostAheadMm, kPressMm, kWheelMm} from './constants.js';
import {add, affineInverse, clamp, column, normalized, subtract, times, transform} from './math.js';

const kRepeatMs = 80;       // a hand lets go of a target that is older than 250 ms
const kWheelPixels = 100;   // of a notch
const kStillMs = 1000;      // a mouse that hovers so long without a move has left the tool to others

export class Steering {
  /** `page`: {stage, now, held()}; `worker` gets the targets. */
  constructor(page, worker) {
    Object.assign(this, {page, worker, on: false, fingersPress: true, at: null, presses: false, depth: null,
      leader: null});  // {type, heldDown, atMs}: the kind of pointer that leads the tool
    const {canvas} = page.stage;
    // Before the stage's own listeners, which move the camera.
    const before = (kind, what) => canvas.parentElement.addEventListener(kind, event => {
      if (!this.on || event.target !== canvas) return;
      if (!this.isLedByAnother(event)) return what(event);
      // It leads neither the tool nor the camera.
      if (event.pointerType === 'touch') this.countFinger(event);
      event.preventDefault();
      event.stopPropagation();
    }, {capture: true, passive: false});
    this.fingers = new Set();
    before('pointerdown', event => this.down(event));
    before('pointermove', event => this.move(event));
    for (const kind of ['pointerup', 'pointercancel']) before(kind, event => this.up(event));
    canvas.addEventListener('pointerleave', event => {
      const leads = this.on && !this.isLedByAnother(event);
      if (leads && event.pointerType === 'mouse' && event.buttons === 0) this.letGo();
    });
    canvas.addEventListener('contextmenu', event => this.on && event.preventDefault());
    before('wheel', event => this.wheel(event));
    setInterval(() => this.at && this.send(), kRepeatMs);
  }

  start(on) {
    if (!on) this.letGo();
    Object.assign(this, {on, depth: null});
    this.fingers.clear();
  }

  /** A mouse and a finger at once: the first one leads until it goes. A wheel is a mouse's. */
  isLedByAnother({pointerType = 'mouse'}) {
    const {leader} = this;
    if (!leader || leader.type === pointerType) return false;
    return leader.type === 'touch' || leader.heldDown || performance.now() - leader.atMs < kStillMs;
  }
  countFinger({type, pointerId}) {
    if (type === 'pointerdown') this.fingers.add(pointerId);
    else if (type !== 'pointermove') this.fingers.delete(pointerId);
  }

  /** By the camera: another button, shift, or more than one finger. */
  isOfCamera(event) {
    if (event.pointerType === 'touch') return this.fingers.size > 1;
    return event.shiftKey || (event.buttons & ~1) !== 0;
  }
  down(event) {
    if (event.pointerType === 'touch') this.countFinger(event);
    if (this.isOfCamera(event)) return this.letGo();
    this.follow(event, event.pointerType === 'touch' ? this.fingersPress : true);
  }
  move(event) {
    if (this.isOfCamera(event)) return;
    event.stopPropagation();
    this.follow(event, event.pointerType === 'touch' ? this.fingersPress : (event.buttons & 1) !== 0);
  }
  up(event) {
    if (event.pointerType === 'touch') {
      this.countFinger(event);
      return this.letGo();
    }
    this.presses = false;
    if (this.leader) Object.assign(this.leader, {heldDown: false, atMs: performance.now()});
    this.send();
  }
  wheel(event) {
    if (event.ctrlKey || event.shiftKey || this.depth === null) return;
    event.preventDefault();
    event.stopPropagation();
    const pixels = event.deltaMode === 0 ? event.deltaY : event.deltaY * 33;
    this.send(-pixels / kWheelPixels * kWheelMm * this.scale());
  }
  follow(event, presses) {
    this.at = [event.offsetX, event.offsetY];
    this.presses = presses;
    this.leader = {type: event.pointerType, heldDown: (event.buttons & 1) !== 0, atMs: performance.now()};
    this.send();
  }
  letGo() {
    this.leader = null;
    if (!this.at) return;
    Object.assign(this, {at: null, presses: false, depth: null});
    this.worker.postMessage({release: true});
  }

  scale() {
    return this.page.heldNow()?.sceneJson?.device?.workspace_scale ?? 1;
  }
  /** The target of the hand for where the pointer is, and so much deeper than before. */
  send(deeperMm = 0) {
    const {stage, now} = this.page;
    if (!this.at || !stage.scene || !now.record || !Number.isFinite(now.record.position_mm[0])) return;
    const {clientWidth: wide, clientHeight: high} = stage.canvas;
    const [view] = stage.views(wide, high);
    const tool = add(now.record.position_mm, now.record.proxy_offset_mm);
    const toolDepth = -transform(view.eyeFromWorld, tool)[2];
    if (!(toolDepth > 0)) return;  // a tool behind the eye is not led
    const before = this.depth ?? toolDepth;
    this.depth = clamp(before + deeperMm, 2 * view.near, Math.max(before, toolDepth + kMostAheadMm * this.scale()));
    const half = view.tanHalfHeight * this.depth;
    const seen = [(2 * this.at[0] / wide - 1) * half * view.aspect, (1 - 2 * this.at[1] / high) * half, -this.depth];
    const back = affineInverse(view.eyeFromWorld);
    let goal = transform(back, seen);
    if (this.presses) {
      goal = add(goal, times(normalized(subtract(goal, column(back, 3))), kPressMm * this.scale()));
    }
    this.worker.postMessage({lead: [goal, [0, 0], this.presses]});
  }
}
