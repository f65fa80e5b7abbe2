// SPDX-License-Identifier: Apache-2.0
// The talk with the bridge: joins, acknowledges what it applied, joins again after silence.
import {Held} from './brick_store.js';
import {CloseCode} from './constants.js';
import {ack, command, presentedView, read} from './wire.js';

const kSilenceMs = 3000;     // a bridge that is there sends sixty signs of life a second
const kFirstPauseMs = 250, kLongestPauseMs = 5000;
const kOffsetSpanMs = 10000;

/** A page around this one has its own, as `words` of what takes the place of the socket. */
const kWords = {connects: 'connecting', waits: 'connected; the bridge has no controller yet', gone: 'The bridge is not reached.',
  silent: 'The bridge is silent.'};
const kRefusals = {
  [CloseCode.no_token]: 'No access: open the address as the bridge prints it, with its token.',
  [CloseCode.too_slow]: 'This page was too slow to answer.',
  [CloseCode.not_understood]: 'The bridge does not understand this page; load it again.',
  [CloseCode.too_many]: 'The bridge has as many viewers as it takes.',
};

/**
 * The difference of this machine's clock and the bridge's: the least of what messages took lately,
 * so that an age holds all delays but that of the fastest message. Two spans, since clocks drift.
 */
class ClockOffset {
  constructor() {
    this.now = this.before = Infinity;
    this.began = -Infinity;
  }
  add(localMs, serverNs) {
    if (localMs - this.began > kOffsetSpanMs) {
      this.before = this.now;
      this.now = Infinity;
      this.began = localMs;
    }
    this.now = Math.min(this.now, localMs - Number(serverNs) / 1e6);
  }
  /** Since a time of the bridge's clock. */
  ageMs(serverNs) {
    return performance.now() - Math.min(this.now, this.before) - Number(serverNs) / 1e6;
  }
}

export class Link {
  /** `on`: hello(held, sameRun), frame(held, frame), records(message), reply(message), view(message), state(text, trouble). */
  constructor(on) {
    this.on = on;
    this.words = {...kWords, ...WebSocket.words};
    this.held = null;
    this.sequence = 0;
    this.pause = kFirstPauseMs;
    this.clock = new ClockOffset();
    setInterval(() => this.checkSilence(), 500);
    this.join();
  }

  join() {
    this.greeted = false;
    this.on.state(this.words.connects, false);
    this.heard = performance.now();
    const address = new URL('bridge', location.href);  // below the page's folder, whatever a proxy adds before it
    address.protocol = address.protocol.replace('http', 'ws');
    const socket = this.socket = new WebSocket(address);
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({data}) => this.take(socket, data);
    // A token that is none will not become one.
    socket.onclose = ({code}) => this.lost(socket, kRefusals[code], code !== CloseCode.no_token);
    socket.onopen = () => {
      this.heard = performance.now();
      this.on.state(this.words.waits, false);
    };
  }

  lost(socket, why, again = true) {
    if (socket !== this.socket) return;
    this.socket = null;
    socket.onclose = socket.onmessage = null;
    socket.close();
    this.clock = new ClockOffset();  // the machine may be another now
    if (!again) return this.on.state(why, true);
    const next = Math.ceil(this.pause / 1000);
    this.on.state(`${why ?? this.words.gone} Trying again in ${next} s.`, true);
    setTimeout(() => this.join(), this.pause);
    this.pause = Math.min(this.pause * 1.6, kLongestPauseMs);
  }

  checkSilence() {
    const {socket} = this;
    if (!socket || performance.now() - this.heard < kSilenceMs) return;
    // An open one without a hello waits for a controller.
    if (socket.readyState === WebSocket.OPEN && !this.greeted) return;
    this.lost(socket, this.words.silent);
  }

  take(socket, data) {
    if (socket !== this.socket) return;
    this.heard = performance.now();
    try {
      const message = read(data);
      this[message.kind](message);
    } catch (problem) {
      console.error(problem);
      this.lost(socket, `${problem.message}.`);
    }
  }

  hello(message) {
    const before = this.held;
    this.greeted = true;
    this.clock.add(this.heard, message.serverNs);
    this.held = new Held(message, before);
    this.on.hello(this.held, before?.hello.session === message.session);
  }
  frame(message) {
    if (!this.held) throw new Error('frame: before the hello');
    if (!this.greeted) return;  // of an earlier connection: this one does not know its number
    this.clock.add(this.heard, message.sentNs);
    this.held.apply(message);
    this.socket.send(ack(message.session, message.frame));
    this.pause = kFirstPauseMs;
    this.on.frame(this.held, message);
  }
  records(message) {
    if (this.greeted && message.session === this.held.hello.session) this.on.records(message);
  }
  reply(message) {
    this.on.reply(message);
  }

  view(message) {
    this.on.view(message);
  }

  /** Another run is loaded behind the same socket: until its hello, silence is none. */
  expectHello() {
    this.greeted = false;
  }

  /** The number of the command, which its reply names; 0 where there is no connection. */
  send(kind, argument, arm = 0) {
    if (this.socket?.readyState !== WebSocket.OPEN) return 0;
    this.socket.send(command(kind, argument, ++this.sequence, arm));
    return this.sequence;
  }

  /** The view that is presented from here; null: no longer. */
  sendView(view) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(presentedView(view));
  }
}
