// SPDX-License-Identifier: Apache-2.0
// In place of the bridge's WebSocket: the same messages, from a worker of this tab.

/** What link.js uses of a WebSocket. One is open at a time, as the page has one link. */
export class TabSocket {
  static OPEN = 1;
  static CLOSED = 3;
  /** Nothing is connected here: what link.js says is of the tab. */
  static words = {connects: 'waiting for the servo', waits: 'waiting for the servo', silent: 'The servo of this tab is silent.'};
  static worker = null;  // set before the first one
  static current = null;

  constructor() {
    this.readyState = TabSocket.OPEN;
    TabSocket.current = this;
    TabSocket.worker.postMessage({join: true});
    queueMicrotask(() => this.onopen?.());
  }
  send(buffer) {
    if (this.readyState === TabSocket.OPEN) TabSocket.worker.postMessage({up: buffer});
  }
  close() {
    this.readyState = TabSocket.CLOSED;
    if (TabSocket.current === this) TabSocket.current = null;
  }
  /** A message of the worker. */
  static take(data) {
    TabSocket.current?.onmessage?.({data});
  }
}
