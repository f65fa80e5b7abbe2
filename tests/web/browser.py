# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium over its DevTools pipe, and its pictures; Python's standard library only."""
import base64
import json
import os
import select
import shutil
import struct
import subprocess
import time
import zlib

FLAGS = ['--headless', '--no-sandbox', '--no-first-run', '--disable-gpu-sandbox', '--hide-scrollbars',
         '--force-color-profile=srgb', '--disable-background-networking', '--use-angle=swiftshader',
         '--remote-debugging-pipe']


def find_chromium():
    """Its path, or None."""
    return next(filter(None, map(shutil.which, ('chromium', 'chromium-browser', 'google-chrome'))), None)


class Page:
    """One tab of a browser that ends with this object."""

    def __init__(self, chromium, folder, more=()):
        to_browser, self.to = os.pipe()
        self.back, from_browser = os.pipe()
        # The browser reads commands on 3 and answers on 4.
        shell = f'exec "$@" 3<&{to_browser} 4>&{from_browser}'
        command = ['bash', '-c', shell, 'bash', chromium, *FLAGS, *more, f'--user-data-dir={folder}']
        self.process = subprocess.Popen(command, pass_fds=(to_browser, from_browser),
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.number = 0
        self.read = b''
        self.session = None
        self.events = []
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        self.session = self.call('Target.attachToTarget', targetId=target, flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')

    def close(self):
        try:
            self.session = None
            self.call('Browser.close')
            self.process.wait(5)
        except (OSError, EOFError, TimeoutError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        os.close(self.to)
        os.close(self.back)

    def message(self, end):
        while b'\0' not in self.read:
            ready, _, _ = select.select([self.back], [], [], max(0, end - time.monotonic()))
            if not ready:
                raise TimeoutError('the browser does not answer')
            part = os.read(self.back, 1 << 20)
            if not part:
                raise EOFError('the browser has gone')
            self.read += part
        one, self.read = self.read.split(b'\0', 1)
        return json.loads(one)

    def call(self, method, timeout=30, **params):
        self.number += 1
        request = {'id': self.number, 'method': method, 'params': params}
        if self.session:
            request['sessionId'] = self.session
        os.write(self.to, json.dumps(request).encode() + b'\0')
        end = time.monotonic() + timeout
        while True:
            answer = self.message(end)
            if answer.get('id') != self.number:
                self.events.append(answer)
            elif 'error' in answer:
                raise RuntimeError(f'{method}: {answer["error"]["message"]}')
            else:
                return answer['result']

    def evaluate(self, expression):
        answer = self.call('Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True)
        if 'exceptionDetails' in answer:
            raise RuntimeError(f'{expression}: {answer["exceptionDetails"]}')
        return answer['result'].get('value')

    def until(self, expression, seconds=20):
        """Waits until an expression holds; False where it never does."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.evaluate(expression):
                return True
            time.sleep(0.05)
        return False

    def size(self, width, height, touch=False):
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self.call('Emulation.setTouchEmulationEnabled', enabled=touch)

    def go(self, address):
        self.call('Page.navigate', url=address)

    def mouse(self, kind, x, y, **more):
        self.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, **more)

    def drag(self, points, button='left', modifiers=0):
        buttons = {'left': 1, 'middle': 4}[button]
        held = {'button': button, 'buttons': buttons, 'clickCount': 1, 'modifiers': modifiers}
        self.mouse('mousePressed', *points[0], **held)
        for point in points[1:]:
            self.mouse('mouseMoved', *point, button=button, buttons=buttons, modifiers=modifiers)
        self.mouse('mouseReleased', *points[-1], button=button, modifiers=modifiers)

    def press(self, selector):
        """Clicks on the middle of an element."""
        self.evaluate(f"document.querySelector('{selector}').scrollIntoView({{block: 'center', behavior: 'instant'}})")
        x, y, width, height = self.box(selector)
        self.drag([(x + width / 2, y + height / 2)])

    def touch(self, kind, *points):
        self.call('Input.dispatchTouchEvent', type=kind,
                  touchPoints=[{'x': x, 'y': y, 'id': i} for i, (x, y) in enumerate(points)])

    def key(self, key, code='', text='', modifiers=0):
        for kind in ('keyDown', 'keyUp'):
            more = {'text': text} if text and kind == 'keyDown' else {}
            self.call('Input.dispatchKeyEvent', type=kind, key=key, code=code, modifiers=modifiers, **more)

    def box(self, selector):
        """x, y, width, height of an element."""
        return self.evaluate(f'(r => [r.x, r.y, r.width, r.height])'
                             f'(document.querySelector({json.dumps(selector)}).getBoundingClientRect())')

    def picture(self, clip=None):
        """What is seen, as PNG; of a box, or of all."""
        more = {'clip': dict(zip(('x', 'y', 'width', 'height'), clip), scale=1)} if clip else {}
        return base64.b64decode(self.call('Page.captureScreenshot', format='png', **more)['data'])


def pixels(png):
    """Width, height and rows of RGB of an 8-bit PNG."""
    assert png[:8] == b'\x89PNG\r\n\x1a\n'
    at, data = 8, b''
    while at < len(png):
        length, kind = struct.unpack_from('>I4s', png, at)
        if kind == b'IHDR':
            width, height, depth, colour = struct.unpack_from('>IIBB', png, at + 8)
        elif kind == b'IDAT':
            data += png[at + 8:at + 8 + length]
        at += 12 + length
    assert depth == 8 and colour in (2, 6)
    channels = 3 if colour == 2 else 4
    raw, stride = zlib.decompress(data), width * channels
    rows, before = [], bytes(stride)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        unfilter(kind, line, before, channels)
        rows.append(bytes(line) if channels == 3 else
                    bytes(v for i, v in enumerate(line) if i % 4 != 3))
        before = line
    return width, height, rows


def unfilter(kind, line, before, channels):
    if kind == 2:
        for i in range(len(line)):
            line[i] = line[i] + before[i] & 255
    elif kind != 0:
        for i in range(len(line)):
            a = line[i - channels] if i >= channels else 0
            b, c = before[i], before[i - channels] if i >= channels else 0
            if kind == 1:
                guess = a
            elif kind == 3:
                guess = a + b >> 1
            else:
                p = a + b - c
                guess = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[i] = line[i] + guess & 255
