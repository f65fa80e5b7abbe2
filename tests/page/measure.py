# SPDX-License-Identifier: Apache-2.0
"""What the page costs in headless Chromium without a graphics card: first picture, bytes before the
volume, pictures a second at 512x512 while the camera turns, of the default scene.

    measure.py BIN-FOLDER REPOSITORY"""
import os
import shutil
import sys
import tempfile
import time

from browser import Page, find_chromium
from rig import Rig

AT_REST = "document.getElementById('picture')?.dataset.state === 'at rest'"
SECONDS = 8
# A drag that the page itself makes, so that the pipe to the browser costs nothing; counts pictures.
TURN = '''new Promise(done => {
  const canvas = document.getElementById('picture'), gl = canvas.getContext('webgl2');
  const fence = gl.fenceSync, times = [], began = performance.now();
  gl.fenceSync = (...all) => (times.push(performance.now()), fence.apply(gl, all));
  const fire = (kind, x, y) => canvas.dispatchEvent(
    new PointerEvent(kind, {pointerId: 1, clientX: x, clientY: y, buttons: 1, bubbles: true}));
  canvas.setPointerCapture = () => {};
  fire('pointerdown', 250, 250);
  const timer = setInterval(() => {
    const turns = (performance.now() - began) / 300;
    fire('pointermove', 250 + 100 * Math.sin(turns), 250 + 20 * Math.cos(1.5 * turns));
    if (performance.now() - began < SECONDS * 1000) return;
    clearInterval(timer);
    fire('pointerup', 250, 250);
    delete gl.fenceSync;
    const gaps = times.slice(1).map((time, i) => time - times[i]).sort((a, b) => a - b);
    done([1000 * gaps.length / (times.at(-1) - times[0]), gaps[Math.floor(0.95 * gaps.length)]]);
  }, 16);
})'''.replace('SECONDS', str(SECONDS))


def main():
    with tempfile.TemporaryDirectory(prefix='kerf-page-') as work:
        rig = Rig(sys.argv[1], work)
        shutil.copy(os.path.join(sys.argv[2], 'scenes', 'phantom.toml'), rig.path('scene.toml'))
        page = None
        try:
            address = rig.start_bridge()
            rig.start_run()
            time.sleep(8)  # until the hand rests
            page = Page(find_chromium(), os.path.join(work, 'profile'))
            page.size(792, 512)  # and the panel: 512x512 are left
            page.go(address)
            page.until("document.getElementById('picture')?.dataset.state", 60)
            first_s = page.evaluate('performance.now()') / 1000
            size = sum(event['params']['encodedDataLength'] for event in page.events
                       if event.get('method') == 'Network.loadingFinished')
            print(f'first picture after {first_s:.2f} s, {size} bytes before the volume')
            for renderer in ('iso', 'blend'):
                page.until(AT_REST, 60)
                rate, slow = page.call('Runtime.evaluate', timeout=60, expression=TURN, awaitPromise=True,
                                       returnByValue=True)['result']['value']
                print(f'{renderer}: {rate:.1f} pictures/s while it turns, 95 % within {slow:.0f} ms')
                page.evaluate("document.querySelector('#renderer').focus()")
                page.key('ArrowDown', code='ArrowDown')
            print('load', *(f'{load:.1f}' for load in os.getloadavg()))
        finally:
            if page:
                page.close()
            rig.close()


if __name__ == '__main__':
    main()
