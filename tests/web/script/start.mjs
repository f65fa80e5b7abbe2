// SPDX-License-Identifier: Apache-2.0
// What the classic script says where the page's modules do not begin.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import vm from 'node:vm';
import {Element, openPage, view} from './fake_page.mjs';

const html = fs.readFileSync('index.html', 'utf8'), source = fs.readFileSync('start.js', 'utf8');
const give = (name, value) => Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
const said = () => document.getElementById('missing').hidden ? '' : document.getElementById('missing').textContent;

/** A page whose scripts have not begun. */
function open({protocol = 'http:', origin = 'http://tooth.example:8000', onLine = true, modules = true} = {}) {
  view.listeners.length = 0;
  openPage(html);
  Object.assign(location, {protocol, href: `${protocol}//tooth.example:8000/view/?token=secret#scene=touch`});
  give('origin', origin);
  give('navigator', {onLine});
  if (!modules) document.createElement = tag => new Element(tag);
  vm.runInThisContext(source);
}
/** A file of the head does not come. */
const lose = (file, tag = 'script') => Object.assign(new Element(tag), {src: '', href: '', rel: tag === 'link' ? 'modulepreload' : '',
  [tag === 'link' ? 'href' : 'src']: `http://tooth.example:8000/view/${file}`}).fire('error');
const threw = error => view.fire('error', {target: globalThis, error, message: `Uncaught ${error?.message}`});
const forbid = (effectiveDirective, blockedURI, disposition = 'enforce') =>
  document.documentElement.fire('securitypolicyviolation', {effectiveDirective, blockedURI, disposition});

test('it is a classic script in the words of old browsers, and stands before the modules', () => {
  assert.doesNotMatch(source.replace(/'[^'\n]*'|\/\/.*|\/\*\*.*/g, ''), /=>|`|\?\.|\?\?|\b(let|const|class|import|export|async|of)\b/);
  assert.ok(html.indexOf('<script defer src="start.js"></script>') > 0);
  assert.ok(html.indexOf('src="start.js"') < html.indexOf('type="module"'));
});

test('without scripts the page itself says so', () => {
  assert.match(html, /<noscript><p>[^<]*allow JavaScript[^<]*allow-scripts and\s+allow-same-origin/);
});

test('a file: how to serve it', () => {
  open({protocol: 'file:', origin: 'null'});
  assert.equal(said(), '');
  lose('try.js');
  assert.match(said(), /opened as a file.*python3 -m http.server.*http:\/\/localhost:8000/);
  assert.equal(document.getElementById('state').textContent, 'not started');
});

test('a sandboxed frame: what its sandbox lacks, and the address without its token', () => {
  open({origin: 'null'});
  lose('try.js');
  assert.match(said(), /sandboxed frame.*allow-same-origin.*open http:\/\/tooth.example:8000\/view\/ in a tab/);
  open({origin: 'null'});
  threw(new Error("Failed to construct 'Worker': Script at 'x' cannot be accessed from origin 'null'."));
  assert.match(said(), /sandboxed frame/, 'where its modules came all the same');
});

test('a policy: what it forbids and what allows it, before or after the script is lost', () => {
  open();
  forbid('script-src-elem', 'http://tooth.example:8000/view/try.js');
  assert.equal(said(), '');
  lose('try.js');
  assert.match(said(), /policy.*forbids try.js \(script-src-elem\).*script-src 'self' 'wasm-unsafe-eval'/);
  open();
  lose('try.js');
  forbid('script-src-elem', 'http://tooth.example:8000/view/try.js');
  assert.match(said(), /policy/);
  open();
  forbid('script-src-elem', 'http://tooth.example:8000/view/try.js', 'report');
  forbid('img-src', 'http://tooth.example:8000/view/demo.png');
  lose('try.js');
  assert.doesNotMatch(said(), /policy/, 'reported only, or of a picture');
});

test('files that did not come are named, offline or not', () => {
  open();
  lose('math.js', 'link');
  assert.equal(said(), '', 'it may still come');
  lose('try.js?1');
  lose('mesh.js', 'link');
  lose('mesh.js', 'link');
  assert.match(said(), /did not come: math.js, try.js, mesh.js, or a module of it\. Load the page again.*whole folder, \.js as text\/javascript/);
  lose('gl.js', 'link');
  assert.match(said(), /did not come: math.js, try.js, mesh.js and 1 more, or a module/);
  open({onLine: false});
  lose('try.js');
  assert.match(said(), /did not come: try.js, or a module of it\. This machine is offline/);
});

test('an old browser is told as one', () => {
  open({modules: false});
  assert.match(said(), /too old: it has no modules/);
  open();
  threw(new SyntaxError('Unexpected token ??='));
  assert.match(said(), /too old/);
});

test('what a module throws as it begins is told, and so is one that did not come', () => {
  open();
  threw(new Error('ResizeObserver is not defined'));
  assert.match(said(), /did not start \(ResizeObserver is not defined\)\. Load it again, or use a newer browser/);
  open();
  threw(null);
  assert.match(said(), /did not start \(Uncaught undefined\)/);
  for (const words of ['Failed to fetch dynamically imported module: http://x/kerf.js', 'error loading dynamically imported module: x',
    'Importing a module script failed.']) {
    assert.match(globalThis.whyNotStarted(new TypeError(words)), /^A part of this page did not come/);
  }
});

test('once the page speaks, the script is silent', () => {
  open();
  document.body.dataset.state = 'live';
  threw(new Error('a fault'));
  lose('try.js');
  assert.equal(said(), '');
});
