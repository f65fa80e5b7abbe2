// SPDX-License-Identifier: Apache-2.0
// When and how finely pictures are drawn: only what changed, one at a time, coarser while things
// move where the machine would fall below ten pictures a second. What a pixel costs is learned by
// small pictures first.
import {viewText} from './address.js';
import {eyeViews, OrbitCamera} from './camera.js';
import {kToolRoom} from './constants.js';
import {contextOf, enableExtensions, requireNoError} from './gl.js';
import {beginPrograms, Painter} from './layers.js';
import {mix} from './math.js';
import {sceneIn} from './scene.js';
import {sameHands} from './tool.js';

const kBudgetMs = 85;      // of one picture while things move: ten a second with some room
const kRestMs = 250;       // without motion: the picture is drawn finely again
const kScales = [1, 1 / 2, 1 / 3, 1 / 4, 1 / 6, 1 / 8];
const kMostPixels = 4096;  // of a side
const kTaught = 10000;     // pixels of a picture whose time is that of its pixels
const kUntaught = 2;       // pictures before that is known; they are small
const kRoom = 1.3;
const kNews = 0.4;         // share of the last picture in what is known of its cost

export class Stage {
  /** `trouble(text)` says why there is no picture; '' where there is one again. Throws as contextOf. */
  constructor(canvas, trouble) {
    Object.assign(this, {canvas, trouble});
    this.gl = contextOf(canvas);
    beginPrograms(this.gl);
    this.camera = new OrbitCamera();
    this.look = {kinds: [], iso: null, opacities: {}, clip: {on: false, axis: 2, at: 0.5}, stereo: false};
    this.scale = 1;
    this.costMs = 0;    // of a pixel, where all are drawn anew
    this.besideMs = 0;  // of a pixel of pictures of which a part is drawn anew, beside that part
    this.untaught = 0;  // pictures until it is known
    this.shown = 0;   // pictures
    this.moved = this.changed = -Infinity;
    this.stale = true;
    this.hands = [];  // of each arm; null: it is not known where
    this.drawn = [];  // those of the last picture
    this.entered = false;  // by a click or by key: the wheel is its own then, else it scrolls the page around it
    this.wanted = null;   // the view that the next scene begins with; null: its first one
    this.firstView = '';  // as the address has it
    canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      this.fail('The graphics card took the picture away, as it does when its memory is full; waiting for it.');
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.fence = null;
      this.attempt(() => {
        enableExtensions(this.gl);
        beginPrograms(this.gl);
        if (this.scene) this.rebuild();
      });
    });
    new ResizeObserver(() => this.stale = true).observe(canvas);
    requestAnimationFrame(() => this.tick());
  }

  get aspect() {
    return (this.look.stereo ? 0.5 : 1) * this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
  }

  /** Another scene. The camera stays where the volumes lie as before. */
  setScene(scene) {
    const same = this.scene && String(this.scene.corners) === String(scene.corners);
    this.scene = scene;
    const {wanted} = this;
    if (!same) this.home();
    if (wanted) this.camera.look(wanted);
    this.rebuild();
  }
  home() {
    if (this.scene) {
      this.camera.frame(this.scene.corners, this.aspect);
      this.firstView = viewText(this.camera);
    }
    this.touch();
  }
  /** From here, now and when the next scene comes, unless the camera is moved before; null: the first view. */
  showFrom(wanted) {
    this.home();
    if (wanted && this.scene) this.camera.look(wanted);
    this.wanted = wanted;
  }
  /** The view as the address has it; '' for the first one. */
  get viewText() {
    const now = this.wanted ?? (this.scene ? this.camera : null);
    const text = now ? viewText(now) : '';
    return text === this.firstView ? '' : text;
  }
  /** The renderer of a volume: iso or blend. */
  kindOf(volume) {
    return this.look.kinds[volume] ?? 'iso';
  }
  rebuild() {
    this.painter?.free();
    this.painter = null;
    this.stale = true;
    this.untaught = kUntaught;
    this.attempt(() => {
      this.painter = new Painter(this.gl, sceneIn(this.scene, this.look), v => this.kindOf(v));
      this.trouble('');
    });
  }
  /** Says why there is no picture from now on: an old one would be taken for this one. */
  fail(why) {
    this.painter?.free();
    this.painter = null;
    this.trouble(why);
  }
  attempt(what) {
    try {
      what();
    } catch (problem) {
      this.fail(`${problem.message}.`);
    }
  }
  /** In the document, for who waits for the finished picture. */
  tell(state) {
    if (this.canvas.dataset.state !== state) this.canvas.dataset.state = state;
  }
  /** Changes of the look. */
  setLook(change) {
    const before = this.look;
    this.look = {...before, ...change};
    if (this.scene && (String(this.look.kinds) !== String(before.kinds) || this.look.iso !== before.iso)) {
      this.rebuild();
    } else if (this.look.opacities !== before.opacities) {
      this.painter?.setMaterials(sceneIn(this.scene, this.look).materials);
    }
    this.touch();
  }
  /** Camera or look are others now. */
  touch() {
    this.stale = true;
    this.wanted = null;
    this.moved = performance.now();
    this.tell('moving');
  }

  /** Of each eye, in a picture of this size. */
  views(width, height) {
    const {camera, scene, look} = this;
    const reach = camera.radius + kToolRoom * scene.main.radius;
    const view = camera.view(width / height, reach);
    if (look.clip.on) {
      const at = scene.corners.map(corner => corner[look.clip.axis]);
      view.shown = [0, 0, 0, mix(Math.min(...at), Math.max(...at), look.clip.at)];
      view.shown[look.clip.axis] = -1;
    }
    return look.stereo ? eyeViews(view, camera.distance) : [view];
  }

  tick() {
    requestAnimationFrame(() => this.tick());
    if (this.isFree() && this.painter && this.canvas.clientWidth >= 2) this.attempt(() => this.drawNews());
  }

  /** A picture, where something is not as in the last one. */
  drawNews() {
    const {canvas, gl} = this;
    const now = performance.now();
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(n =>
      Math.min(Math.round(n * ratio), kMostPixels));
    if (canvas.width !== width || canvas.height !== height) {
      Object.assign(canvas, {width, height});
      this.stale = true;
    }
    const boxes = this.painter.take();
    const moves = !sameHands(this.hands, this.drawn);
    if (moves || boxes.length > 0) this.changed = now;
    const {hands} = this;
    const eyes = this.look.stereo ? 2 : 1;
    const wide = Math.floor(width / eyes);
    const views = this.views(wide, height);
    const before = this.scale;
    this.chooseScale(eyes * wide * height, now, () => views.reduce((sum, view) =>
      sum + this.painter.partsOf(view, hands, this.drawn, this.stale ? null : boxes, wide, height).pixels, 0));
    if (!this.stale && !moves && this.scale === before && boxes.length === 0) {
      if (now - Math.max(this.moved, this.changed) > kRestMs) this.tell('at rest');
      return;
    }
    this.tell('moving');
    const size = [wide, height].map(n => Math.max(Math.round(n * this.scale), 1));
    const all = this.painter.fit(eyes, ...size) || this.stale;
    const began = performance.now();
    let pixels = 0;
    views.forEach((view, i) => {
      pixels += this.painter.draw(i, view, hands, this.drawn, all ? null : boxes);
    });
    this.painter.show(width, height);
    if (this.untaught === kUntaught) requireNoError(gl);  // the volumes are there now
    this.fence = {sync: gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), began, pixels, all,
      ofAll: eyes * size[0] * size[1], painter: this.painter};
    gl.flush();
    this.drawn = hands;
    this.stale = false;
    ++this.shown;
  }

  /** Whether the last picture is finished; learns from it what a pixel costs. */
  isFree() {
    const {gl, fence} = this;
    if (gl.isContextLost()) return false;
    if (!fence) return true;
    if (gl.clientWaitSync(fence.sync, 0, 0) === gl.TIMEOUT_EXPIRED) return false;
    gl.deleteSync(fence.sync);
    this.fence = null;
    if (fence.painter !== this.painter) return true;
    const tookMs = performance.now() - fence.began;
    const cost = tookMs / fence.ofAll;
    if (this.untaught > 0) {
      // The first picture of a painter pays for its shaders, the next one tells what pictures cost.
      --this.untaught;
      Object.assign(this, {costMs: cost, besideMs: 0, stale: true});
    } else if (!fence.all) {
      this.besideMs = mix(this.besideMs, Math.max(cost - this.costMs * fence.pixels / fence.ofAll, 0), kNews);
    } else if (fence.ofAll >= kTaught || cost < this.costMs) {  // of few pixels: at most
      this.costMs = mix(this.costMs, cost, kNews);
    }
    return true;
  }

  /** The finest scale at which the next picture stays within the budget. At the scale of the last one
   * only `changed()` of its pixels are cast, at another one all. At rest the finest, whatever it costs. */
  chooseScale(pixels, now, changed) {
    if (this.untaught > 0) {
      this.scale = kScales.at(-1);
    } else if (now - Math.max(this.moved, this.changed) > kRestMs) {
      this.scale = 1;
    } else {
      const ofPart = () => this.costMs * changed() + this.besideMs * pixels;
      const fits = (scale, room) => scale * scale * room *
        (scale === this.scale && !this.stale ? ofPart() : this.costMs * pixels) <= kBudgetMs;
      // Finer again only with room to spare, so that it does not go to and fro.
      this.scale = kScales.find(scale => fits(scale, scale > this.scale ? kRoom : 1)) ?? kScales.at(-1);
    }
  }
}

