// SPDX-License-Identifier: Apache-2.0
// What the address says of a run: the scene, whose hand, keys of the scene, when it ends and how fast it goes.
import {numberIn} from './address.js';
import {scenes} from './scenes.js';

const kLongestS = 1e6, kShortestS = 0.001;
const kSlowest = 0.01, kFastest = 100;

const oneOf = names => ({may: names.join(', '), read: text => names.find(name => name === text)});
/** A number in these limits, or 0. */
const zeroOr = (low, high) => text => numberIn(text, 0, 0) ?? numberIn(text, low, high);

export const runKeys = {
  scene: oneOf(scenes.map(({name}) => name)),
  hand: oneOf(['script', 'mine']),
  set: {many: true, may: 'KEY=VALUE, as force.stiffness_n_per_mm=0.4', read: text => {
    const at = text.indexOf('=');
    return at > 0 && at < text.length - 1 ? [text.slice(0, at), text.slice(at + 1)] : undefined;
  }},
  seconds: {may: `0, which has no end, or a number from ${kShortestS} to ${kLongestS}`, read: zeroOr(kShortestS, kLongestS)},
  pace: {may: `0, as fast as it can, or a number from ${kSlowest} to ${kFastest}`, read: zeroOr(kSlowest, kFastest)},
};

/** Of the controls: by the id of one, the key of the scene. */
export const controlKeys = {stiffness: 'force.stiffness_n_per_mm', damping: 'force.damping_ns_per_mm',
  stabiliser: 'force.stabiliser', rate: 'servo.rate_hz'};

/** A run as pairs of an address; `sets` is a map of keys and values. */
export function runPairs({scene, hand, sets, seconds, pace}) {
  return [['scene', scene], ...(hand === 'mine' ? [['hand', hand]] : []), ...[...sets].map(([key, value]) => ['set', `${key}=${value}`]),
    ...(seconds > 0 ? [['seconds', String(seconds)]] : []), ...(pace === 1 ? [] : [['pace', String(pace)]])];
}
