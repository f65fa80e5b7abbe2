// SPDX-License-Identifier: Apache-2.0
// Beside the picture: figures, plot and banner; and the controls of the look, as in the visualizer's own
// panel: a renderer for each volume, iso value, opacity of each material, clip plane, stereo.
import {kFaults, kFlagDeviceFault, kFlagForbidden, kFlagRefused, kFlagShaft, kFullForceN, kIsoRange,
  kLeastFullDepthMm, kLeastFullForceN, kOpacityRange, kPhases, kSpanS, kStaleMs, Lifecycle} from './constants.js';
import {viewOf} from './address.js';
import {length} from './math.js';
import {mainVolume} from './scene.js';
import {defaultOpacity} from './transfer_function.js';

const kNewRunMs = 4000;
const kHintMs = 3000;
const element = id => document.getElementById(id);

/** A time as a person says it. */
export function spanText(ms) {
  const s = Math.floor(ms / 1000);
  if (s < 120) return `${s} s`;
  return s < 7200 ? `${Math.floor(s / 60)} min` : `${Math.floor(s / 3600)} h`;
}

/** Whether the servo was silent when the bridge looked last. */
export const isStale = frame => frame !== null && frame.heartbeatNs > 0n &&
  Number(frame.takenNs - frame.heartbeatNs) / 1e6 > kStaleMs;

/** What is urgent in a record, as {text, alarm}; null: nothing. */
function alarmOf(record) {
  if (record && record.flags & kFlagDeviceFault) {
    const [name, meaning] = kFaults[record.fault] ?? ['unknown', ''];
    return {text: `Fault ${name}: ${meaning}; ${kPhases[5][1]}.`, alarm: true};
  }
  if (record && record.flags & kFlagRefused) {
    return {text: 'No free place for this tool here, so it feels nothing: lead it into air.', alarm: true};
  }
  return null;
}
/** Likewise what is not. */
function adviceOf(record) {
  if (record && record.flags & kFlagForbidden) return {text: 'Pressed on what may not be cut.', alarm: false};
  if (record && record.flags & kFlagShaft) return {text: 'The shaft touches: it cuts nothing.', alarm: false};
  return null;
}
const ofSecond = news => news && {...news, text: `Second arm: ${news.text}`};

/** What is to be said large over the picture: {text, old, alarm}; null where there is nothing. `old`: by
 * how much the picture is, from `silentMs` since the servo's last sign of life. */
export function bannerOf({record, second, frame, takenNs, ended, newRun, lost, wheelMs}, silentMs) {
  const old = ` This picture is ${spanText(silentMs)} old.`;
  if (lost && takenNs !== null && !ended) return {text: 'No news from the bridge.', old, alarm: true};
  if (ended) {
    return frame.lifecycle === Lifecycle.clean_end ?
      {text: 'The controller has ended: this is the final state.', alarm: false} :
      {text: 'The controller is gone: this is its last state.', old, alarm: true};
  }
  if (isStale(frame)) return {text: 'Stale: no news from the servo.', old, alarm: true};
  const alarm = alarmOf(record) ?? ofSecond(alarmOf(second));
  if (alarm) return alarm;
  if (frame?.lifecycle === Lifecycle.hold) return {text: 'Held: no cutting and no force.', alarm: false};
  const advice = adviceOf(record) ?? ofSecond(adviceOf(second));
  if (advice) return advice;
  if (newRun && performance.now() - newRun < kNewRunMs) return {text: 'A new run has begun.', alarm: false};
  if (performance.now() - wheelMs < kHintMs) return {text: 'Click into the picture: then the wheel is its own.', alarm: false};
  return null;
}

export function showBanner(banner) {
  const to = element('banner');
  to.hidden = !banner;
  // Only a new text is read out, not each second of its age.
  if (banner && to.firstChild.textContent !== banner.text) to.firstChild.textContent = banner.text;
  to.lastChild.textContent = banner?.old ?? '';
  to.classList.toggle('alarm', banner?.alarm ?? false);
}

/** Rows of [label, value, is a part]. */
function showRows(rows) {
  const list = element('figures');
  while (list.children.length > 2 * rows.length) list.lastChild.remove();
  while (list.children.length < 2 * rows.length) {
    list.append(document.createElement('dt'), document.createElement('dd'));
  }
  rows.forEach(([label, value, part], i) => {
    const [dt, dd] = [list.children[2 * i], list.children[2 * i + 1]];
    dt.classList.toggle('part', part === true);
    if (dt.textContent !== label) dt.textContent = label;
    if (dd.textContent !== value) dd.textContent = value;
  });
}

/** Force, tool and state of the second arm. */
function secondRows(second) {
  if (!second?.record) return [];
  const {commanded_force_n, fault, phase} = second.record;
  const [state] = fault ? kFaults[fault] ?? ['fault'] : kPhases[phase] ?? ['–'];
  return [['second arm', `${length(commanded_force_n).toFixed(2)} N`], ['its tool', second.tool ?? '–', true],
    ['its state', state, true]];
}

