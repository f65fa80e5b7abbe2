// SPDX-License-Identifier: Apache-2.0
// As much of a browser as the page's modules ask for, so that they run under Node: elements of index.html, events with
// capture and bubbling, a clock and timers that stand until a test moves them, a socket, and a WebGL that notes what it draws.

/** Milliseconds; the page reads them as performance.now(). */
export const clock = {ms: 1000};
const intervals = [], timeouts = [], frames = [];

class Names {
  list = new Set();
  add(name) { this.list.add(name); }
  remove(name) { this.list.delete(name); }
  contains(name) { return this.list.has(name); }
  toggle(name, on = !this.list.has(name)) { on ? this.list.add(name) : this.list.delete(name); }
}

export class Element {
  constructor(tag, attributes = {}) {
    this.tagName = tag.toUpperCase();
    Object.assign(this, {children: [], parentElement: null, textContent: '', value: '', hidden: false, checked: false,
      dataset: {}, style: {}, classList: new Names(), listeners: [], attributes: {}, clientWidth: 0, clientHeight: 0});
    for (const [name, value] of Object.entries(attributes)) {
      this.attributes[name] = value;
      if (!['class', 'style'].includes(name)) this[name] = ['hidden', 'checked'].includes(name) ? true : value;
    }
  }
  set innerHTML(html) { this.replaceChildren(...elementsOf(html)); }
  insertAdjacentHTML(where, html) {
    if (where === 'afterbegin') this.children.unshift(...elementsOf(html, this));
    else this.beside(where === 'afterend' ? 1 : 0, elementsOf(html, this.parentElement));
  }
  before(one) {
    one.parentElement = this.parentElement;
    this.beside(0, [one]);
  }
  beside(after, more) {
    const {children} = this.parentElement;
    children.splice(children.indexOf(this) + after, 0, ...more);
  }
  get nextElementSibling() { return this.parentElement.children[this.parentElement.children.indexOf(this) + 1]; }
  querySelector(tag) { return this.querySelectorAll(tag)[0] ?? null; }
  focus() {
    document.activeElement = this;
    this.fire('focus');
  }
  select() {}
  get firstChild() { return this.children[0]; }
  get lastChild() { return this.children.at(-1); }
  append(...more) {
    for (const one of more) {
      const child = typeof one === 'string' ? Object.assign(new Element('#text'), {textContent: one}) : one;
      child.parentElement = this;
      this.children.push(child);
    }
  }
  replaceChildren(...more) {
    this.children = [];
    this.append(...more);
    if (this.tagName === 'SELECT') this.value = more[0]?.value ?? '';
  }
  remove() {
    const {parentElement} = this;
    parentElement.children = parentElement.children.filter(one => one !== this);
  }
  setAttribute(name, value) { this.attributes[name] = value; }
  all() { return [this, ...this.children.flatMap(one => one.all())]; }
  querySelectorAll(tag) { return this.all().slice(1).filter(one => one.tagName === tag.toUpperCase()); }
  addEventListener(kind, what, {capture = false} = {}) { this.listeners.push({kind, what, capture}); }
  setPointerCapture() {}
  click() { this.fire('click'); }
  /** As a browser does: from the document down to here in the capturing listeners, then up. Returns the event. */
  fire(kind, values = {}) {
    const event = {type: kind, target: this, buttons: 0, shiftKey: false, ctrlKey: false, metaKey: false, altKey: false,
      deltaMode: 0, stopped: false, prevented: false, ...values,
      preventDefault() { event.prevented = true; }, stopPropagation() { event.stopped = true; }};
    const path = [];
    for (let at = this; at && (at === this || kind !== 'blur'); at = at.parentElement) path.push(at);
    if (this !== view && kind !== 'blur') path.push(view);
    const run = (one, capture) => {
      if (event.stopped && one !== run.at) return;
      run.at = one;
      for (const listener of one.listeners) {
        if (listener.kind === kind && listener.capture === capture) listener.what(event);
      }
    };
    for (const one of path.slice().reverse()) run(one, true);
    for (const one of path) run(one, false);
    return event;
  }
  getContext(kind) { return kind === '2d' ? this.pen ??= new Pen() : this.gl ??= fakeGl(); }
}

/** The window: the end of each event's way. */
export const view = new Element('window');

/** A 2D context: what was written, and the corners of the newest line. */
class Pen {
  texts = [];
  lines = [];
  fillText(text, x, y) { this.texts.push({text, x, y}); }
  beginPath() { this.lines.push([]); }
  lineTo(x, y) { this.lines.at(-1).push([x, y]); }
  scale() {}
  fillRect() {}
  stroke() {}
}

