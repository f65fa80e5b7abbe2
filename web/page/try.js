// SPDX-License-Identifier: Apache-2.0
// The page without a bridge: a worker of this tab is controller, device and hand; what it sends is what a bridge sends, so
// picture, panel and commands are the bridge's own page. Here are the controls of the run itself.
//
// In the address behind #, and written there as the controls change: scene=NAME, hand=script or mine, seconds=S (then it ends
// and its hashes stand here), pace=0 (as fast as it can), set=KEY=VALUE (may be given often); and the look (address.js).
import {address} from './address.js';
import {missing} from './missing.js';
import {ReplayControls} from './replay.js';
import {controlKeys, runKeys, runPairs} from './run_keys.js';
import {texts} from './scene_texts.js';
import {scenes} from './scenes.js';
import {broken, compiled, lack, worker} from './servo.js';
import {TabSocket} from './tab_socket.js';

const element = id => document.getElementById(id);
const state = {ready: false, given: false, replays: false, asked: 0, page: null, steering: null, worker, shown: null, replay: null,
  told: {text: 'loading', trouble: false}, sets: new Map(), seconds: 0, pace: 1};  // sets: what differs from the scene's own values, by key

/** What the link does not know: there is no run, or not yet. It speaks again with the hello of the next one. */
function tell(text, trouble = false) {
  state.told = {text, trouble};
  state.page?.link.expectHello();
  element('state').textContent = text;
  element('state').classList.toggle('trouble', trouble);
  document.body.dataset.state = trouble ? 'trouble' : text;
}
/** Without what is lacking nothing will ever run. */
function refuse(text) {
  missing('page', text);
  tell('not started', true);
}

// -- Controls

const slider = (id, label, low, high, step, value) => `<label class="slider">${label}
  <input id="${id}" type="range" min="${low}" max="${high}" step="${step}" value="${value}"><output>${value}</output></label>`;
const kControls = `<legend>This run, in your browser</legend>
  <label>scene <select id="scene"></select></label>
  <label>hand <select id="hand"><option value="script">a script</option><option value="mine">yours</option></select></label>
  <label class="tick" id="finger-row"><input id="finger" type="checkbox" checked> a finger presses</label>
  ${slider('stiffness', 'stiffness, N/mm', 0.1, 1.5, 0.05, 0.4)}
  ${slider('damping', 'damping, N s/mm', 0, 0.005, 0.0005, 0.002)}
  <label>stabiliser <select id="stabiliser"><option value="none">none</option><option>energy_bounding</option>
    <option>passivity</option></select></label>
  <label>rate <select id="rate"><option>500</option><option selected>1000</option><option>2000</option></select></label>
  <div class="row"><button id="again" type="button">start again</button></div>
  <p id="run-state" role="status"></p>
  <dl id="run-figures"></dl>`;

const kHow = element('how').textContent;
const kHowMine = 'Arrow keys lead the tool, page up and page down take it deeper and back, the space bar pushes and cuts. ' +
  'W, A, S and D turn the view, shift and arrow keys move it, plus and minus zoom.';

function addControls() {
  const fields = document.createElement('fieldset');
  fields.id = 'run';
  fields.innerHTML = kControls;
  element('teaching').before(fields);
  element('scene').replaceChildren(...scenes.map(({name, title}) => new Option(title, name)));
  for (const id of ['scene', 'hand', 'stabiliser', 'rate']) element(id).addEventListener('change', start);
  for (const id of ['stiffness', 'damping']) {
    const input = element(id);
    input.addEventListener('input', () => input.nextElementSibling.textContent = input.value);
    input.addEventListener('change', start);
  }
  state.replay = new ReplayControls({worker: state.worker, refused, ask}, fields);
  element('finger').addEventListener('change', ({target}) => state.steering && (state.steering.fingersPress = target.checked));
  element('again').addEventListener('click', start);
  const keys = element('keys');
  keys.insertAdjacentHTML('afterbegin', `<dt>hand yours: pointer, one finger</dt><dd>lead the tool</dd>
    <dt>press</dt><dd>push and cut</dd><dt>wheel</dt><dd>tool nearer, farther</dd>
    <dt>arrows, page up and down</dt><dd>lead the tool</dd><dt>space</dt><dd>push and cut</dd>
    <dt>right or shift drag, two fingers</dt><dd>the view, as below</dd>`);
}

