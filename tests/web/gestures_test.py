# SPDX-License-Identifier: Apache-2.0
"""What is cut is what was pressed: gestures of mouse and fingers on the real page in headless Chromium.

    gestures_test.py PAGE-FOLDER

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of a browser."""
import random
import sys
import time

from tab import HIDE, IS_LED, REMOVED, arguments, check, exit_code

LEFT, RIGHT, MIDDLE = 1, 2, 4
NAMES = {LEFT: 'left', RIGHT: 'right', MIDDLE: 'middle'}
PINCHES = 100
PRESSED = """globalThis.pressedAt = []; globalThis.held = false;
  Worker.prototype.postMessage = (f => function (message, ...more) {
    if ('lead' in message || 'release' in message) held = message.lead?.[2] === true;
    if (held) pressedAt.push(performance.now());
    return f.call(this, message, ...more);
  })(Worker.prototype.postMessage);"""
CAPTURED = """globalThis.captured = false;
  for (const kind of ['gotpointercapture', 'lostpointercapture']) {
    document.addEventListener(kind, () => captured = kind === 'gotpointercapture', true);
  }"""
FINGERS = """globalThis.downAt = [];
  addEventListener('pointerdown', event => event.pointerType === 'touch' && downAt.push(performance.now()), true);"""
LATEST_MS = 117  # of a pinch's second finger, after the first, as the page sees them (web/page/steering.js)
SHIFT = 8  # of the protocol's modifiers


class User:
    """A mouse over the tooth's middle, and fingers."""

    def __init__(self, page):
        self.page, self.buttons = page, 0
        x, y, width, height = page.box('#picture')
        self.middle = self.at = (x + width / 2, y + height / 2)

    def move(self, right, down, **more):
        self.at = (self.middle[0] + right, self.middle[1] + down)
        # A motion names the first button that is held, as the browser's own do: one that names none ends the capture.
        button = next((name for bit, name in NAMES.items() if self.buttons & bit), 'none')
        self.page.mouse('mouseMoved', *self.at, button=button, buttons=self.buttons, **more)

    def down(self, button, **more):
        self.buttons |= button
        self.page.mouse('mousePressed', *self.at, button=NAMES[button], buttons=self.buttons, clickCount=1, **more)

    def up(self, button):
        self.buttons &= ~button
        self.page.mouse('mouseReleased', *self.at, button=NAMES[button], buttons=self.buttons, clickCount=1)

    def fingers(self, kind, *points):
        self.page.touch(kind, *((self.middle[0] + right, self.middle[1] + down) for right, down in points))

    def key(self, kind):
        self.page.call('Input.dispatchKeyEvent', type=kind, key='Shift', code='ShiftLeft', modifiers=SHIFT if kind == 'keyDown' else 0)

    def removed(self):
        """mm3 once what is under way has been told."""
        time.sleep(0.6)
        return self.page.evaluate(REMOVED)

    def rests(self, what, seconds=1.0):
        """The hand does not press, and nothing is cut in this time."""
        before = self.removed()
        time.sleep(seconds)
        after = self.removed()
        held = self.page.evaluate('held')
        check(before == after and not held, f'{what}: rests ({before} and {after} mm3{", pressed" if held else ""})')

    def cuts(self, what):
        """Something is cut within ten seconds, since the page is slow on a busy machine."""
        before, end = self.page.evaluate(REMOVED), time.monotonic() + 10
        while time.monotonic() < end and not self.page.evaluate(REMOVED) > before + 0.01:
            time.sleep(0.1)
        after = self.page.evaluate(REMOVED)
        check(after > before + 0.01, f'{what}: cuts ({before} and {after} mm3)')


LOSE = "document.getElementById('picture').releasePointerCapture(1)"


def loses_capture(user):
    user.page.evaluate(LOSE)
    user.move(5, 0)  # a browser tells with the next event that a capture is lost
    check(user.page.until('!captured'), 'the page hears that the capture is lost')


# What ends a press while the left button stays down, and what is to be undone then.
ENDS = {
    'the right button goes down': (lambda user: user.down(RIGHT), lambda user: user.up(RIGHT)),
    'the middle button goes down and up': (lambda user: (user.down(MIDDLE), user.up(MIDDLE)), None),
    'shift goes down': (lambda user: user.key('keyDown'), lambda user: user.key('keyUp')),
    'a motion with shift': (lambda user: user.move(6, 0, modifiers=SHIFT), None),
    'the capture is lost': (loses_capture, None),
    'the page is out of focus': (lambda user: user.page.evaluate("dispatchEvent(new Event('blur'))"), None),
    'the page is hidden and seen again': (lambda user: user.page.evaluate(HIDE % 'true' + ';' + HIDE % 'false'), None),
    'the wheel with ctrl': (lambda user: user.page.mouse('mouseWheel', *user.at, deltaX=0, deltaY=1, modifiers=2), None),
    'a key turns the view': (lambda user: user.page.evaluate("document.getElementById('picture').focus()") or
                             user.page.key('r', code='KeyR', text='r'), None),
}


