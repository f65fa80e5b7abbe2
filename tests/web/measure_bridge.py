# SPDX-License-Identifier: Apache-2.0
"""What the page costs in headless Chromium without a graphics card: first picture, bytes before the
volume, pictures a second at 512x512 while the camera turns and while the hand cuts, of the default scene.

    measure_bridge.py BIN-FOLDER REPOSITORY"""
import os
import shutil
import sys
import tempfile
import time

from browser import Page, find_chromium
from rig import HAND, Rig

AT_REST = "document.getElementById('picture')?.dataset.state === 'at rest'"
SECONDS = 8
# Strokes over the tooth for a minute and a half, in place of one.
STROKES = ''.join(f'[[step]]\nmove_mm = [{x}, -0.02, 0]\nseconds = 0.5\n' for x in 90 * (2.5, -2.5))
CUT_TICK = 8000  # when the first strokes are done
# The page itself counts pictures, and drags, so that the pipe to the browser costs nothing.
COUNT = '''new Promise(done => {
  const canvas = document.getElementById('picture'), gl = canvas.getContext('webgl2');
  const fence = gl.fenceSync, times = [], began = performance.now();
  gl.fenceSync = (...all) => (times.push(performance.now()), fence.apply(gl, all));
  const told = () => {
    delete gl.fenceSync;
    const gaps = times.slice(1).map((time, i) => time - times[i]).sort((a, b) => a - b);
    done([1000 * gaps.length / (times.at(-1) - times[0]), gaps[Math.floor(0.95 * gaps.length)]]);
  };
'''
TURN = COUNT + '''  const fire = (kind, x, y) => canvas.dispatchEvent(
    new PointerEvent(kind, {pointerId: 1, clientX: x, clientY: y, buttons: 1, bubbles: true}));
  canvas.setPointerCapture = () => {};
  fire('pointerdown', 250, 250);
  const timer = setInterval(() => {
    const turns = (performance.now() - began) / 300;
    fire('pointermove', 250 + 100 * Math.sin(turns), 250 + 20 * Math.cos(1.5 * turns));
    if (performance.now() - began < SECONDS * 1000) return;
    clearInterval(timer);
    fire('pointerup', 250, 250);
    told();
  }, 16);
})'''.replace('SECONDS', str(SECONDS))
CUT = COUNT + f'setTimeout(told, {SECONDS * 1000}); }})'


def rate_of(page, expression):
    return page.call('Runtime.evaluate', timeout=60, expression=expression, awaitPromise=True,
                     returnByValue=True)['result']['value']


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
            time.sleep(4)  # a browser that stands open; its own start is not the page's
            page.go(address)
            page.until("document.getElementById('picture')?.dataset.state", 60)
            first_s = page.evaluate('performance.now()') / 1000
            size = sum(event['params']['encodedDataLength'] for event in page.events
                       if event.get('method') == 'Network.loadingFinished')
            print(f'first picture after {first_s:.2f} s, {size} bytes before the volume')
            for renderer in ('iso', 'blend'):
                page.until(AT_REST, 60)
                rate, slow = rate_of(page, TURN)
                print(f'{renderer}: {rate:.1f} pictures/s while it turns, 95 % within {slow:.0f} ms')
                page.evaluate("document.querySelector('#renderer').focus()")
                page.key('ArrowDown', code='ArrowDown')
            rig.end('controller')
            rig.end('emulator')
            # The hand comes down as it does else, and stays where it cuts.
            rig.write('hand.toml', HAND[:HAND.index('[[step]]\nmove_mm = [1.5,')] + STROKES)
            rig.start_run()
            page.go(address)
            for renderer in ('iso', 'blend'):
                page.until(f'Number(document.body?.dataset.tick) > {CUT_TICK}', 60)
                rate, slow = rate_of(page, CUT)
                print(f'{renderer}: {rate:.1f} pictures/s while it cuts, 95 % within {slow:.0f} ms')
                page.evaluate("document.querySelector('#renderer').focus()")
                page.key('ArrowDown', code='ArrowDown')
            print('load', *(f'{load:.1f}' for load in os.getloadavg()))
        finally:
            if page:
                page.close()
            rig.close()


if __name__ == '__main__':
    main()