// -- The address

const run = () => ({scene: element('scene').value, hand: element('hand').value, sets: state.sets, seconds: state.seconds, pace: state.pace});
const runText = () => JSON.stringify(runPairs(run()));

/** Another address: a run begins if it is not the one that is here. */
function take({scene = 'phantom', hand = 'script', set = [], seconds = 0, pace = 1}) {
  const before = runText();
  element('scene').value = scene;
  element('hand').value = hand;
  Object.assign(state, {sets: new Map(set), seconds, pace});
  if (document.body.dataset.run === 'refused' || runText() !== before) start();
}
/** Nothing runs then. */
function refuseAddress(why) {
  missing('address', why);
  if (!why) return;
  ask();
  state.worker.postMessage({close: true});
  state.steering?.start(false);
  failed(why);
  tell('not started', true);
  document.body.dataset.run = 'refused';
}

/** The sliders show what the run has, until they are moved. */
function showOwnValues({force, servo}) {
  for (const [id, own] of [['stiffness', force.stiffness_n_per_mm], ['damping', force.damping_ns_per_mm]]) {
    const input = element(id);
    input.disabled = own === undefined;  // of another law, or of the paper's force
    if (own === undefined) continue;
    input.value = own;
    input.nextElementSibling.textContent = own;
  }
  for (const [id, own] of [['rate', servo.rate_hz], ['stabiliser', state.sets.get(controlKeys.stabiliser) ?? 'none']]) {
    const choice = element(id);
    if (![...choice.children].some(({value}) => value === String(own))) choice.append(new Option(own, own));
    choice.value = own;
  }
}

const isMine = () => element('hand').value === 'mine';

/** Counts what the user asks for. Returns whether this is still the newest. */
function ask() {
  const mine = ++state.asked;
  return () => mine === state.asked;
}

/** Before the worker is given the module nothing is sent: the controls are read once it is. */
function start(event) {
  const {target} = event ?? {};
  if (target && address.refused) address.refuse('');
  if (target?.id === 'scene') {
    state.sets.clear();  // they were of the other scene
    if (state.page?.stage) state.page.stage.wanted = null;
  } else if (target?.id in controlKeys) {
    state.sets.set(controlKeys[target.id], target.value);
  }
  if (!state.given || address.refused) return;
  ask();
  state.replay.close();
  state.replays = false;
  const {name, hand} = scenes.find(one => one.name === element('scene').value);
  const mine = isMine();
  element('how').textContent = mine ? kHowMine : kHow;
  element('finger-row').style.display = mine && matchMedia('(any-pointer: coarse)').matches ? '' : 'none';
  element('run-state').textContent = 'loading the scene';
  document.body.dataset.run = 'loading';
  missing('run', '');
  tell('loading the scene');
  state.steering?.start(mine);
  const path = `scenes/${name}.toml`;
  state.worker.postMessage({
    open: {name: path, scene: texts[path], hand: mine ? '' : texts[`scenes/hands/${hand}.toml`], pedal: mine,
      settings: [...state.sets].map(([key, value]) => `${key}=${value}`)},
    pace: state.pace, seconds: state.seconds});
}

/** What was dropped is no recording: the run goes on, or begins now, if the drop came before it. */
function refused(text) {
  const {run} = document.body.dataset;
  if (run === undefined || (run === 'loading' && !state.replays)) start();
  element('run-state').textContent = text;
  document.body.dataset.refused = text;
}

function failed(text) {
  state.replay.close();
  state.replays = false;
  element('run-state').textContent = text;
  if (!address.refused) missing('run', text);
  tell('the run has failed', true);
  document.body.dataset.run = 'failed';
  element('run-figures').replaceChildren();
}

// -- What the worker says

function showFacts(facts) {
  document.body.dataset.removedMm3 = facts.removed_density_mm3.toFixed(3);  // the panel shows it, by material
  const number = (value, digits, unit) => `${value.toFixed(digits)} ${unit}`;
  const rows = [['servo time', number(facts.armed_ticks / facts.rate_hz, 1, 's')],
    ['times real time', facts.times_real_time.toFixed(2)],
    ['a tick takes', number(facts.us_a_tick, 0, 'µs')],
    ['energy taken', number(facts.absorbed_mj, 2, 'mJ')],
    ...Object.entries(facts.energy_mj).filter(([, mj]) => Math.abs(mj) >= 0.005).map(([name, mj]) => [`· ${name}`, number(mj, 2, 'mJ')]),
    ['output hash', facts.output_hash]];
  if (facts.volume_hash) rows.push(['volume hash', facts.volume_hash]);
  showRows(rows);
}

