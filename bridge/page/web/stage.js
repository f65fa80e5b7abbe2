// SPDX-License-Identifier: Apache-2.0
// When and how finely pictures are drawn: only what changed, one at a time, coarser while things
// move where the machine would fall below ten pictures a second.
import {eyeViews, OrbitCamera} from './camera.js';
import {kToolRoom} from './constants.js';
import {contextOf, enableExtensions} from './gl.js';
import {sameHand} from './hand.js';
import {mix} from './math.js';
import {Painter} from './painter.js';
import {sceneIn} from './scene.js';

const kBudgetMs = 85;      // of one picture while things move: ten a second with some room
const kRestMs = 250;       // without motion: the picture is drawn finely again
const kScales = [1, 1 / 2, 1 / 3, 1 / 4, 1 / 6, 1 / 8];
const kMostPixels = 4096;  // of a side
const kTaught = 10000;     // pixels of a picture whose time is that of its pixels

export class Stage {
  /** `trouble(text)` says why there is no picture; '' where there is one again. Throws as contextOf. */
  constructor(canvas, trouble) {
    Object.assign(this, {canvas, trouble});
    this.gl = contextOf(canvas);
    this.camera = new OrbitCamera();
    this.look = {kinds: [], iso: null, opacities: {}, clip: {on: false, axis: 2, at: 0.5}, stereo: false};
    this.scale = 1;
    this.costMs = 0;  // of a pixel of volumes
    this.share = 0;   // of a picture that is drawn again where the camera rests
    this.untaught = 0;
    this.shown = 0;   // pictures
    this.moved = this.changed = -Infinity;
    this.stale = true;
    canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      this.painter = null;
      trouble('The graphics card took the picture away; waiting for it.');
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.fence = null;
      trouble('');
      enableExtensions(this.gl);
      if (this.scene) this.rebuild();
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
    if (!same) this.home();
    this.rebuild();
  }
  home() {
    if (this.scene) this.camera.frame(this.scene.corners, this.aspect);
    this.touch();
  }
  /** The renderer of a volume: iso or blend. */
  kindOf(volume) {
    return this.look.kinds[volume] ?? 'iso';
  }
  rebuild() {
    this.painter?.free();
    this.painter = null;
    this.stale = true;
    this.untaught = 2;
    try {
      this.painter = new Painter(this.gl, sceneIn(this.scene, this.look), v => this.kindOf(v));
    } catch (problem) {
      this.trouble(`${problem.message}.`);
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
      this.trouble('');
      this.rebuild();
    } else if (this.look.opacities !== before.opacities) {
      this.painter?.setMaterials(sceneIn(this.scene, this.look).materials);
    }
    this.touch();
  }
  /** Camera or look are others now. */
  touch() {
    this.stale = true;
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
    if (!this.isFree() || !this.painter || this.canvas.clientWidth < 2) return;
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
    const moves = !sameHand(this.hand, this.drawn);
    if (moves || boxes.length > 0) this.changed = now;
    const eyes = this.look.stereo ? 2 : 1;
    const wide = Math.floor(width / eyes);
    const before = this.scale;
    this.chooseScale(eyes * wide * height, now);
    if (!this.stale && !moves && this.scale === before && boxes.length === 0) {
      if (now - Math.max(this.moved, this.changed) > kRestMs) this.tell('at rest');
      return;
    }
    this.tell('moving');
    const size = [wide, height].map(n => Math.max(Math.round(n * this.scale), 1));
    const all = this.painter.fit(eyes, ...size) || this.stale;
    const hand = this.hand ?? null;
    const began = performance.now();
    let pixels = 0;
    this.views(wide, height).forEach((view, i) => {
      pixels += this.painter.draw(i, view, hand, this.drawn, all ? null : boxes);
    });
    this.painter.show(width, height);
    const share = pixels / (eyes * size[0] * size[1]);
    if (!all) this.share = mix(this.share, share, 0.1);
    this.fence = {sync: gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), began, pixels};
    gl.flush();
    this.drawn = hand;
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
    const tookMs = performance.now() - fence.began;
    // The first pictures of a painter pay for its shaders.
    if (this.untaught > 0) --this.untaught;
    else if (fence.pixels > 0) {
      const cost = tookMs / fence.pixels;  // of few pixels: at most
      if (this.costMs === 0) this.costMs = cost;
      else if (fence.pixels >= kTaught || cost < this.costMs) this.costMs = mix(this.costMs, cost, 0.4);
    }
    return true;
  }

  /** The finest scale at which pictures stay within the budget: whole ones while the camera moves,
   * else the share of them that tool and cuts change. At rest all of it, whatever it costs. */
  chooseScale(pixels, now) {
    const turns = this.stale || now - this.moved < kRestMs;
    if (!turns && now - this.changed > kRestMs) {
      this.scale = 1;
      return;
    }
    const cost = this.costMs * pixels * (turns ? 1 : this.share);
    const fits = scale => cost * scale * scale <= kBudgetMs;
    const best = kScales.find(fits) ?? kScales.at(-1);
    // Finer again only with room to spare, so that it does not go to and fro.
    if (best < this.scale || cost * best * best * 1.3 <= kBudgetMs) this.scale = best;
  }
}
