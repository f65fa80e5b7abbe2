// SPDX-License-Identifier: Apache-2.0
// Pointer and fingers lead the emulated hand, as visualizer/app/hand_control does: the tool follows the pointer in the
// plane of the picture, the wheel takes it nearer or farther, and a press pushes it away from the eye.
import {kMostAheadMm, kPressMm, kWheelMm} from './constants.js';
import {add, affineInverse, clamp, column, normalized, subtract, times, transform} from './math.js';

const kRepeatMs = 80;       // a hand lets go of a target that is older than 250 ms
const kWheelPixels = 100;   // of a notch
const kStillMs = 1000;      // a mouse that hovers so long without a move has left the tool to others
// A finger presses once it has been alone for 120 ms. The second finger of a pinch lands up to 100 ms after the first, and
// an event may be a frame of 60 Hz late: 117 ms. A distance would not do instead: in 100 ms the first finger of a pinch goes
// tens of pixels, and a finger that drills goes none. The last 10 ms are a timer of their own: if the page has hung, the
// events that came meanwhile, with the second finger's among them, are taken between the two timers.
const kAloneMs = 120, kLastTurnMs = 10;

const sizeOf = ({clientWidth, clientHeight}) => `${clientWidth} x ${clientHeight}`;

/** What is held down belongs to the tool or to the camera from the first button or finger to the last one that goes up. A
 * press is the tool's: it ends with its button, with a view that moves (shift, another button, a second finger, keys), and
 * when its end may not be told (capture lost, cancelled, page out of focus or hidden). Then it is to be pressed anew. */
export class Steering {
  /** `page`: {stage, now, held()}; `worker` gets the targets. */
  constructor(page, worker) {
    Object.assign(this, {page, worker, on: false, fingersPress: true, at: null, presses: false, depth: null,
      pressedIn: '',   // the view in which the press began
      atIn: '',        // the size of the picture in which `at` is a pixel
      alone: 0,        // counts the fingers that came alone
      leader: null});  // {type, heldDown, atMs}: the kind of pointer that leads the tool
    this.owner = {};   // of what is held down, by kind of pointer: 'tool', 'camera'; none: nothing is
    const {canvas} = page.stage;
    // Before the stage's own listeners, which move the camera.
    const before = (kinds, what) => kinds.forEach(kind => canvas.parentElement.addEventListener(kind, event => {
      if (this.on && event.target === canvas) what(event);
    }, {capture: true, passive: false}));
    const unlessAnotherLeads = what => event => {
      if (!this.isLedByAnother(event)) return what(event);
      // It leads neither the tool nor the camera.
      event.preventDefault();
      event.stopPropagation();
    };
    before(['pointerdown', 'pointermove'], unlessAnotherLeads(event => this.take(event)));
    before(['wheel'], unlessAnotherLeads(event => this.wheel(event)));
    before(['pointerup'], event => !this.isLedByAnother(event) && this.take(event));
    before(['pointercancel', 'lostpointercapture'], ({pointerType}) => this.owner[pointerType] && this.spend(pointerType));
    for (const kind of ['pointerdown', 'pointerup', 'pointercancel']) {
      addEventListener(kind, event => event.pointerType === 'touch' && this.finger(event), {capture: true});
    }
    canvas.addEventListener('pointerleave', event => {
      if (!this.on || event.pointerType === 'touch' || this.isLedByAnother(event)) return;
      event.buttons ? this.spend(event.pointerType) : this.letGo();  // a pointer that is captured does not leave
    });
    canvas.addEventListener('contextmenu', event => this.on && event.preventDefault());
    addEventListener('keydown', ({key}) => {
      if (key === 'Shift' && this.leader && this.leader.type !== 'touch' && this.presses) this.spend();
    });
    addEventListener('blur', () => this.spend());
    addEventListener('pagehide', () => this.spend());
    document.addEventListener('visibilitychange', () => document.hidden && this.spend());
    setInterval(() => this.at && this.send(), kRepeatMs);
  }

  start(on) {
    this.spend();
    Object.assign(this, {on, depth: null});
  }

  /** A mouse and a finger at once: the first one leads until it goes. A wheel is a mouse's. */
  isLedByAnother({pointerType = 'mouse'}) {
    const {leader} = this;
    if (!leader || leader.type === pointerType) return false;
    return leader.type === 'touch' || leader.heldDown || performance.now() - leader.atMs < kStillMs;
  }
  /** Comes or goes, anywhere on the page. The first one is the primary one; with a second one all are the camera's. */
  finger({type, isPrimary}) {
    if (type === 'pointerdown' && isPrimary) return delete this.owner.touch;
    if (type === 'pointerdown') this.owner.touch = 'camera';
    if (this.leader?.type === 'touch') this.letGo();
  }

