// SPDX-License-Identifier: Apache-2.0
// A recording in the tab: how many of its ticks are stepped for the time that goes by, and what is said of them.
import assert from 'node:assert/strict';
import test from 'node:test';
import {clock, openPage} from './fake_page.mjs';

openPage('<body></body>');
const {foundText} = await import('./replay.js');
const {ReplayTurn} = await import('./replay_turn.js');

/** A recording of ticks 1 to 100000 at 1 kHz, whose steps take no time; the way to a tick ends at once. */
class Recording {
  rateHz = 1000;
  tick = 1;
  replayStopped = false;
  facts() { return {tick: this.tick, first_tick: 1, last_tick: 100_000}; }
  volumeHash() { return 'hash'; }
  replayPrepare() { return true; }
  replayGo(tick) { this.tick = tick, this.replayStopped = false; }
  replayStep(ticks) {
    clock.ms += ticks * 0.001;
    const made = Math.min(ticks, 100_000 - this.tick);
    this.tick += made;
    this.replayStopped = this.tick === 100_000;
    return made;
  }
}
function rig() {
  const kerf = new Recording(), told = [];
  const turn = new ReplayTurn(kerf, facts => told.push(facts));
  turn.slot(false);
  const slots = ms => {
    for (const end = clock.ms + ms; clock.ms < end;) {
      clock.ms += 16;
      turn.slot(false);
    }
  };
  return {kerf, told, turn, slots};
}

test('at real time a second is a thousand ticks; half as fast, twice as fast, up to 64 times', () => {
  for (const [asked, ticks] of [[[{speed: 1}], 1000], [[{speed: 1}, {faster: 0.5}], 500], [[{speed: 1}, {faster: 2}, {faster: 2}], 4000],
    [[{speed: 1}, ...Array(9).fill({faster: 2})], 64_000]]) {
    const {kerf, turn, slots} = rig();
    for (const one of asked) turn.take(one);
    const before = kerf.tick;
    slots(1000);
    assert.ok(Math.abs(kerf.tick - before - ticks) < 0.04 * ticks + 8, `${kerf.tick - before} and not ${ticks}`);
  }
});

test('a pause stands, a step is one tick, a tick is gone to, and play at the end begins again', () => {
  const {kerf, told, turn, slots} = rig();
  turn.take({play: false});
  const {tick} = kerf;
  slots(300);
  assert.equal(kerf.tick, tick);
  assert.deepEqual([told.at(-1).playing, told.at(-1).volume_hash], [false, 'hash']);
  turn.take({one: true});
  assert.equal(kerf.tick, tick + 1);
  turn.take({go: 99_990});
  turn.take({play: true});
  turn.take({speed: 1});
  slots(100);
  assert.deepEqual([kerf.tick, turn.playing], [100_000, false]);
  turn.take({play: true});
  slots(100);
  assert.ok(kerf.tick < 200 && turn.playing);
});

test('a page in the background makes up for nothing', () => {
  const {kerf, turn, slots} = rig();
  turn.take({speed: 1});
  clock.ms += 60_000;
  const {tick} = kerf;
  slots(16);
  assert.ok(kerf.tick - tick <= 120, `${kerf.tick - tick}`);
});

test('what was found is said in the words of kerf-replay', () => {
  const all = {compared: 100, last_tick: 100, first_tick: 11};
  assert.equal(foundText(all), '90 ticks, each equal to the last bit');
  assert.equal(foundText({...all, compared: 40}), 'first difference: none up to tick 40 of 100');
  assert.equal(foundText({...all, difference: 'tick 12, phase'}), 'first difference: tick 12, phase');
  assert.equal(foundText({...all, cut_short: 'the log ends'}), '90 ticks, each equal to the last bit; stopped: the log ends');
  assert.equal(foundText({earlier_tick: 3, first_tick: 11}), 'steps the ticks before the recording: 3 of 10');
});