/** `removed`: [[name, mm3]...]. `second`: {record, tool} of the second arm, if there is one. */
export function showFigures({record, tool, second, removed, late, servoHz, picturesHz, ageMs}) {
  const force = record ? length(record.commanded_force_n) : 0;
  element('force').textContent = record ? `${force.toFixed(2)} N` : '–';
  const bar = element('bar');
  Object.assign(bar, {max: kFullForceN, low: 0.5 * kFullForceN, high: 0.9 * kFullForceN, optimum: 0, value: force});
  const sum = removed.reduce((all, [, mm3]) => all + mm3, 0);
  const mm3 = value => `${Math.abs(value) < 0.005 ? '0.00' : value.toFixed(2)} mm³`;
  const rows = [['tool', tool ?? '–'],
    ['depth', record ? `${record.penetration_mm.toFixed(2)} mm` : '–'],
    ...secondRows(second),
    [late ? 'removed since joining' : 'removed', mm3(sum)]];
  for (const [name, value] of removed) if (Math.abs(value) >= 0.005) rows.push([name, mm3(value), true]);
  rows.push(['servo', servoHz ? `${servoHz.toFixed(0)} Hz` : '–'], ['pictures', `${picturesHz.toFixed(0)} /s`],
    ['data age', ageMs === null ? '–' : ageMs < 1000 ? `${ageMs.toFixed(0)} ms` : `${(ageMs / 1000).toFixed(1)} s`]);
  showRows(rows);
}

/** Force and depth over the last seconds: points {ns, force, depth}, oldest first. */
export class Plot {
  constructor(canvas) {
    this.canvas = canvas;
    this.points = [];
  }
  clear() {
    this.points = [];
  }
  add(record) {
    const ns = Number(record.start_ns);
    if (this.points.length > 0 && ns <= this.points.at(-1).ns) return;
    this.points.push({ns, force: length(record.commanded_force_n), depth: record.penetration_mm});
    const oldest = this.points.findIndex(point => ns - point.ns <= kSpanS * 1e9);
    if (oldest > 512 || oldest > this.points.length / 2) this.points.splice(0, oldest);
  }
  draw() {
    const {canvas} = this;
    const ratio = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    if (wide === 0) return;
    Object.assign(canvas, {width: Math.round(wide * ratio), height: Math.round(high * ratio)});
    // Drawn by the processor: where GL is software, two lines by it cost more than the tooth.
    const to = canvas.getContext('2d', {willReadFrequently: true});
    to.scale(ratio, ratio);
    const style = getComputedStyle(document.documentElement);
    const colour = name => style.getPropertyValue(name);
    const half = high / 2;
    this.curve(to, 0, wide, half, 'force', 'N', 'force', kLeastFullForceN, colour('--calm'), colour);
    this.curve(to, half, wide, half, 'depth', 'mm', 'depth', kLeastFullDepthMm, colour('--strong'), colour);
  }
  curve(to, top, wide, high, name, unit, key, leastFull, stroke, colour) {
    const words = 18, tall = high - words - 4;
    const last = this.points.at(-1)?.ns ?? 0;
    const seen = this.points.filter(point => last - point.ns <= kSpanS * 1e9);
    const peak = seen.reduce((most, point) => Math.max(most, point[key]), 0);
    const full = Math.max(peak, leastFull);
    to.font = `12px ${getComputedStyle(document.body).fontFamily}`;
    to.textBaseline = 'middle';
    to.fillStyle = colour('--soft');
    to.fillText(`${name}, ${kSpanS} s, peak`, 0, top + words / 2);
    to.textAlign = 'right';
    to.fillStyle = colour('--ink');
    to.fillText(`${peak.toFixed(2)} ${unit}`, wide, top + words / 2);
    to.textAlign = 'left';
    to.fillStyle = colour('--ground');
    to.fillRect(0, top + words, wide, tall);
    to.strokeStyle = stroke;
    to.lineWidth = 1.5;
    to.lineJoin = 'round';
    to.beginPath();
    for (const point of seen) {
      const x = wide * (1 - (last - point.ns) / (kSpanS * 1e9));
      to.lineTo(x, top + words + 1 + (tall - 2) * (1 - Math.max(point[key], 0) / full));
    }
    to.stroke();
  }
}

const kKinds = {iso: 'iso: surface', blend: 'blend: inside'};
const kIsoStep = 0.01;
const kLeastOpacity = 0.001;  // its slider goes in equal ratios from here on, and has 0 at its left end

const opacityAt = share => share <= 0 ? 0 : kLeastOpacity ** (1 - share) * kOpacityRange[1];
const shareOf = opacity => opacity < kLeastOpacity ? 0 : 1 - Math.log(opacity) / Math.log(kLeastOpacity);

/** A slider with what it says beside it; `taken(value)` when it is let go. */
function slider(id, label, [low, high], step, at, text, taken) {
  const row = document.createElement('label');
  const input = Object.assign(document.createElement('input'), {id, type: 'range', min: low, max: high, step});
  const says = document.createElement('output');
  input.value = at;
  const show = () => {
    says.textContent = text(Number(input.value));
    input.setAttribute('aria-valuetext', says.textContent);
  };
  input.addEventListener('input', show);
  input.addEventListener('change', () => taken(Number(input.value)));
  show();
  row.append(label, input, says);
  return row;
}

