// SPDX-License-Identifier: Apache-2.0
// Messages as bridge/wire/messages.hpp has them, by hand: not by the module that is tested. Both arms of a run with two
// devices come through.
import assert from 'node:assert/strict';
import {kRecordsMagic, kTwoArms, records} from './constants.js';
import {command, read, recordAt} from './wire.js';
import {handOf, sameHands} from './tool.js';

const bytes = records.TickRecord.bytes;
const offsetOf = name => records.TickRecord.fields.find(([field]) => field === name)[1];
function message(ring, arms, ticks) {
  const view = new DataView(new ArrayBuffer(48 + ticks * arms * bytes));
  [kRecordsMagic, 0].forEach((word, i) => view.setUint32(4 * i, word, true));
  view.setBigUint64(8, 7n, true);
  [ring, ticks].forEach((word, i) => view.setUint32(16 + 4 * i, word, true));
  [1, ticks * arms * bytes, ticks * arms * bytes, 0].forEach((word, i) => view.setUint32(32 + 4 * i, word, true));
  for (let i = 0; i < ticks * arms; ++i) {
    const at = 48 + i * bytes;
    view.setBigUint64(at + offsetOf('tick'), BigInt(Math.floor(i / arms) + 1), true);
    view.setUint32(at + offsetOf('active_tool'), i % arms, true);
    view.setFloat64(at + offsetOf('position_mm'), i % arms ? -5 : 5, true);
  }
  return view.buffer;
}
const pairs = read(message(2, 2, 3));
assert.equal(pairs.record, 'TickRecord');
assert.equal(pairs.arms, 2);
assert.equal(pairs.count, 3);
for (let i = 0; i < 3; ++i) {
  const [first, second] = [0, 1].map(arm => recordAt('TickRecord', pairs.view, (2 * i + arm) * bytes));
  assert.equal(first.tick, second.tick);
  assert.deepEqual([first.active_tool, second.active_tool], [0, 1]);
  assert.equal(handOf(first).tip[0], 5);
  assert.equal(handOf(second).tip[0], -5);
}
assert.equal(read(message(0, 1, 4)).arms, 1);
assert.throws(() => read(message(0, 2, 1)), /of no length/);
assert.throws(() => read(message(2, 1, 1)), /of no length/);
assert.equal(kTwoArms, 2);

// kind and arm are 16 bits each; of the first arm the bytes are those of version 1 without arms.
assert.deepEqual([...new Uint8Array(command(1, 3, 9)).slice(4)], [1, 0, 0, 0, 3, 0, 0, 0, 9, 0, 0, 0]);
assert.deepEqual([...new Uint8Array(command(1, 3, 9, 1)).slice(4)], [1, 0, 1, 0, 3, 0, 0, 0, 9, 0, 0, 0]);

const hand = x => ({tip: [x, 0, 0], orientation: [0, 0, 0, 1], tool: 0, force: [0, 0, 0]});
assert.ok(sameHands([hand(1), hand(2)], [hand(1), hand(2)]));
assert.ok(!sameHands([hand(1), hand(2)], [hand(1), hand(3)]));
assert.ok(!sameHands([hand(1)], [hand(1), null]));
assert.ok(!sameHands([hand(1), null], [hand(1), hand(2)]));