function showRows(rows) {
  element('run-figures').replaceChildren(...rows.flatMap(([label, value]) => {
    const pair = [document.createElement('dt'), document.createElement('dd')];
    [pair[0].textContent, pair[1].textContent] = [label, value];
    return pair;
  }));
}

const says = {
  ready: () => {
    state.ready = true;
  },
  opened: ({opened}) => {
    element('run-state').textContent = `loaded in ${(opened / 1000).toFixed(1)} s`;
    document.body.dataset.run = 'runs';
    document.body.dataset.loadMs = Math.round(opened);
  },
  down: ({down}) => TabSocket.take(down),
  facts: ({facts}) => {
    showFacts(facts);
    const held = state.page?.heldNow() ?? null;
    if (held !== state.shown && document.body.dataset.state === 'live') {
      showOwnValues(held.sceneJson);
      state.shown = held;
    }
    document.body.dataset.timesRealTime = facts.times_real_time.toFixed(2);
    document.body.dataset.handLed = facts.hand_led;
  },
  done: ({done}) => {
    showFacts(done);
    element('run-state').textContent = 'the run has ended; its time is that of the steps alone';
    Object.assign(document.body.dataset, {run: 'done', outputHash: done.output_hash, volumeHash: done.volume_hash,
      timesRealTime: done.times_real_time.toFixed(2)});
  },
  refused: ({refused: text}) => refused(text),
  reads: ({reads: folder}) => {
    if (address.refused) address.refuse('');
    state.replays = true;
    missing('run', '');
    tell('loading the recording');
    state.steering?.start(false);
    state.replay.begin(folder);
    element('finger-row').style.display = 'none';
    element('run-state').textContent = `reads ${folder}`;
    document.body.dataset.run = 'loading';
  },
  // One that was under way when a run was asked for is late.
  replayed: ({replayed}) => state.replays && showRows(state.replay.show(replayed)),
  failed: ({failed: text}) => failed(text),
};

/** The bridge's page, with a link to the worker, which loads the scene meanwhile. */
async function begin() {
  TabSocket.worker = state.worker;
  globalThis.WebSocket = TabSocket;
  element('state').textContent = state.told.text;
  // This thread makes the picture's context while the worker loads the scene, not before it has got one to load.
  const [{Steering}, {KeySteering}] = await Promise.all([import('./steering.js'), import('./key_steering.js'), compiled.catch(() => {})]);
  state.page = await import('./kerf.js');
  if (!state.page.link.greeted) tell(state.told.text, state.told.trouble);  // the link has said since that it waits
  if (!state.page.stage) return;
  state.steering = new Steering(state.page, state.worker);
  new KeySteering(state.steering, element('picture'));
  state.steering.start(isMine() && !state.replays);
}

if (lack) {
  refuse(lack);
} else {
  broken.then(({message}) => state.ready ? failed(`the servo of this tab has ended (${message}); load the page again`) :
    refuse(`The servo of this tab did not start. ${whyNotStarted()} If all of that is so, use a newer browser: this one has no modules in workers.`));
  state.worker.onmessage = ({data}) => {
    // Of a run that was on its way as the address was refused.
    if (address.refused && state.ready && !('reads' in data || 'refused' in data)) return;
    Object.keys(data).forEach(kind => says[kind]?.(data));
  };
  const tellHidden = () => state.worker.postMessage({pause: document.hidden});
  document.addEventListener('visibilitychange', tellHidden);
  if (document.hidden) tellHidden();
  addControls();
  Object.assign(address, {keys: {...runKeys, ...address.keys}, parts: [() => runPairs(run()), ...address.parts],
    hearers: [take, ...address.hearers], refusers: [refuseAddress, ...address.refusers]});
  address.read();
  // It takes the run behind the module, before this thread is busy with the picture.
  compiled.then(module => {
    state.worker.postMessage({module});
    state.given = true;
    if (state.asked === 0 || document.body.dataset.run === 'refused') start();
  }, problem => refuse(problem.message));
  begin().catch(problem => refuse(whyNotStarted(problem)));
}