def mouse_cuts_what_it_presses(user):
    user.move(0, 0)
    user.rests('a mouse that hovers')
    user.down(LEFT)
    user.cuts('the left button')
    user.up(LEFT)
    user.rests('the button is up')
    for name, (end, undo) in ENDS.items():
        user.move(0, 0)
        user.down(LEFT)
        user.cuts('the left button again')
        user.move(2, 0)  # a browser captures with the next event
        check(user.page.until('captured && held'), 'the left button again: is captured, and presses')
        end(user)
        if end is not loses_capture:
            check(user.page.evaluate('captured'), f'{name}: is still captured')
        user.rests(name)
        user.move(3, 3)
        user.rests(f'{name}, and the mouse moves', 0.3)
        if undo:
            undo(user)
            user.move(0, 3)
            user.rests(f'{name}, and up', 0.3)
        user.up(LEFT)
        user.rests(f'{name}: all are up', 0.3)
    user.down(LEFT)
    user.down(RIGHT)
    user.up(LEFT)
    user.move(4, 0)
    user.rests('left, right, and left up: a chord', 2)
    user.up(RIGHT)
    user.page.call('Emulation.setTouchEmulationEnabled', enabled=True)
    user.page.mouse('mouseMoved', 1270, 790)  # out of the picture
    time.sleep(1.2)


def finger_cuts_what_it_presses(user):
    user.fingers('touchStart', (0, 0))
    user.cuts('a finger')
    user.fingers('touchStart', (0, 0), (60, 40))
    user.rests('a second finger')
    user.fingers('touchEnd', (0, 0))
    user.fingers('touchMove', (5, 5))
    user.rests('one of two fingers is up')
    user.fingers('touchEnd')
    user.rests('all are up')
    user.fingers('touchStart', (0, 0))
    user.fingers('touchMove', (8, 4))
    user.cuts('a finger that drags')
    user.fingers('touchCancel')
    user.rests('it is cancelled')


def pinches_cut_nothing(user):
    """A try whose second finger came late to the page, as this machine was busy, counts neither way."""
    dice = random.Random(5)
    cut, presses, counted = 0.0, 0, 0
    for _ in range(4 * PINCHES):
        if counted == PINCHES:
            break
        before = user.page.evaluate(f'pressedAt.length = downAt.length = 0, {REMOVED}')
        at = [(dice.uniform(-80, 80), dice.uniform(-80, 80)) for _ in range(2)]
        user.fingers('touchStart', at[0])
        time.sleep(dice.uniform(0, 0.07))
        user.fingers('touchStart', *at)
        for _ in range(dice.randrange(4)):
            at = [(x + dice.uniform(-9, 9), y + dice.uniform(-9, 9)) for x, y in at]
            user.fingers('touchMove', *at)
        stays = at[dice.randrange(2)]
        user.fingers('touchEnd', stays)
        user.fingers('touchMove', (stays[0] + 7, stays[1]))
        time.sleep(dice.uniform(0, 0.2))
        user.fingers('touchEnd')
        time.sleep(0.25)  # until the figure is that of now
        if user.page.evaluate('downAt.length === 2 ? downAt[1] - downAt[0] : 1e9') > LATEST_MS:
            user.removed()
            continue
        counted += 1
        cut += user.page.evaluate(REMOVED) - before
        presses += user.page.evaluate('pressedAt.length')
    check(counted == PINCHES, f'{counted} pinches as fast as a hand')
    check(cut == 0 and presses == 0, f'they cut nothing ({cut:.3f} mm3, pressed in {presses} messages)')


def all_gestures(page, address):
    page.call('Page.addScriptToEvaluateOnNewDocument', source=PRESSED + CAPTURED + FINGERS)
    page.go(f'{address}/#scene=phantom&hand=mine')
    waits = page.until(IS_LED, 120)
    check(waits, 'the hand waits to be led')
    if waits:
        user = User(page)
        mouse_cuts_what_it_presses(user)
        finger_cuts_what_it_presses(user)
        pinches_cut_nothing(user)


sys.exit(exit_code(*arguments(__doc__, 'PAGE-FOLDER'), all_gestures))
