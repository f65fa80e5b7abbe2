// SPDX-License-Identifier: Apache-2.0
// The page: the bridge's news go to the stage and the panel, the user's wishes to both and back.
import {address, copyLink} from './address.js';
import {CommandKind, kLastOfPass, kMayCommand, kRunEnded, kTwoArms, records, ReplyStatus} from './constants.js';
import {Link} from './link.js';
import {missing} from './missing.js';
import {bannerOf, isStale, LookControls, Plot, showBanner, showFigures} from './panel.js';
import {materialOf, solidFrom, sceneView} from './scene.js';
import {listen, Stage} from './stage.js';
import {handOf} from './tool.js';
import {SharedView} from './views.js';
import {recordAt} from './wire.js';

const kFiguresMs = 200;
const kSureMs = 3000;
const kWanted = new Set(['tick', 'start_ns', 'flags', 'position_mm', 'orientation', 'commanded_force_n',
  'proxy_offset_mm', 'active_tool', 'phase', 'fault', 'penetration_mm']);
const element = id => document.getElementById(id);

const plot = new Plot(element('plot'));
const now = {record: null, second: null, frame: null, ended: false, newRun: 0, earlier: null, takenNs: null, lost: false,
  beatMs: 0,   // the servo's last sign of life, by performance.now()
  wheelMs: -Infinity};  // a wheel over the picture that was not its own
let stage = null, scene = null, held = null;
// For a page around this one, as web/page/try.js.
export {link, now, stage};
export const heldNow = () => held;

const link = new Link({
  state(text, trouble) {
    if (trouble) now.lost = true;
    if (element('state').textContent === text) return;  // it would be read out again
    element('state').textContent = text;
    element('state').classList.toggle('trouble', trouble);
    document.body.dataset.state = trouble ? 'trouble' : text;
  },
  hello(news, sameRun) {
    if (!sameRun) {
      now.newRun = held ? performance.now() : 0;
      Object.assign(now, {record: null, second: null, ended: false, frame: null, earlier: null, takenNs: null});
      plot.clear();
      scene = null;
    }
    held = news;
    element('teaching').hidden = !(held.hello.flags & kMayCommand);
    element('presents').hidden = 'scene' in address.keys;  // in a tab there is nobody to follow
    this.state('joining', false);
  },
  frame(news, frame) {
    now.frame = frame;
    const beatNs = frame.heartbeatNs > 0n ? frame.heartbeatNs : frame.takenNs;
    now.beatMs = performance.now() - Math.max(link.clock.ageMs(beatNs), 0);
    now.ended = (frame.flags & kRunEnded) !== 0;
    if (!(frame.flags & kLastOfPass)) return;
    if (!scene) begin();
    const wasLost = now.lost;
    now.takenNs = frame.takenNs;
    now.lost = false;
    document.body.dataset.tick = frame.tick;
    this.state(now.ended ? 'ended' : isStale(frame) ? 'stale' : 'live', false);
    if (wasLost) tellBanner();
  },
  records(message) {
    if (message.record !== 'TickRecord') return;
    for (let i = 0; i < message.count; ++i) {
      const [record, second = null] = Array.from({length: message.arms}, (_, arm) => recordAt('TickRecord',
        message.view, (i * message.arms + arm) * records.TickRecord.bytes, kWanted));
      if (now.record && record.tick <= now.record.tick) continue;
      Object.assign(now, {record, second});
      plot.add(record);
      if (!now.earlier || record.start_ns - now.earlier[0].start_ns > 1000000000n) {
        now.earlier = now.earlier ? [now.earlier[1], record] : [record, record];
      }
    }
    if (stage) stage.hands = now.second ? [handOf(now.record), handOf(now.second)] : [handOf(now.record)];
  },
  view(message) {
    views?.take(message);
    element('follows').hidden = !views?.known;
  },
  reply({sequence, status}) {
    const answer = {[ReplyStatus.accepted]: 'done', [ReplyStatus.busy]: 'busy, try again'}[status] ?? 'refused';
    element('reply').textContent = `${wishes.get(sequence) ?? 'command'}: ${answer}`;
    wishes.delete(sequence);
  },
});

// After the link, so that the volumes are on their way meanwhile.
try {
  stage = new Stage(element('picture'), why => missing('picture', why));
} catch (problem) {
  missing('picture', `${problem.message} The figures are shown without a picture.`);
}
const look = new LookControls(stage);
const views = stage && new SharedView(stage, {send: view => link.sendView(view), follow: element('follow'),
  present: element('present'), say: text => element('presenter').textContent = text});

