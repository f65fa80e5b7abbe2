// SPDX-License-Identifier: Apache-2.0
// Mouse, fingers and keys over the picture.

const kKeyStep = 0.03;     // of the picture's height
const kWheelPixels = 100;  // of a step

/** Moves the camera of a stage; `on` has what other keys do, by key. */
export function listen(stage, on) {
  const {canvas, camera} = stage;
  const pointers = new Map();
  const high = () => Math.max(canvas.clientHeight, 1);

  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  });
  for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    canvas.addEventListener(kind, event => pointers.delete(event.pointerId));
  }
  canvas.addEventListener('pointermove', event => {
    const at = pointers.get(event.pointerId);
    if (!at || !stage.scene) return;
    const others = [...pointers.values()].filter(one => one !== at);
    const right = (event.clientX - at.x) / high(), up = (at.y - event.clientY) / high();
    if (others.length === 1) {
      const [{x, y}] = others;
      const before = Math.hypot(at.x - x, at.y - y), after = Math.hypot(event.clientX - x, event.clientY - y);
      camera.pan(0.5 * right, 0.5 * up);  // the middle of two fingers
      if (before > 0 && after > 0) camera.zoom(Math.log(before / after) / Math.log(0.9));
    } else if (event.shiftKey || event.buttons & 4) {
      camera.pan(right, up);
    } else {
      camera.orbit(right, up);
    }
    Object.assign(at, {x: event.clientX, y: event.clientY});
    stage.touch();
  });
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    if (!stage.scene) return;
    const pixels = event.deltaMode === 0 ? event.deltaY : event.deltaY * 33;
    camera.zoom(-pixels / kWheelPixels);
    stage.touch();
  }, {passive: false});
  canvas.addEventListener('keydown', event => {
    if (event.ctrlKey || event.metaKey || event.altKey || !stage.scene) return;
    const move = (right, up) => event.shiftKey ? camera.pan(right, up) : camera.orbit(right, up);
    const moves = {ArrowLeft: () => move(-kKeyStep, 0), ArrowRight: () => move(kKeyStep, 0),
      ArrowUp: () => move(0, kKeyStep), ArrowDown: () => move(0, -kKeyStep),
      '+': () => camera.zoom(1), '=': () => camera.zoom(1), '-': () => camera.zoom(-1), ...on};
    const known = moves[event.key];
    if (!known) return;
    event.preventDefault();
    known();
    stage.touch();
  });
}
