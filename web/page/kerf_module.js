// SPDX-License-Identifier: Apache-2.0
// kerf.wasm as an object of JavaScript: for the worker of the page, and for tests in Node.
import {LogFiles} from './log_files.js';

const kNoSuchCall = 52;  // ENOSYS of WASI
const decoder = new TextDecoder(), encoder = new TextEncoder();

/** One instance of the module: one run after the other. An error of a run ends the instance. */
export class KerfModule {
  /** `compiled`: a WebAssembly.Module. */
  constructor(compiled) {
    const imports = {};
    for (const {module, name} of WebAssembly.Module.imports(compiled)) {
      imports[module] ??= {};
      imports[module][name] = () => kNoSuchCall;
    }
    this.files = new LogFiles(this);
    Object.assign(imports.wasi_snapshot_preview1, this.system(), this.files.calls());
    imports.kerf.failed = (at, bytes) => {
      throw new Error(this.textAt(at, bytes));
    };
    this.instance = new WebAssembly.Instance(compiled, imports);
    this.calls = this.instance.exports;
    this.calls._initialize();
  }

  /** The calls of WASI that kerf makes: a clock, random numbers, lines to the console. */
  system() {
    const view = () => new DataView(this.calls.memory.buffer);
    return {
      clock_time_get: (clock, precision, to) => {
        view().setBigUint64(to, BigInt(Math.round(performance.now() * 1e6)), true);
        return 0;
      },
      random_get: (to, bytes) => {
        crypto.getRandomValues(new Uint8Array(this.calls.memory.buffer, to, bytes));
        return 0;
      },
      fd_write: (file, list, count, written) => {
        let bytes = 0, text = '';
        for (let i = 0; i < count; ++i) {
          const length = view().getUint32(list + 8 * i + 4, true);
          text += this.textAt(view().getUint32(list + 8 * i, true), length);
          bytes += length;
        }
        console.error(text);
        view().setUint32(written, bytes, true);
        return 0;
      },
      // No environment.
      environ_sizes_get: (count, bytes) => {
        view().setUint32(count, 0, true);
        view().setUint32(bytes, 0, true);
        return 0;
      },
      environ_get: () => 0,
      proc_exit: code => {
        throw new Error(`kerf.wasm: ended with ${code}; load the page again`);
      },
    };
  }

  bytesAt(at, bytes) {
    return new Uint8Array(this.calls.memory.buffer, at, bytes);
  }
  textAt(at, bytes) {
    return decoder.decode(this.bytesAt(at, bytes).slice());
  }
  /** What a call left in the module's buffer. */
  left(bytes) {
    return this.bytesAt(this.calls.room(0), bytes);
  }

  /** Loads a scene: {name, scene, hand, device, pedal, settings}. Throws an error with one line. */
  open({name, scene, hand, device = 'omni', pedal = false, settings = []}) {
    const texts = [name, scene, hand, device, pedal ? 'pedal' : '', ...settings];
    const bytes = encoder.encode(texts.map(text => `${text}\0`).join(''));
    this.bytesAt(this.calls.room(bytes.length), bytes.length).set(bytes);
    this.calls.open_run(bytes.length);
  }
  /** Loads a recording, as readyRecording returns it: see TabReplay. Throws an error with one line. */
  openReplay({folder, files}) {
    this.files.mount(files);
    const bytes = encoder.encode(folder);
    this.bytesAt(this.calls.room(bytes.length), bytes.length).set(bytes);
    this.calls.open_replay(bytes.length);
    this.files.forget(`${folder}/volumes/`);  // the module has them, unpacked
  }
  /** Whether all is done that comes before a tick is shown; at most so many ticks of it. */
  replayPrepare(ticks) {
    return this.calls.replay_prepare(ticks) !== 0;
  }
  replayStep(ticks) {
    return this.calls.replay_step(ticks);
  }
  /** Whether the last step met the end or the first difference; the way to a tick, that difference. */
  get replayStopped() {
    return this.calls.replay_stopped() !== 0;
  }
  replayGo(tick) {
    this.calls.replay_go(tick);
  }
  /** Up to `ticks` steps, not beyond `mostArmed` armed ticks (0: no bound); how many were made. */
  step(ticks, mostArmed = 0) {
    return this.calls.step(ticks, mostArmed);
  }
  get rateHz() {
    return this.calls.rate_hz();
  }
  /** The messages that are due to the viewer, as an array of ArrayBuffers; sixty times a second. */
  news(ended = false) {
    this.calls.slot(ended ? 1 : 0);
    return this.waiting();
  }
  /** Those that an acknowledgement or a command has let through. */
  waiting() {
    const messages = [];
    for (let bytes = 0; (bytes = this.calls.next_message()) !== 0;) messages.push(this.left(bytes).slice().buffer);
    return messages;
  }
  /** A message of the viewer. */
  take(buffer) {
    const bytes = new Uint8Array(buffer);
    this.bytesAt(this.calls.room(bytes.length), bytes.length).set(bytes);
    if (!this.calls.take_message(bytes.length)) throw new Error('a message of the page: of no known kind; load the page again');
  }
  /** A viewer that begins anew. */
  join() {
    this.calls.join_viewer();
  }
  /** A point of the world, mm; yaw and pitch of the tool, rad. */
  lead([x, y, z], [yaw, pitch], button) {
    this.calls.lead(x, y, z, yaw, pitch, button ? 1 : 0);
  }
  release() {
    this.calls.release();
  }
  /** See TabRun::facts. */
  facts() {
    return JSON.parse(decoder.decode(this.left(this.calls.facts()).slice()));
  }
  volumeHash() {
    return decoder.decode(this.left(this.calls.volume_hash()).slice());
  }
}
