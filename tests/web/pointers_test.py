# SPDX-License-Identifier: Apache-2.0
"""Mouse and finger at once, and a page in the background, in headless Chromium.

    pointers_test.py PAGE-FOLDER

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of a browser."""
import math
import sys
import time

from tab import HIDE, IS_LED, arguments, check, exit_code

# What the page asks of its worker: the names of the messages, and where the tool shall go.
LISTEN = """globalThis.asked = [];
  Worker.prototype.postMessage = (f => function (message, ...more) {
    if ('lead' in message) asked.push(message.lead[0]);
    else if ('release' in message) asked.push('release');
    return f.call(this, message, ...more);
  })(Worker.prototype.postMessage);"""


def asked(page):
    """What was asked since the last time."""
    return page.evaluate('asked.splice(0)')


def apart(a, b):
    """In mm; nothing is near to a goal that was never asked for, nor far from it."""
    return max(abs(x - y) for x, y in zip(a, b)) if a and b else math.nan


def last_goal(messages):
    return next((one for one in reversed(messages) if one != 'release'), None)


def first_pointer_leads(page):
    x, y, width, height = page.box('#picture')
    left, right = ((x + width * part, y + height / 2) for part in (0.3, 0.7))
    page.touch('touchStart', left)
    time.sleep(0.3)
    of_finger = last_goal(asked(page))
    check(of_finger is not None, 'a finger leads the tool')
    page.mouse('mouseMoved', *right)
    page.mouse('mousePressed', *right, button='left', buttons=1, clickCount=1)
    page.mouse('mouseMoved', right[0] + 5, right[1], button='left', buttons=1)
    page.mouse('mouseReleased', right[0] + 5, right[1], button='left')
    page.mouse('mouseWheel', *right, deltaX=0, deltaY=100)
    time.sleep(0.3)
    messages = asked(page)
    # The tool itself moves meanwhile, and with it the depth of the finger's goal, by little.
    check(messages and 'release' not in messages and all(apart(one, of_finger) < 3 for one in messages),
          'a mouse beside it neither leads nor takes the tool away')
    page.touch('touchEnd')
    time.sleep(0.2)
    check('release' in asked(page), 'the finger goes')
    page.mouse('mousePressed', *right, button='left', buttons=1, clickCount=1)
    time.sleep(0.3)
    of_mouse = last_goal(asked(page))
    check(apart(of_mouse, of_finger) > 3, 'then the mouse leads, elsewhere')
    page.touch('touchStart', left)
    page.touch('touchMove', (left[0] + 5, left[1]))
    time.sleep(1.3)  # a press that does not move is still one
    messages = asked(page)
    check(messages and 'release' not in messages and all(apart(one, of_mouse) < 3 for one in messages),
          'a finger beside a pressed mouse does not lead')
    page.mouse('mouseReleased', *right, button='left')
    page.touch('touchEnd')
    time.sleep(1.2)
    asked(page)
    page.touch('touchStart', left)
    time.sleep(0.3)
    check(apart(last_goal(asked(page)), of_mouse) > 3, 'a mouse that stands still leaves the tool to a finger')
    page.touch('touchEnd')


def stands_still_when_hidden(page):
    seconds = "parseFloat([...document.querySelectorAll('#run-figures dt')].find(e => e.textContent === 'servo time')?.nextSibling.textContent ?? '-1')"
    page.evaluate(HIDE % 'true')
    time.sleep(0.6)  # what was under way
    before = page.evaluate(seconds)
    time.sleep(4)
    check(page.evaluate(seconds) == before, 'a run in the background stands still')
    page.evaluate(HIDE % 'false')
    began = time.monotonic()
    check(page.until(f'{seconds} > {before}', 30), 'and goes on')
    # No faster than the clock, but for the last figure's 0.2 s and its rounding.
    gone = page.evaluate(seconds) - before
    check(gone <= time.monotonic() - began + 0.5, f'without a burst: {gone:.1f} s')


def two_pointers(page, address):
    page.call('Page.addScriptToEvaluateOnNewDocument', source=LISTEN)
    page.call('Emulation.setTouchEmulationEnabled', enabled=True)
    page.go(f'{address}/#scene=touch&hand=mine')
    waits = page.until(IS_LED, 120)
    check(waits, 'the hand waits to be led')
    if waits:  # else the page has nothing of what the others look at
        first_pointer_leads(page)
        stands_still_when_hidden(page)


sys.exit(exit_code(*arguments(__doc__, 'PAGE-FOLDER'), two_pointers))
