// SPDX-License-Identifier: Apache-2.0
// A recording as the worker steps it: in parts of a slot, so that messages are heard, at the pace of the clock or as fast as
// it can, to a tick and back.
import {findRecording, readyRecording} from './log_files.js';
import {filesInMcap} from './mcap_log.js';

const kBusyMs = 12;     // of a slot; the rest is for messages
const kBatch = 8;       // ticks between two looks at the clock
const kBehindMs = 100;  // of the recording's time: more is not made up for
const kFactsMs = 100;
const kFastest = 64;
const now = () => performance.now();

const bytesOf = async ({file}) => new Uint8Array(await file.arrayBuffer());
/** Read as it is needed: a log of an hour has 2 GB. */
const piecesOf = ({file}) => ({size: file.size, read: (at, length) =>
  new Uint8Array(new FileReaderSync().readAsArrayBuffer(file.slice(at, at + length)))});

/** What the recording among dropped files is called. Throws one line if there is none, or its MCAP has none. */
export function recordingIn(dropped) {
  const {folder, mcap} = findRecording(dropped);
  if (mcap) filesInMcap(piecesOf(mcap), mcap.path);
  return folder;
}

/** Of dropped files, each {path, size, file}; see readyRecording. */
export const readyFiles = dropped => readyRecording(dropped, bytesOf, piecesOf);

export class ReplayTurn {
  /** `kerf` has a recording open. `tell` gets facts for the page: those of TabReplay, and playing, speed, times_real_time,
   *  volume_hash while it stands. */
  constructor(kerf, tell) {
    const at = now();
    Object.assign(this, {kerf, tell, playing: true, speed: 0, isReady: false, dueTicks: 0, lookedMs: at, factsMs: at,
      factsTick: 0, moved: true, stepsDue: 0});
    this.perMs = kerf.rateHz / 1000;
  }

  /** Whether the next slot shall begin at once. */
  get hurries() {
    return !this.isReady || (this.playing && this.speed === 0);
  }

  /** {play: bool}, {speed: seconds of the recording in one of the clock, 0: as fast as it can}, {one: true}: the next
   *  tick alone, after the way to a tick if it is on one, {go: tick}, {faster: factor}. */
  take({play, speed, one, go, faster}) {
    if (speed !== undefined) this.speed = speed;
    if (faster !== undefined) this.speed = Math.min(Math.max((this.speed || 1) * faster, 1 / kFastest), kFastest);
    if (play !== undefined) this.play(play);
    if (go !== undefined) this.go(go);
    if (one) {
      this.playing = false;
      this.stepsDue += 1;
      this.stepByHand();
    }
    this.moved = true;
    this.lookAgain();
  }
  play(on) {
    const {tick, last_tick, first_tick} = this.kerf.facts();
    if (on && this.isReady && tick === last_tick) this.go(first_tick);
    this.playing = on;
  }
  go(tick) {
    this.kerf.replayGo(tick);
    this.isReady = false;
    this.stepsDue = 0;
  }
  /** What was asked for on the way to a tick is done there. */
  stepByHand() {
    if (!this.isReady) return;
    if (this.stepsDue > 0) this.kerf.replayStep(this.stepsDue);
    this.stepsDue = 0;
  }
  /** The time until now counts for nothing: of a pause, a page in the background. */
  lookAgain() {
    this.lookedMs = now();
    this.dueTicks = 0;
  }

  slot(stands) {
    const began = now();
    if (!stands) this.advance(began);
    const at = now();
    const rests = this.isReady && !this.playing;
    if (this.moved && (rests || at - this.factsMs >= kFactsMs)) this.tellFacts(at, rests);
  }

  advance(began) {
    if (this.isReady && this.playing && this.speed > 0) {
      const perMs = this.perMs * this.speed;
      this.dueTicks = Math.min(this.dueTicks + (began - this.lookedMs) * perMs, kBehindMs * perMs + 1);
    }
    this.lookedMs = began;
    while (now() - began < kBusyMs) {
      if (!this.isReady) {
        this.isReady = this.kerf.replayPrepare(kBatch);
        this.moved = true;
        if (this.isReady && this.kerf.replayStopped) this.end();
        this.stepByHand();
      } else {
        const asked = this.speed === 0 ? kBatch : Math.min(kBatch, Math.floor(this.dueTicks));
        if (!this.playing || asked === 0) return;
        const made = this.kerf.replayStep(asked);
        this.dueTicks -= made;
        this.moved = true;
        if (this.kerf.replayStopped) this.end();
      }
    }
  }
  /** At its end, or at the first difference. Played on, or again, at real time: for a person. */
  end() {
    this.playing = false;
    this.stepsDue = 0;
    if (this.speed === 0) this.speed = 1;
  }

  tellFacts(at, rests) {
    const facts = this.kerf.facts();
    const ticks = (facts.tick ?? 0) - this.factsTick, ms = at - this.factsMs;
    const volumes = rests ? {volume_hash: this.kerf.volumeHash()} : {};
    this.tell({...facts, ...volumes, playing: this.playing, speed: this.speed,
      times_real_time: this.playing && ms > 0 ? Math.max(ticks / this.perMs / ms, 0) : 0});
    Object.assign(this, {factsMs: at, factsTick: facts.tick ?? 0, moved: !rests});
  }
}
