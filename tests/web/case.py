# SPDX-License-Identifier: Apache-2.0
"""What all cases of the page's test share: a page beside a run, and when two pictures are alike."""
import os

from browser import Page, pixels

# A picture is like another one where all but a thousandth of its pixels differ by `NEAR` at most of
# 255: GPUs round differently, and a silhouette may take or leave a pixel. iso reads densities of 16
# bits, blend sums hundreds of samples.
NEAR = 6
LIKE = 0.999
WIDTH, HEIGHT = 780, 400  # of the window; the picture has what the panel leaves
PANEL = (260, 240)        # of the native picture's own figures, upper left


def likeness(a, b, panel=PANEL):
    """The share of pixels that differ by NEAR at most; `panel` does not count."""
    (width, height, first), (other_width, other_height, second) = pixels(a), pixels(b)
    assert (width, height) == (other_width, other_height), (width, height, other_width, other_height)
    alike = all_of_them = 0
    for y in range(height):
        x0 = min(panel[0], width) if y < panel[1] else 0
        one, two = first[y][3 * x0:], second[y][3 * x0:]
        differs = [abs(p - q) > NEAR for p, q in zip(one, two)]
        bad = sum(any(differs[i:i + 3]) for i in range(0, len(differs), 3)) if any(differs) else 0
        alike += width - x0 - bad
        all_of_them += width - x0
    return alike / all_of_them


def figure(name):
    """Of the panel, as JavaScript: a number."""
    return (f"parseFloat([...document.querySelectorAll('#figures dt')]"
            f".find(dt => dt.textContent.startsWith('{name}'))?.nextElementSibling.textContent ?? '0')")


def text_of(selector):
    return f"(document.querySelector('{selector}')?.textContent ?? '')"


class Case:
    """What all cases share: a page that shows a tooth with a cut, which rests."""

    def __init__(self, rig, chromium, folder):
        self.rig, self.chromium, self.folder = rig, chromium, folder
        self.bridge = ('--token-file', rig.path('tokens'), '--allow-commands', rig.path('tokens'))
        self.address = rig.start_bridge('127.0.0.1:0', *self.bridge)
        self.page = Page(chromium, folder)
        self.page.size(WIDTH, HEIGHT)
        self.page.go(self.address)
        self.check(self.page.until(text_of('#state') + ".includes('no controller')"), 'the page waits for a controller')
        # A hand that comes late, as on a busy machine, is a fault: then once more.
        for _ in range(3):
            rig.start_run()
            self.check(self.page.until('document.body?.dataset.state === "live"'), 'it goes live')
            # Ticks after which the hand rests. A page that came late has not seen what was cut before.
            self.check(self.page.until('Number(document.body.dataset.tick) > 7000'), 'the hand has been there')
            late = "document.getElementById('figures').textContent.includes('since joining')"
            if self.page.until(f"{late} || {figure('removed')} > 0.1", 2):
                break
            print('  not cut: ' + self.page.evaluate(text_of('#banner')) + rig.log('controller'))
            rig.end('controller')
            rig.end('emulator')
        else:
            self.check(False, 'something is cut')
        self.rest = self.settle()

    def check(self, holds, what):
        if not holds:
            if 'KERF_PAGE_OUT' in os.environ:  # a file for what is seen then
                with open(os.environ['KERF_PAGE_OUT'], 'wb') as out:
                    out.write(self.page.picture())
            raise AssertionError(what)
        if what != 'the picture comes to rest':
            print('  ' + what, flush=True)

    def settle(self):
        """The picture once it is drawn finely and nothing moves."""
        self.check(self.page.until("document.getElementById('picture').dataset.state === 'at rest'", 40),
                   'the picture comes to rest')
        return self.canvas()

    def canvas(self):
        return self.page.picture(self.page.box('#picture'))

    def middle(self):
        x, y, width, height = self.page.box('#picture')
        return x + width / 2, y + height / 2

    def choose(self, selector, key):
        """Focuses a control with a click's help and presses a key in it."""
        self.page.evaluate(f"document.querySelector('{selector}').focus()")
        self.page.key(key, code=key)