/** A WebGL 2 that takes every call. `draws`: of each drawElements the vertices (x y z of each), and the uniforms in force. */
export function fakeGl() {
  const known = {draws: [], uniforms: {}, array: null, bound: null, isContextLost: () => false, getError: () => 'NO_ERROR',
    getExtension: () => ({}), getParameter: name => name === 'MAX_3D_TEXTURE_SIZE' ? 2048 : 32,
    getProgramParameter: () => true, getUniformLocation: (_, name) => name, clientWaitSync: () => 'ALREADY_SIGNALED',
    createVertexArray: () => ({}), createBuffer: () => ({}),
    bindVertexArray(array) { this.array = array; },
    bindBuffer(target, buffer) {
      this.bound = target === 'ARRAY_BUFFER' ? buffer : null;
      if (this.bound && this.array) this.array.vertices = buffer;
    },
    bufferData(target, data) { if (this.bound) this.bound.data = data; },
    drawElements() {
      const {data} = this.array.vertices, points = [];
      for (let i = 0; i < data.length; i += 6) points.push([data[i], data[i + 1], data[i + 2]]);
      this.draws.push({points, ...this.uniforms});
    }};
  for (const kind of ['1f', '2fv', '3fv', '4fv', '1i']) {
    known[`uniform${kind}`] = function(name, value) { this.uniforms[name] = value; };
  }
  for (const kind of ['3fv', '4fv']) {
    known[`uniformMatrix${kind}`] = function(name, _, value) { this.uniforms[name] = Array.from(value); };
  }
  return new Proxy(known, {get: (object, name) =>
    name in object ? object[name] : typeof name === 'string' && name === name.toUpperCase() ? name : () => ({})});
}

/** The bridge's end is the test: `sent` has what the page sent, `take` hands it a message. */
export class FakeSocket {
  static OPEN = 1;
  static CLOSED = 3;
  static all = [];
  constructor(address) {
    Object.assign(this, {address: String(address), readyState: 0, sent: []});
    FakeSocket.all.push(this);
  }
  open() {
    this.readyState = FakeSocket.OPEN;
    this.onopen();
  }
  send(buffer) { this.sent.push(buffer); }
  take(data) { this.onmessage({data}); }
  close() { this.readyState = FakeSocket.CLOSED; }
}

/** Elements of the tags of `html` that have an end or are void; texts are left out. They are `parent`'s. */
function elementsOf(html, parent = null) {
  const top = new Element('template');
  const open = [top];
  const empty = ['input', 'meta', 'link'];
  for (const [, end, tag, words] of html.matchAll(/<(\/?)([a-z0-9]+)([^>]*)>/g)) {
    if (end) {
      if (open.at(-1).tagName === tag.toUpperCase()) open.pop();
      continue;
    }
    const attributes = Object.fromEntries([...words.matchAll(/([a-z-]+)(?:="([^"]*)")?/g)].map(([, name, value = '']) => [name, value]));
    const element = new Element(tag, attributes);
    open.at(-1).append(element);
    if (!empty.includes(tag)) open.push(element);
  }
  for (const one of top.children) one.parentElement = parent;
  return top.children;
}

export function documentOf(html) {
  const body = new Element('body');
  body.append(...elementsOf(html.split('<body>')[1].split('</body>')[0]));
  const root = new Element('html');
  root.append(body);
  return {body, documentElement: root, hidden: false, addEventListener: (...more) => root.addEventListener(...more), activeElement: body,
    getElementById: id => body.all().find(one => one.id === id) ?? null,
    querySelector: () => body.all().find(one => one.type === 'radio' && one.checked),
    querySelectorAll: () => body.all().filter(one => one.name === 'axis'),
    createElement: tag => Object.assign(new Element(tag), tag === 'script' ? {noModule: false} : {})};
}

/** Makes this process a browser that has opened `html`. The picture is 800 x 600. */
export function openPage(html) {
  const document = documentOf(html);
  const style = {fontFamily: 'sans', getPropertyValue: name => name};
  const give = (name, value) => Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
  give('performance', {now: () => clock.ms});
  give('document', document);
  give('window', globalThis);
  give('devicePixelRatio', 1);
  give('location', {href: 'http://tooth.example:8000/view/', search: '', pathname: '/view/', hash: ''});
  give('history', {replaceState(state, title, to) { location.hash = to.startsWith('#') ? to : ''; }});
  give('WebSocket', FakeSocket);
  give('ResizeObserver', class { observe() {} });
  give('Option', class extends Element {
    constructor(text, value) { super('option'), Object.assign(this, {textContent: text, value: String(value)}); }
  });
  give('getComputedStyle', () => style);
  give('addEventListener', (...more) => view.addEventListener(...more));
  give('requestAnimationFrame', what => frames.push(what));
  give('setInterval', (what, ms) => intervals.push({what, ms, due: clock.ms + ms}));
  give('setTimeout', (what, ms) => timeouts.push({what, due: clock.ms + ms}));
  give('clearTimeout', number => number > 0 && (timeouts[number - 1].what = () => {}));
  const picture = document.getElementById('picture');
  if (picture) Object.assign(picture, {clientWidth: 800, clientHeight: 600});
  return document;
}

/** Time goes by, in steps of 10 ms. */
export function pass(ms) {
  for (const end = clock.ms + ms; clock.ms < end;) {
    clock.ms += 10;
    for (const one of intervals) {
      for (; one.due <= clock.ms; one.due += one.ms) one.what();
    }
    for (const one of timeouts) {
      if (one.due > clock.ms) continue;
      one.due = Infinity;
      one.what();
    }
  }
}
/** The browser draws: each call that waits for it, once. */
export function frame() {
  for (const what of frames.splice(0)) what();
}