/** All of a run's volumes are here. */
function begin() {
  scene = sceneView(held);
  scene.materialOf = materialOf(scene.materials);
  scene.solidFrom = solidFrom(scene.materials);
  for (const choice of ['tool', 'tool2']) {
    element(choice).replaceChildren(...scene.tools.map((tool, i) => new Option(tool.name, i)));
  }
  element('second').hidden = !(held.hello.flags & kTwoArms);
  stage?.setScene(scene);
  element('copied').textContent = look.begin(scene);
}

/** mm3 by material, in the order of the scene; what has none last. */
function removedByMaterial() {
  const names = ['no material', ...scene.materials.slice(1).map(one => one.name)];
  const mm3 = new Array(names.length).fill(0);
  for (const view of scene.volumes) {
    const voxels = view.volume.removedVoxels(scene.materialOf, names.length, label => scene.solidFrom(label, view.iso));
    voxels.forEach((value, m) => mm3[m] += value * view.voxelMm3);
  }
  const rows = names.map((name, m) => [name, mm3[m]]);
  return [...rows.slice(1), rows[0]];
}

function tellBanner() {
  showBanner(bannerOf(now, performance.now() - now.beatMs));
}

let shownBefore = 0, figuresBefore = performance.now();
function showNews() {
  const at = performance.now();
  const picturesHz = stage ? 1000 * (stage.shown - shownBefore) / (at - figuresBefore) : 0;
  shownBefore = stage?.shown ?? 0;
  figuresBefore = at;
  const {record, second, earlier} = now;
  const span = record && earlier ? Number(record.start_ns - earlier[0].start_ns) : 0;
  const news = !now.ended && !now.lost && !isStale(now.frame);
  showFigures({record, picturesHz, late: held?.late ?? false,
    tool: record && scene?.tools[record.active_tool]?.name,
    second: {record: second, tool: second && scene?.tools[second.active_tool]?.name},
    removed: scene ? removedByMaterial() : [],
    servoHz: span > 0 && news ? 1e9 * Number(record.tick - earlier[0].tick) / span : null,
    ageMs: now.takenNs && news ? Math.max(link.clock.ageMs(now.takenNs), 0) : null});
  tellBanner();
  plot.draw();
  for (const [id, of] of [['tool', record], ['tool2', second]]) {
    if (of && document.activeElement !== element(id)) element(id).value = of.active_tool;
  }
}
setInterval(showNews, kFiguresMs);

// What is sent back, where that is allowed.

const wishes = new Map();  // by the number under which a command was sent
function wish(name, kind, argument, arm = 0) {
  const number = link.send(kind, argument, arm);
  if (number) wishes.set(number, name);
  element('reply').textContent = `${name}: ${number ? 'sent' : 'not connected'}`;
}
element('tool').addEventListener('change', ({target}) => wish('tool', CommandKind.select_tool, Number(target.value)));
element('tool2').addEventListener('change', ({target}) =>
  wish("second arm's tool", CommandKind.select_tool, Number(target.value), 1));
element('hold').addEventListener('click', () => wish('hold', CommandKind.hold, 1));
element('go').addEventListener('click', () => wish('go on', CommandKind.hold, 0));
const reset = element('reset');
reset.hidden = CommandKind.reset === undefined;
let sure = 0;
reset.addEventListener('click', () => {
  if (sure) wish('reset', CommandKind.reset, 0);
  clearTimeout(sure);
  const forget = () => {
    sure = 0;
    reset.classList.remove('sure');
    reset.textContent = 'reset the tooth';
  };
  if (sure) return forget();
  reset.classList.add('sure');
  reset.textContent = 'all that was cut is lost: press again';
  sure = setTimeout(forget, kSureMs);
});

if (stage) {
  const toggled = id => element(id).click();
  listen(stage, {r: () => stage.home(), v: () => look.nextRenderer(), c: () => toggled('clip'),
    t: () => toggled('stereo')}, () => now.wheelMs = performance.now());
}
// A token in the address has done its work once the page is here: a cookie holds it.
if (location.search) history.replaceState(null, '', location.pathname + location.hash);
address.refusers.push(why => missing('address', why));
address.hearers.push(values => {
  element('copied').textContent = look.take(values);
});
address.parts.push(() => look.pairs());
address.start();
element('copy').addEventListener('click', () => copyLink(element('link'), element('copied'),
  'scene' in address.keys ? '' : '; another browser needs the token of the bridge too'));