export class LookControls {
  /** `stage` null: there is no picture to look at. */
  constructor(stage) {
    this.stage = stage;
    const readClip = () => {
      const axis = Number(document.querySelector('input[name="axis"]:checked').value);
      element('plane').hidden = !element('clip').checked;
      stage?.setLook({clip: {on: element('clip').checked, axis, at: Number(element('place').value)}});
    };
    element('clip').addEventListener('change', readClip);
    element('plane').addEventListener('input', readClip);
    element('stereo').addEventListener('change', ({target}) => {
      stage?.setLook({stereo: target.checked});
      stage?.home();
    });
    element('home').addEventListener('click', () => stage?.home());
  }

  /** The look of an address: what it does not name is as at the start. Returns what is wrong with it in this scene; ''. */
  take({show = [], iso = null, opacity = {}, clip = null, stereo = false, view = null}) {
    const {axis, at} = clip ?? {axis: 2, at: 0.5};
    element('clip').checked = clip !== null;
    for (const choice of document.querySelectorAll('input[name="axis"]')) choice.checked = Number(choice.value) === axis;
    element('place').value = at;
    element('plane').hidden = clip === null;
    element('stereo').checked = stereo;
    this.stage?.setLook({kinds: show, iso, opacities: opacity, clip: {on: clip !== null, axis, at}, stereo});
    this.stage?.showFrom(view && viewOf(view));
    return this.scene ? this.build(this.scene) : '';
  }
  /** The look as pairs of an address. */
  pairs() {
    if (!this.stage) return [];
    const {look: {kinds, iso, opacities, clip, stereo}, viewText} = this.stage;
    const all = {view: viewText, show: kinds.some(kind => kind !== 'iso') ? kinds.join() : '', iso: iso ?? '',
      opacity: Object.entries(opacities).map(([name, value]) => `${name}:${value}`).join(),
      clip: clip.on ? `${'xyz'[clip.axis]}:${clip.at}` : '', stereo: stereo ? 'on' : ''};
    return Object.entries(all).filter(([, text]) => text !== '').map(([name, text]) => [name, String(text)]);
  }

  /** Of a scene that is shown from now on; opacities of what it lacks are left out. Returns what is wrong with the look; ''. */
  begin(scene) {
    const why = this.build(scene), has = ([name]) => scene.materials.some(material => material.name === name);
    if (why) this.stage.setLook({opacities: Object.fromEntries(Object.entries(this.stage.look.opacities).filter(has))});
    return why;
  }
  build(scene) {
    this.scene = scene;
    if (!this.stage) return '';
    const {look} = this.stage;
    const names = scene.materials.slice(1).map(({name}) => name);
    const strange = Object.keys(look.opacities).find(name => !names.includes(name));
    const choices = scene.volumes.map(({name}, v) => {
      const row = document.createElement('label'), choice = document.createElement('select');
      choice.id = v === 0 ? 'renderer' : `renderer${v}`;
      choice.append(...Object.entries(kKinds).map(([kind, words]) => new Option(words, kind)));
      choice.value = this.stage.kindOf(v);
      choice.addEventListener('change', () => this.setKinds(this.chosen()));
      row.append(scene.volumes.length === 1 ? 'renderer' : name, choice);
      return row;
    });
    element('renderers').replaceChildren(...choices);
    const own = mainVolume(scene).iso / 65535;
    element('isos').replaceChildren(slider('iso', 'iso', kIsoRange, kIsoStep, look.iso ?? own,
      value => value.toFixed(2), iso => this.stage.setLook({iso})));
    const legend = document.createElement('p');
    legend.textContent = 'opacity of 1/8 mm';
    element('opacities').replaceChildren(legend, ...scene.materials.map(({name}, m) => {
      const share = shareOf(look.opacities[name] ?? defaultOpacity(scene.materials, m));
      return slider(`opacity${m}`, name, [0, 1], 0.01, share, at => opacityAt(at).toFixed(3), at =>
        this.stage.setLook({opacities: {...this.stage.look.opacities, [name]: Number(opacityAt(at).toFixed(3))}}));
    }).slice(1));
    this.show();
    return strange !== undefined ? `opacity of ${strange}: no such material here; there are ${names.join(', ')}` : '';
  }

  chosen() {
    return [...element('renderers').querySelectorAll('select')].map(choice => choice.value);
  }
  setKinds(kinds) {
    this.stage.setLook({kinds});
    this.show();
  }
  /** The renderer after that of the first volume, for all. */
  nextRenderer() {
    const kinds = Object.keys(kKinds), choices = [...element('renderers').querySelectorAll('select')];
    if (choices.length === 0) return;
    const next = kinds[(kinds.indexOf(choices[0].value) + 1) % kinds.length];
    for (const choice of choices) choice.value = next;
    this.setKinds(this.chosen());
  }
  /** Only what makes a difference. */
  show() {
    const kinds = this.chosen();
    element('isos').hidden = !kinds.includes('iso');
    element('opacities').hidden = !kinds.includes('blend');
  }
}
