// SPDX-License-Identifier: Apache-2.0
// A recording in the page: how it comes in, and the controls of its replay. The worker steps it (replay_turn.js).
import {chosenFiles, droppedFiles} from './dropped_files.js';

// A file that is dropped beside, or too early, must not take the place of the page.
for (const kind of ['dragover', 'drop']) addEventListener(kind, event => event.preventDefault());

const element = id => document.getElementById(id);
const kWays = `<p id="replay-ways">Replay a recording: drop its folder on the page, or choose its
    <button id="choose-folder" type="button">folder</button> or <button id="choose-files" type="button">files</button></p>
  <input id="folder-input" type="file" webkitdirectory hidden><input id="files-input" type="file" multiple hidden>`;
const kPlayer = `<div id="replay" hidden>
    <label class="slider">tick <input id="replay-at" type="range" min="1" max="1" step="1" value="1"><output></output></label>
    <div class="row"><button id="replay-play" type="button">pause</button><button id="replay-step" type="button"
      aria-label="one tick on">step</button><button id="replay-slower" type="button" aria-label="half as fast">½×</button>
      <button id="replay-faster" type="button" aria-label="twice as fast">2×</button></div>
    <p id="replay-found" role="status"></p>
    <button id="replay-there" type="button" hidden>go to the first difference</button>
  </div>`;

const speedText = speed => speed === 0 ? 'as fast as it can' : speed < 1 ? `1/${1 / speed} of real time` :
  speed === 1 ? 'real time' : `${speed} times real time`;

/** What the comparison has found so far, in the words of kerf-replay. */
export function foundText({compared, difference, last_tick, cut_short, first_tick, earlier_tick}) {
  if (last_tick === undefined) return `steps the ticks before the recording: ${earlier_tick} of ${first_tick - 1}`;
  const end = cut_short ? `; stopped: ${cut_short}` : '';
  if (difference) return `first difference: ${difference}${end}`;
  const count = compared + 1 - first_tick;
  return compared === last_tick ? `${count} ticks, each equal to the last bit${end}` :
    `first difference: none up to tick ${compared} of ${last_tick}${end}`;
}

export class ReplayControls {
  /** `page`: {worker, refused(text), ask()}; `ask` returns a function that says whether nothing was asked for since. The
   *  controls stand in its box `fields`. */
  constructor(page, fields) {
    Object.assign(this, {page, facts: null, folder: '', holdsSlider: false});
    fields.querySelector('legend').insertAdjacentHTML('afterend', kPlayer);
    element('run-state').insertAdjacentHTML('beforebegin', kWays);
    const on = (id, kind, what) => element(id).addEventListener(kind, what);
    for (const kind of ['folder', 'files']) {
      const input = element(`${kind}-input`);
      on(`choose-${kind}`, 'click', () => input.click());
      input.addEventListener('change', () => {
        const {files} = input;
        this.open(async () => chosenFiles(files)).finally(() => input.value = '');  // the same one may be chosen again
      });
    }
    on('replay-play', 'click', () => this.ask({play: !this.facts?.playing}));
    on('replay-step', 'click', () => this.ask({one: true}));
    on('replay-slower', 'click', () => this.ask({faster: 0.5}));
    on('replay-faster', 'click', () => this.ask({faster: 2}));
    on('replay-there', 'click', () => this.ask({play: false, go: this.facts.difference_tick}));
    on('replay-at', 'input', ({target}) => {
      this.holdsSlider = true;
      this.ask({play: false, go: Number(target.value)});
    });
    on('replay-at', 'change', () => this.holdsSlider = false);
    this.listenToDrops();
  }

  listenToDrops() {
    const hasFiles = event => event.dataTransfer?.types.includes('Files');
    const marks = on => document.body.classList.toggle('drops', on);
    addEventListener('dragover', event => {
      if (!hasFiles(event)) return;
      event.dataTransfer.dropEffect = 'copy';
      marks(true);
    });
    addEventListener('dragleave', event => event.relatedTarget === null && marks(false));
    addEventListener('drop', event => {
      if (!hasFiles(event)) return;
      marks(false);
      const files = droppedFiles(event.dataTransfer);
      this.open(() => files);
    });
  }

  async open(files) {
    const isNewest = this.page.ask();
    try {
      const log = await files();
      if (isNewest()) this.page.worker.postMessage({log});
    } catch (problem) {
      this.page.refused(problem.message || `${problem.name}: cannot be read; drop it again`);
    }
  }

  ask(replay) {
    if (this.facts) this.page.worker.postMessage({replay});
  }

  /** A recording is on its way. */
  begin(folder) {
    this.close();
    this.folder = folder;
  }
  /** Nothing is replayed any more. */
  close() {
    this.facts = null;
    element('again').textContent = 'start again';
    element('replay').hidden = true;
    element('run').classList.remove('replays');
    for (const name of ['replayTick', 'replayState', 'replayFound', 'outputHash', 'volumeHash']) delete document.body.dataset[name];
  }

  /** Rows for the figures. */
  show(facts) {
    this.facts = facts;
    const {tick, first_tick: first, last_tick: last, tick_ns: ns, playing, speed, goal} = facts;
    element('replay').hidden = false;
    element('run').classList.add('replays');
    element('again').textContent = 'a run of its own again';
    element('replay-play').textContent = playing ? 'pause' : 'play';
    const slider = element('replay-at');
    if (last !== undefined) {
      Object.assign(slider, {min: first, max: last});
      if (!this.holdsSlider) slider.value = goal || tick;
      slider.nextElementSibling.textContent = `${tick} of ${last}, ${(tick * ns * 1e-9).toFixed(3)} s`;
    }
    const found = element('replay-found'), text = foundText(facts);
    found.setAttribute('aria-live', playing ? 'off' : 'polite');  // each count would be read out
    if (found.textContent !== text) found.textContent = text;
    found.classList.toggle('differs', Boolean(facts.difference));
    element('replay-there').hidden = !facts.difference;
    Object.assign(document.body.dataset, {replayTick: tick ?? '', replayState: last === undefined || goal ? 'goes' :
      playing ? 'plays' : 'rests', replayFound: text, outputHash: facts.output_hash ?? '', volumeHash: facts.volume_hash ?? ''});
    return [['recording', this.folder], ['speed', goal ? `goes to tick ${goal}` : playing ? speedText(speed) : `${speedText(speed)}, paused`],
      ...(playing ? [['times real time', facts.times_real_time.toFixed(2)]] : []),
      ...(facts.output_hash ? [['output hash', facts.output_hash]] : []),
      ...(facts.second_output_hash ? [['of the second arm', facts.second_output_hash]] : []),
      ...(facts.volume_hash ? [['volume hash', facts.volume_hash]] : [])];
  }
}