  /** `event.buttons` counts at each event: a second button that goes down or up is a pointermove. */
  take(event) {
    const {type, pointerType: kind, buttons} = event;
    const isTouch = kind === 'touch';
    if (isTouch && type === 'pointerup') return;  // `finger` has seen it
    const ofCamera = !isTouch && buttons !== 0 && (event.shiftKey || (buttons & ~1) !== 0);
    if (!isTouch && (buttons === 0 || type === 'pointerdown')) delete this.owner[kind];  // which is the first button
    if (ofCamera) this.owner[kind] = 'camera';
    else if (isTouch || buttons !== 0) this.owner[kind] ??= type === 'pointerdown' ? 'tool' : 'camera';  // or it came held down
    if (this.owner[kind] === 'camera') return this.letGo();
    if (type === 'pointermove') event.stopPropagation();
    const goesOn = !isTouch || (type === 'pointermove' && this.presses);
    this.follow(event, this.owner[kind] === 'tool' && goesOn);
    if (isTouch && type === 'pointerdown') this.waitAlone();
  }
  waitAlone() {
    const finger = ++this.alone;
    const whileAlone = (what, ms) => setTimeout(() => finger === this.alone && this.at && what(), ms);
    whileAlone(() => whileAlone(() => {
      this.presses = this.fingersPress;
      this.send();
    }, kLastTurnMs), kAloneMs - kLastTurnMs);
  }
  wheel(event) {
    if (event.ctrlKey || event.shiftKey) return this.presses && this.spend();
    if (this.depth === null || !this.page.stage.entered) return;
    event.preventDefault();
    event.stopPropagation();
    const pixels = event.deltaMode === 0 ? event.deltaY : event.deltaY * 33;
    this.send(-pixels / kWheelPixels * kWheelMm * this.scale());
  }
  follow(event, presses) {
    this.leadTo([event.offsetX, event.offsetY]);
    if (!presses) this.pressedIn = '';
    const ends = this.presses && !presses;
    this.presses = presses;
    this.leader = {type: event.pointerType, heldDown: (event.buttons & 1) !== 0, atMs: performance.now()};
    if (!this.send() && ends) this.letGo();
  }
  /** So many mm to the right, up and deeper from where it leads, or else from where the tool is; `heldDown`: a key still is. */
  leadByKeys([right, up, deeper], heldDown) {
    if (this.leader && this.leader.type !== 'keys' && (this.leader.type === 'touch' || this.leader.heldDown)) return;
    const seen = this.seenTool();
    if (!seen) return this.letGo();
    const {pixel, pixelsPerMm} = seen;
    const [x, y] = this.at ?? pixel;
    const {clientWidth: wide, clientHeight: high} = this.page.stage.canvas;
    this.leadTo([clamp(x + right * pixelsPerMm, 0, wide), clamp(y - up * pixelsPerMm, 0, high)]);
    this.presses = this.owner.keys === 'tool';
    if (!this.presses) this.pressedIn = '';
    this.leader = {type: 'keys', heldDown, atMs: performance.now()};
    this.send(deeper);
  }
  leadTo(pixel) {
    Object.assign(this, {at: pixel, atIn: sizeOf(this.page.stage.canvas)});
  }
  /** What is held down, by this kind of pointer or all, is the tool's no more. */
  spend(kind = null) {
    for (const held of kind ? [kind] : Object.keys(this.owner)) this.owner[held] = 'camera';
    if (!kind || this.leader?.type === kind) this.letGo();
  }
  letGo() {
    this.leader = null;
    ++this.alone;
    if (!this.at) return;
    Object.assign(this, {at: null, presses: false, pressedIn: '', depth: null});
    this.worker.postMessage({release: true});
  }

  scale() {
    return this.page.heldNow()?.sceneJson?.device?.workspace_scale ?? 1;
  }
  /** Where the tool is in the picture, and how many pixels a mm has there; null: it is not seen. */
  seenTool() {
    const {stage, now} = this.page;
    if (!stage.scene || !now.record || !Number.isFinite(now.record.position_mm[0])) return null;
    const {clientWidth: wide, clientHeight: high} = stage.canvas;
    const [view] = stage.views(wide, high);
    const [x, y, z] = transform(view.eyeFromWorld, add(now.record.position_mm, now.record.proxy_offset_mm));
    if (!(z < 0)) return null;
    const pixelsPerMm = high / (2 * view.tanHalfHeight * -z);
    return {pixel: [wide / 2 + x * pixelsPerMm, high / 2 - y * pixelsPerMm], pixelsPerMm};
  }
  /** The target of the hand for where the pointer is, and so much deeper than before. Returns whether there is one. */
  send(deeperMm = 0) {
    const {stage, now} = this.page;
    if (!this.at || !stage.scene || !now.record || !Number.isFinite(now.record.position_mm[0])) return false;
    const {clientWidth: wide, clientHeight: high} = stage.canvas;
    if (this.atIn !== sizeOf(stage.canvas)) return this.spend(), true;  // what is there now, nobody pointed at
    const [view] = stage.views(wide, high);
    if (this.presses) {
      const seenIn = [this.atIn, ...view.eyeFromWorld].join();
      this.pressedIn ||= seenIn;
      if (this.pressedIn !== seenIn) return this.spend(), true;  // else the goal would go through the tooth with the view
    }
    const tool = add(now.record.position_mm, now.record.proxy_offset_mm);
    const toolDepth = -transform(view.eyeFromWorld, tool)[2];
    if (!(toolDepth > 0)) return false;  // a tool behind the eye is not led
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
    return true;
  }
}
