// SPDX-License-Identifier: Apache-2.0
// The thread of the servo: steps a run at the pace of the clock, and posts what a bridge would send.
//
// In:  {module: WebAssembly.Module}   the first of all; answered by {ready: true}
//      {open: inputs, pace, seconds}  another run; pace: seconds of the servo in one of the clock, 0: as fast as it can
//      {up: ArrayBuffer} {join: true} {lead: [mm, rad, button]} {release: true} {pause: bool}
//      {close: true}                  nothing runs any more
//      {log: dropped files}           a recording in place of a run; {replay: what ReplayTurn takes}
// Out: {ready: true} {opened: ms} {down: ArrayBuffer} {facts} {failed: text} {done: facts with volume_hash}
//      {refused: text}: what was dropped is no recording, the run goes on; {reads: folder}; {replayed: facts}
import {KerfModule} from './kerf_module.js';
import {readyFiles, recordingIn, ReplayTurn} from './replay_turn.js';

const kSlotMs = 1000 / 60;
const kBusyMs = 12;     // of a slot; the rest is for messages
const kBatch = 8;       // ticks between two looks at the clock
const kBehindMs = 100;  // of the servo's time: more is not made up for
const kFactsMs = 200;

let compiled = null, kerf = null;
let given;
const begun = new Promise(resolve => given = resolve);  // with the module; where it cannot be had, the page says why
let joined = false;  // there is a viewer: the page's own modules may come after the run
let opening = 0;     // counts what was asked for: files are read meanwhile
let hidden = false;  // the page is in the background
let run = null;  // {turn} of a recording, or {pace, mostArmed, dueTicks, lookedMs, factsMs, factsTicks, busyMs, allMs, steps, paused, ended}
const now = () => performance.now();

function post(messages) {
  for (const message of messages) postMessage({down: message}, [message]);
}
function postNews(ended = false) {
  if (joined) post(kerf.news(ended));
}

/** What throws ends the run with a line on the page, never the worker. */
function attempt(what) {
  try {
    what();
  } catch (problem) {
    kerf = run = null;
    // A trap of the module has no words of its own; the memory of a tab is what runs out.
    const trapped = problem instanceof WebAssembly.RuntimeError;
    postMessage({failed: trapped ? `memory: none is left for this run, or the module has a fault (${problem.message}); ` +
      'close other tabs, or take another scene' : problem.message});
  }
}

function open({open: inputs, pace = 1, seconds = 0}) {
  ++opening;
  kerf = null;  // before the next one is made: each takes some 100 MB
  const began = now();
  kerf = new KerfModule(compiled);
  kerf.open(inputs);
  const at = now();
  run = {pace, mostArmed: seconds > 0 ? Math.max(Math.round(seconds * kerf.rateHz), 1) : 0, dueTicks: 0, lookedMs: at, factsMs: at, factsTicks: 0,
    busyMs: 0, allMs: 0, steps: 0, paused: hidden, ended: false};
  postMessage({opened: at - began});
  postNews();
  tellFacts(at);
}

async function openLog({log}) {
  await begun;
  let folder, ready;
  try {
    folder = recordingIn(log);
  } catch (problem) {
    return postMessage({refused: problem.message});
  }
  const mine = ++opening;
  const began = now();
  kerf = run = null;  // a second recording ends the first
  postMessage({reads: folder});
  try {
    ready = await readyFiles(log);
  } catch (problem) {
    return mine === opening && postMessage({failed: problem.message});
  }
  if (mine !== opening) return;
  attempt(() => {
    const next = new KerfModule(compiled);
    next.openReplay(ready);
    kerf = next;
    run = {turn: new ReplayTurn(kerf, replayed => postMessage({replayed})), paused: hidden};
    postMessage({opened: now() - began});
    postNews();
  });
}

function tellFacts(at) {
  const facts = kerf.facts();
  const wall = at - run.factsMs;
  postMessage({facts: {...facts, times_real_time: wall > 0 ? (facts.ticks - run.factsTicks) / facts.rate_hz / (wall / 1000) : 0,
    us_a_tick: run.steps > 0 ? 1000 * run.busyMs / run.steps : 0}});
  Object.assign(run, {factsMs: at, factsTicks: facts.ticks, busyMs: 0, steps: 0});
}

/** Steps for which the clock says it is time, as far as a slot has room. */
function advance(began) {
  const perMs = run.pace * kerf.rateHz / 1000;
  run.dueTicks = Math.min(run.dueTicks + (began - run.lookedMs) * perMs, kBehindMs * perMs);
  run.lookedMs = began;
  while (!run.ended && (run.pace === 0 || run.dueTicks >= 1) && now() - began < kBusyMs) {
    const asked = run.pace === 0 ? kBatch : Math.min(kBatch, Math.floor(run.dueTicks));
    const made = kerf.step(asked, run.mostArmed);
    run.dueTicks -= made;
    run.steps += made;
    run.ended = made < asked;
  }
  run.busyMs += now() - began;
  run.allMs += now() - began;
}

/** News go out without a step too: they are the sign of life that the page waits for. */
function slot() {
  if (run.turn) {
    run.turn.slot(run.paused);
    return postNews();
  }
  const began = now();
  const before = run.ended;
  if (!run.paused && !run.ended) advance(began);
  postNews(run.ended);
  const ends = run.ended && !before;
  if (ends || (!run.ended && now() - run.factsMs >= kFactsMs)) tellFacts(now());
  if (!ends) return;
  const facts = kerf.facts();
  postMessage({done: {...facts, volume_hash: kerf.volumeHash(), times_real_time: 1000 * facts.ticks / facts.rate_hz / run.allMs,
    us_a_tick: 1000 * run.allMs / facts.ticks}});
}

function turn() {
  const began = now();
  if (run) attempt(slot);
  const hurries = (run?.turn ? run.turn.hurries : run?.pace === 0 && !run.ended) && !run.paused;
  setTimeout(turn, hurries ? 0 : Math.max(kSlotMs - (now() - began), 0));
}

const takes = {
  module: ({module}) => {
    compiled = module;
    postMessage({ready: true});
    given();
    turn();
  },
  open: message => open(message),
  up: ({up}) => {
    kerf.take(up);
    post(kerf.waiting());
  },
  join: () => {
    joined = true;
    if (!kerf) return;  // its first run greets it
    kerf.join();
    postNews();
  },
  lead: ({lead}) => kerf.lead(...lead),
  release: () => kerf.release(),
  close: () => {
    ++opening;
    kerf = run = null;
  },
  replay: ({replay}) => run.turn?.take(replay),
  pause: ({pause}) => {
    hidden = pause;
    if (!run) return;
    Object.assign(run, {paused: pause, lookedMs: now()});
    run.turn?.lookAgain();
  },
};

onmessage = ({data}) => {
  if ('log' in data) return openLog(data);
  const kind = Object.keys(takes).find(name => name in data);
  if (kerf || ['module', 'open', 'join', 'pause'].includes(kind)) attempt(() => takes[kind](data));
};
