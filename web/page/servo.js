// SPDX-License-Identifier: Apache-2.0
// The worker of the servo and its module. The page loads this first and alone, so that both begin while the rest is on its way.
const kModule = new URL('kerf.wasm', import.meta.url);

/** Why this browser cannot run kerf; '' where it can. */
function whyNot() {
  if (typeof WebAssembly !== 'object') return 'This browser has no WebAssembly, or it is switched off: use a newer one, or switch it on for this page.';
  if (typeof Worker !== 'function') return 'This browser has no workers; use a newer one.';
  if (typeof BigInt !== 'function' || typeof WebAssembly.Global !== 'function') return 'This browser is too old; use a newer one.';
  return '';
}
export const lack = whyNot();

/** Null where something is lacking. It answers nothing before it has the module. */
export const worker = lack ? null : new Worker(new URL('worker.js', import.meta.url), {type: 'module'});
/** Its first error, as an event: it may come before the page listens. */
export const broken = new Promise(resolve => worker?.addEventListener('error', resolve, {once: true}));

async function moduleBytes() {
  let answer, bytes;
  try {
    answer = await fetch(kModule);
    bytes = await answer.arrayBuffer();
  } catch {
    throw new Error("kerf.wasm: did not come, since the network or its server is not reached, or a policy's connect-src forbids it; " +
      'load the page again once it can');
  }
  if (!answer.ok) throw new Error(`kerf.wasm: ${answer.status}; serve the whole folder`);
  if (String(new Uint8Array(bytes.slice(0, 4))) !== '0,97,115,109') {
    throw new Error('kerf.wasm: something else came in its place; serve the whole folder');
  }
  return bytes;
}
async function compile(bytes) {
  if (!WebAssembly.validate(bytes)) throw new Error('This browser runs no WebAssembly with SIMD; use a newer one.');
  try {
    return await WebAssembly.compile(bytes);
  } catch (problem) {
    if (problem instanceof RangeError) throw new Error('memory: none is left to compile kerf.wasm; close other tabs, then load the page again');
    // It is sound, as was seen before.
    throw new Error("A policy (Content-Security-Policy) forbids WebAssembly here; have the server add 'wasm-unsafe-eval' to its script-src.");
  }
}
/** While it comes. Where that fails, as with a server that gives it another type, from its bytes, of which it is known what is wrong. */
async function compileStream() {
  try {
    return await WebAssembly.compileStreaming(fetch(kModule));
  } catch {
    return compile(await moduleBytes());
  }
}
/** A promise of kerf.wasm, compiled; it fails with what the page says then. */
export const compiled = worker ? compileStream() : new Promise(() => {});
compiled.catch(() => {});  // the page may itself not have come
