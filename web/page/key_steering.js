// SPDX-License-Identifier: Apache-2.0
// Keys lead the emulated hand while the picture has the focus: arrows in the plane of the picture, page up and down along the
// ray, the space bar presses. One that goes down takes the tool from a mouse that hovers.

const kStepMs = 20;
const kMmPerS = 5;  // two seconds over a crown of 10 mm; a key that is tapped for 80 ms goes 0.4 mm
const kWays = {ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1], PageDown: [0, 0, -1]};  // right, up, deeper
const kPress = ' ';

export class KeySteering {
  constructor(steering, canvas) {
    Object.assign(this, {steering, held: new Set()});
    const before = (kind, what) => canvas.parentElement.addEventListener(kind, event => {
      if (steering.on && event.target === canvas && (event.key in kWays || event.key === kPress)) what(event);
    }, {capture: true});
    before('keydown', event => this.down(event));
    before('keyup', ({key}) => this.up(key));
    // Another element hears of the ends of what is held down then.
    canvas.addEventListener('blur', () => this.forget());
    addEventListener('blur', () => this.forget());
    addEventListener('keydown', ({key}) => key === 'Shift' && this.forget());
    document.addEventListener('visibilitychange', () => document.hidden && this.forget());
    setInterval(() => this.step(), kStepMs);
  }

  down(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || (event.shiftKey && event.key !== kPress)) return;  // the view's
    event.preventDefault();
    event.stopPropagation();
    if (event.repeat || event.shiftKey) return;
    if (event.key === kPress) this.steering.owner.keys = 'tool';
    this.held.add(event.key);
    this.step();
  }
  up(key) {
    if (!this.held.delete(key)) return;
    if (key === kPress) delete this.steering.owner.keys;
    this.steering.leadByKeys([0, 0, 0], this.held.size > 0);
  }
  step() {
    if (this.held.size === 0) return;
    const mm = kMmPerS * kStepMs / 1000 * this.steering.scale();
    const way = [0, 1, 2].map(i => [...this.held].reduce((sum, key) => sum + (kWays[key]?.[i] ?? 0), 0));
    this.steering.leadByKeys(way.map(part => part * mm), true);
  }
  forget() {
    this.held.clear();
    delete this.steering.owner.keys;
    if (this.steering.leader?.type === 'keys') this.steering.letGo();
  }
}
