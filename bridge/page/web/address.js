// SPDX-License-Identifier: Apache-2.0
// What stands in the address behind #, as key=value: a link shows the same picture. What the page does not know in it is
// refused in one line with what it may be.
import {kIsoRange} from './constants.js';

const kWriteMs = 500;      // browsers allow a hundred changes of the address in 30 s
const kMostSaid = 40;      // characters of a value
const kDegree = Math.PI / 180;
const kFarMm = 10000;

/** A decimal number from `low` to `high`; undefined: it is none. */
export function numberIn(text, low, high) {
  const value = /^[+-]?(\d+\.?\d*|\.\d+)$/.test(text) ? Number(text) : NaN;
  return value >= low && value <= high ? value : undefined;
}
const all = values => values.includes(undefined) ? undefined : values;

/** Of the look of a picture. Each key: `may` says what it may be, `read` makes a value of its text (undefined: none). */
const lookKeys = {
  view: {may: 'YAW,PITCH,DISTANCE,X,Y,Z: degrees, degrees up to 89, mm above 0 and mm', read: text => {
    const parts = text.split(',');
    const limits = [[-360, 360], [-89, 89], [0.01, kFarMm], ...Array(3).fill([-kFarMm, kFarMm])];
    return parts.length === limits.length ? all(parts.map((part, i) => numberIn(part, ...limits[i]))) : undefined;
  }},
  show: {may: 'iso or blend for each volume, with commas between', read: text =>
    all(text.split(',').map(kind => ['iso', 'blend'].find(known => known === kind)))},
  iso: {may: `a number from ${kIsoRange[0]} to ${kIsoRange[1]}`, read: text => numberIn(text, ...kIsoRange)},
  opacity: {may: 'MATERIAL:NUMBER from 0 to 1, with commas between', read: text => {
    const pairs = all(text.split(',').map(part => {
      const at = part.lastIndexOf(':'), value = numberIn(part.slice(at + 1), 0, 1);
      return at > 0 && value !== undefined ? [part.slice(0, at), value] : undefined;
    }));
    return pairs && Object.fromEntries(pairs);
  }},
  clip: {may: 'x, y or z, a colon, and a number from 0 to 1', read: text => {
    const axis = text[1] === ':' ? ['x', 'y', 'z'].indexOf(text[0]) : -1, at = numberIn(text.slice(2), 0, 1);
    return axis >= 0 && at !== undefined ? {axis, at} : undefined;
  }},
  stereo: {may: 'on', read: text => text === 'on' ? true : undefined},
};

const said = text => text.length > kMostSaid ? `${text.slice(0, kMostSaid)}…` : text;
const encoded = text => encodeURIComponent(text).replace(/%(2C|3A|3D|2F)/g, decodeURIComponent);

/** Values of the keys that stand in `hash`; of a key with `many` a list. Throws one line. */
export function readHash(hash, keys) {
  const values = {};
  for (const [name, text] of new URLSearchParams(hash.replace(/^#/, ''))) {
    const wrong = why => new Error(`address: ${said(name)}=${said(text)}: ${why}`);
    const key = Object.hasOwn(keys, name) ? keys[name] : null;
    if (!key) throw wrong(`no such key; there are ${Object.keys(keys).join(', ')}`);
    if (name in values && !key.many) throw wrong(`${name} is given twice; leave one of them`);
    const value = key.read(text);
    if (value === undefined) throw wrong(`use ${key.may}`);
    if (key.many) (values[name] ??= []).push(value);
    else values[name] = value;
  }
  return values;
}
/** Pairs of key and text, as they stand behind #; '' if there is none. */
export const hashOf = pairs => pairs.length ? `#${pairs.map(([name, text]) => `${name}=${encoded(text)}`).join('&')}` : '';

/** Degrees and mm as `view` has them. */
export const viewText = ({yaw, pitch, distance, target}) => {
  const turned = yaw / kDegree % 360;
  return [turned, pitch / kDegree, distance, ...target].map(value => String(Number(value.toFixed(2)) + 0)).join(',');
};
export const viewOf = ([yaw, pitch, distance, ...target]) => ({yaw: yaw * kDegree, pitch: pitch * kDegree, distance, target});

/** The address of this page: the look, and what a page around this one adds to `keys` and `parts`. */
export class Address {
  constructor() {
    Object.assign(this, {keys: {...lookKeys}, refused: '',
      parts: [],       // functions that return pairs of what the page has now
      hearers: [],     // are given the values of a new address
      refusers: []});  // are given why it is refused, or '' once it is not
  }
  /** From now on. The address that is there now is the first one. */
  start() {
    addEventListener('hashchange', () => this.read());
    setInterval(() => this.write(), kWriteMs);
    this.read();
  }
  read() {
    let values;
    try {
      values = readHash(location.hash, this.keys);
    } catch (problem) {
      return this.refuse(problem.message);
    }
    if (this.refused) this.refuse('');
    for (const hear of this.hearers) hear(values);
  }
  refuse(why) {
    this.refused = why;
    for (const hear of this.refusers) hear(why);
  }
  /** An address that is refused stays, so that it can be corrected. */
  write() {
    const hash = this.hash();
    if (hash === location.hash) return;
    try {
      history.replaceState(null, '', hash || location.pathname);
    } catch {
      // A frame without an address of its own; `link` has it all the same.
    }
  }
  hash() {
    return this.refused ? location.hash : hashOf(this.parts.flatMap(part => part()));
  }
  link() {
    return location.href.split(/[?#]/)[0] + this.hash();
  }
}
export const address = new Address();

/** Puts the link on the clipboard; says in `line` what came of it. Without a clipboard (a page of http or of a file) it stands
 * in `field`, selected. */
export async function copyLink(field, line, note) {
  address.write();
  field.value = address.link();
  field.hidden = true;
  try {
    await navigator.clipboard.writeText(field.value);
    line.textContent = `link copied${note}`;
  } catch {
    field.hidden = false;
    field.focus();
    field.select();
    line.textContent = document.execCommand?.('copy') ? `link copied${note}` : `copy this address${note}`;
  }
}