// Mouse, fingers and keys over the picture.

const kKeyStep = 0.03;     // of the picture's height
const kWheelPixels = 100;  // of a step

/** Moves the camera of a stage; `on` has what other keys do, by key. `unheard` is called for a wheel that is not the picture's. */
export function listen(stage, on, unheard) {
  const {canvas, camera} = stage;
  const pointers = new Map();
  const high = () => Math.max(canvas.clientHeight, 1);

  for (const kind of ['pointerdown', 'focus']) canvas.addEventListener(kind, () => stage.entered = true);
  for (const from of [canvas, window]) from.addEventListener('blur', () => stage.entered = false);
  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  });
  for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    canvas.addEventListener(kind, event => pointers.delete(event.pointerId));
  }
  canvas.addEventListener('pointermove', event => {
    const at = pointers.get(event.pointerId);
    if (!at || !stage.scene) return;
    const others = [...pointers.values()].filter(one => one !== at);
    const right = (event.clientX - at.x) / high(), up = (at.y - event.clientY) / high();
    if (others.length === 1) {
      const [{x, y}] = others;
      const before = Math.hypot(at.x - x, at.y - y), after = Math.hypot(event.clientX - x, event.clientY - y);
      camera.pan(0.5 * right, 0.5 * up);  // the middle of two fingers
      if (before > 0 && after > 0) camera.zoom(Math.log(before / after) / Math.log(0.9));
    } else if (event.shiftKey || event.buttons & 4) {
      camera.pan(right, up);
    } else {
      camera.orbit(right, up);
    }
    Object.assign(at, {x: event.clientX, y: event.clientY});
    stage.touch();
  });
  canvas.addEventListener('wheel', event => {
    if (!stage.entered) return unheard();
    event.preventDefault();
    if (!stage.scene) return;
    const pixels = event.deltaMode === 0 ? event.deltaY : event.deltaY * 33;
    camera.zoom(-pixels / kWheelPixels);
    stage.touch();
  }, {passive: false});
  canvas.addEventListener('keydown', event => {
    if (event.ctrlKey || event.metaKey || event.altKey || !stage.scene) return;
    const move = (right, up) => event.shiftKey ? camera.pan(right, up) : camera.orbit(right, up);
    const moves = {ArrowLeft: () => move(-kKeyStep, 0), ArrowRight: () => move(kKeyStep, 0),
      ArrowUp: () => move(0, kKeyStep), ArrowDown: () => move(0, -kKeyStep),
      a: () => camera.orbit(-kKeyStep, 0), d: () => camera.orbit(kKeyStep, 0),
      w: () => camera.orbit(0, kKeyStep), s: () => camera.orbit(0, -kKeyStep),
      '+': () => camera.zoom(1), '=': () => camera.zoom(1), '-': () => camera.zoom(-1), ...on};
    const known = moves[event.key];
    if (!known) return;
    event.preventDefault();
    known();
    stage.touch();
  });
}
