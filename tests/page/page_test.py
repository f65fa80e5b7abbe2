# SPDX-License-Identifier: Apache-2.0
"""The page of kerf-bridge in headless Chromium: real input, and its pixels beside the native picture.

    page_test.py BIN-FOLDER [CASE...]

Exit code 77: skipped, for want of a browser."""
import base64
import hashlib
import os
import ssl
import sys
import tempfile
import time

from browser import Page, find_chromium, pixels
from rig import AWAY, Rig, TOKEN, TWO_TEETH

# A picture is like another one where all but a thousandth of its pixels differ by `NEAR` at most of
# 255: GPUs round differently, and a silhouette may take or leave a pixel. iso reads densities of 16
# bits, blend sums hundreds of samples.
NEAR = 6
LIKE = 0.999
WIDTH, HEIGHT = 780, 400  # of the window; the picture has what the panel leaves
PANEL = (260, 170)        # of the native picture's own figures, upper left


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
    return f"document.querySelector('{selector}')?.textContent ?? ''"


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


def shows_what_the_visualizer_shows(case):
    x, y, width, height = map(int, case.page.box('#picture'))
    iso = case.rig.native_picture(width, height)
    like = likeness(case.rest, iso)
    case.check(like >= LIKE, f'iso: {100 * like:.3f} % of the pixels are those of kerf-visualizer')
    case.choose('#renderer', 'ArrowDown')
    blend = case.settle()
    like = likeness(blend, case.rig.native_picture(width, height, '--renderer', 'blend'))
    case.check(like >= LIKE, f'blend: {100 * like:.3f} %')
    # The comparison tells one renderer from the other, and a turn of two degrees.
    other = likeness(blend, iso)
    case.check(other < 0.9, f'blend is not iso: {100 * other:.1f} %')
    case.choose('#renderer', 'ArrowUp')
    case.choose('#picture', 't')
    case.page.evaluate("document.activeElement.blur()")  # its ring is over the picture
    stereo = case.settle()
    like = likeness(stereo, case.rig.native_picture(width, height, '--stereo'), (width, PANEL[1]))
    case.check(like >= LIKE, f'stereo: {100 * like:.3f} %')
    case.choose('#picture', 't')
    case.page.evaluate("document.activeElement.blur()")
    case.check(case.settle() == case.rest, 'and back')
    middle = case.middle()
    case.page.drag([middle, (middle[0] + height * 2 / 180, middle[1])])
    turned = likeness(case.settle(), iso)
    case.check(turned < LIKE, f'two degrees are seen: {100 * turned:.1f} %')
    case.choose('#picture', 'r')
    case.page.evaluate("document.activeElement.blur()")
    case.check(case.settle() == case.rest, 'the first view again')


def is_turned_by_mouse_fingers_and_keys(case):
    page, (x, y) = case.page, case.middle()

    def moves(what, do):
        do()
        seen = case.settle()
        case.check(seen != case.rest, what + ' moves the picture')
        page.evaluate("document.getElementById('home').focus()")
        page.key('Enter', code='Enter', text='\r')
        case.check(case.settle() == case.rest, 'first view')
        return seen

    pictures = [moves('a drag', lambda: page.drag([(x, y), (x + 40, y), (x + 60, y - 20)])),
                moves('a drag with shift', lambda: page.drag([(x, y), (x + 40, y)], modifiers=8)),
                moves('the wheel', lambda: page.mouse('mouseWheel', x, y, deltaX=0, deltaY=-200))]
    page.size(WIDTH, HEIGHT, touch=True)

    def pinch():
        page.touch('touchStart', (x - 30, y), (x + 30, y))
        page.touch('touchMove', (x - 50, y), (x + 50, y))
        page.touch('touchEnd')

    def finger():
        page.touch('touchStart', (x, y))
        page.touch('touchMove', (x, y + 40))
        page.touch('touchEnd')

    pictures += [moves('a finger', finger), moves('a pinch', pinch)]
    page.size(WIDTH, HEIGHT)

    def arrow():
        page.evaluate("document.getElementById('picture').focus()")
        page.key('ArrowLeft')

    pictures.append(moves('an arrow key', arrow))
    case.check(len(set(pictures)) == len(pictures), 'each in its own way')


def is_reached_by_keyboard(case):
    page = case.page
    page.evaluate('document.activeElement.blur()')
    reached, rings = [], True
    for _ in range(24):
        page.key('Tab', code='Tab')
        name, ring = page.evaluate("[document.activeElement.id || document.activeElement.tagName,"
                                   " getComputedStyle(document.activeElement).outlineStyle]")
        reached.append(name)
        rings = rings and (ring != 'none' or name == 'BODY')
    wanted = ['picture', 'tool', 'hold', 'go', 'renderer', 'iso', 'clip', 'stereo', 'home', 'SUMMARY']
    reached = [name for name in reached if name in wanted]  # from wherever the last click was
    reached = reached[reached.index('picture'):][:len(wanted)]
    case.check(reached == wanted, 'Tab reaches: ' + ' '.join(reached))
    case.check(rings, 'the focus is seen')


def commands_where_allowed(case):
    page = case.page
    case.choose('#tool', 'ArrowDown')
    case.check(page.until("document.querySelector('#figures dd').textContent === 'fissure'"), 'another tool')
    for name, button in (('hold', '#hold'), ('go on', '#go')):
        page.press(button)
        case.check(page.until(text_of('#reply') + f" === '{name}: done'"), name)
    # Only the second press of the same button does it.
    if page.evaluate("document.getElementById('reset').hidden"):
        return
    page.press('#reset')
    case.check('press again' in page.evaluate(text_of('#reset')), 'a reset asks first')
    page.press('#reset')
    case.check(page.until(text_of('#reply') + " === 'reset: done'"), 'reset')
    case.check(page.until(figure('removed') + ' === 0'), 'the tooth is whole again')


def tells_faults_and_ends(case):
    page, rig = case.page, case.rig
    rig.end('emulator')
    case.check(page.until(text_of('#banner') + ".startsWith('Fault stale_input')"), 'a fault is told')
    rig.end('controller')
    case.check(page.until(text_of('#banner') + ".startsWith('The controller')"), 'the end is told')
    rig.start_run()
    case.check(page.until(text_of('#banner') + ".startsWith('A new run')"), 'so is a new run')
    case.check(page.until('document.body.dataset.state === "live"'), 'which is shown')
    address = case.address.split('/')[2]
    rig.end('bridge')
    case.check(page.until('document.body.dataset.state === "trouble"'), 'a bridge that has gone is told')
    rig.start_bridge(address, *case.bridge)
    case.check(page.until('document.body.dataset.state === "live"'), 'and joined again')


def is_small_and_breaks_no_rule(case):
    page = case.page
    page.go(case.address)
    page.evaluate('1')
    page.events.clear()
    page.go(case.address)
    case.check(page.until('document.body?.dataset.state === "live"'), 'loaded again')
    sizes = [event['params']['encodedDataLength'] for event in page.events
             if event.get('method') == 'Network.loadingFinished']
    case.check(0 < sum(sizes) < 200_000, f'{sum(sizes)} bytes in {len(sizes)} files before the volume')
    wrong = [event['params'] for event in page.events
             if event.get('method') == 'Runtime.exceptionThrown' or
             event.get('method') == 'Log.entryAdded' and event['params']['entry']['level'] == 'error']
    case.check(not wrong, f'no error and no broken rule {wrong or ""}')
    unnamed = page.evaluate("""performance.getEntriesByType('resource').map(one => one.name.split('/').pop())
      .filter(name => name.endsWith('.js') && !document.querySelector(`[src="${name}"], [href="${name}"]`))""")
    case.check(not unnamed, f'index.html names every module, so that all come at once {unnamed or ""}')
    case.check(TOKEN not in page.evaluate('location.href'), 'the address keeps no token')


def decodes_lz4_and_refuses_what_is_none(case):
    results = case.page.evaluate("""import('./lz4.js').then(({unpack}) => {
      const of = (bytes, length) => {
        const out = new Uint8Array(length);
        try { unpack(new Uint8Array(bytes), out); return String.fromCharCode(...out); } catch { return null; }
      };
      const long = [0xf0, 240, ...Array(255).fill(97)];
      return [of([0x30, 97, 98, 99], 3), of([0x12, 97, 1, 0, 0x10, 98], 8), of(long, 255),
        of([0x32, 97, 98, 99, 3, 0, 0x00], 9), of([], 0), of([0x30, 97, 98], 3), of([0x12, 97, 2, 0, 0], 7),
        of([0x12, 97, 0, 0, 0], 7), of([0x30, 97, 98, 99], 4), of([0x30, 97, 98, 99], 2), of([0x1f, 97, 1, 0, 255], 99),
        of([0xf0, 255, 255], 600), of([0x12, 97, 1], 7)];
    })""")
    good = ['abc', 'aaaaaaab', 'a' * 255, 'abcabcabc', '']
    case.check(results[:5] == good, f'blocks are decoded')
    case.check(results[5:] == [None] * 8, 'damaged ones are refused')


def slide(case, selector, key, times=1):
    """Presses a key in a slider."""
    case.page.evaluate(f"document.querySelector('{selector}').focus()")
    for _ in range(times):
        case.page.key(key, code=key)
    case.page.evaluate("document.activeElement.blur()")


def show_two_teeth(case, iso):
    """In place of the run before; the hand rests and nothing is over the picture."""
    page, rig = case.page, case.rig
    rig.end('controller')
    rig.end('emulator')
    case.check(page.until('document.body.dataset.state === "ended"'), 'the run before has ended')
    rig.write('scene.toml', TWO_TEETH.replace('ISO', iso))
    rig.write('hand.toml', AWAY)
    rig.start_run()
    case.check(page.until('document.body.dataset.state === "live" && document.body.dataset.tick > 4500'), f'two teeth of iso {iso}')
    case.check(page.until("document.getElementById('banner').hidden"), 'nothing is over the picture')


def looks_as_asked_by_volume_iso_and_opacity(case):
    page, rig = case.page, case.rig
    x, y, width, height = map(int, page.box('#picture'))
    show_two_teeth(case, '0.45')
    slide(case, '#renderer1', 'ArrowDown')
    mixed = case.settle()
    like = likeness(mixed, rig.native_picture(width, height, '--renderer', 'iso,blend'))
    case.check(like >= LIKE, f'iso beside blend: {100 * like:.3f} %')
    slide(case, '#opacity1', 'End')
    case.check(page.evaluate(text_of('#opacity1 + output')) == '1.000', 'a slider goes up to opacity 1')
    solid = case.settle()
    name = page.evaluate("document.querySelector('#opacity1').parentElement.firstChild.textContent")
    rig.write('transfer.toml', f'[opacity]\n{name} = 1.0\n')
    like = likeness(solid, rig.native_picture(width, height, '--renderer', 'iso,blend', '--transfer',
                                              rig.path('transfer.toml')))
    case.check(like >= LIKE, f'opacity 1 of {name}: {100 * like:.3f} %')
    case.check(likeness(solid, mixed) < LIKE, 'which is seen')
    slide(case, '#renderer1', 'ArrowUp')
    case.check(not page.evaluate("document.querySelector('#opacity1').checkVisibility()"), 'iso has no opacities')
    iso = case.settle()
    slide(case, '#iso', 'ArrowRight', 10)
    case.check(page.evaluate(text_of('#iso + output')) == '0.55', 'a slider moves iso')
    moved = case.settle()
    case.check(likeness(moved, iso) < LIKE, 'which is seen')
    # The same teeth of that iso by themselves.
    show_two_teeth(case, '0.55')
    # Below the tool, which has turned about itself.
    like = likeness(moved, rig.native_picture(width, height), (width, height * 2 // 5))
    case.check(like >= LIKE, f'iso 0.55: {100 * like:.3f} %')


def public_key_of(pem_file):
    """SHA-256 of the public key of a certificate, as Chromium names it."""
    with open(pem_file) as text:
        der = ssl.PEM_cert_to_DER_cert(text.read())

    def element(at):
        """Where its content begins and ends (DER)."""
        length, at = der[at + 1], at + 2
        if length & 0x80:
            size = length & 0x7f
            length, at = int.from_bytes(der[at:at + size], 'big'), at + size
        return at, at + length

    at, _ = element(element(0)[0])  # what is signed, in the certificate
    for _ in range(6):              # version, number, algorithm, issuer, time, subject
        _, at = element(at)
    return base64.b64encode(hashlib.sha256(der[at:element(at)[1]]).digest()).decode()


def is_secured(case):
    identity = case.rig.make_identity()
    case.rig.end('bridge')
    address = case.rig.start_bridge('127.0.0.1:0', *case.bridge, '--identity', identity)
    case.check(address.startswith('https://'), 'with an identity it is https')
    trust = '--ignore-certificate-errors-spki-list=' + public_key_of(os.path.join(identity, 'ca.pem'))
    with tempfile.TemporaryDirectory() as folder:
        page = Page(case.chromium, folder, [trust])
        try:
            page.size(WIDTH, HEIGHT)
            page.go(address)
            case.check(page.until('document.body?.dataset.state === "live"'), 'who trusts the CA has the page')
            sockets = [event['params']['url'] for event in page.events
                       if event.get('method') == 'Network.webSocketCreated']
            case.check(sockets and all(url.startswith('wss://') for url in sockets), 'over wss')
            cookies = page.call('Network.getCookies')['cookies']
            case.check(cookies and all(one['secure'] and one['httpOnly'] for one in cookies), 'the cookie is secure')
            page.call('Network.clearBrowserCookies')
            page.go(address.split('?')[0] + '?token=a-token-that-is-none')
            case.check(page.until('document.body?.innerText.includes("This picture needs a token")'),
                       'a wrong token is told')
            page.go(address.replace('https:', 'http:'))
            case.check(page.until('document.body?.innerText.includes("This port speaks TLS only: open it with https://")'),
                       'so is plain HTTP')
        finally:
            page.close()
    with tempfile.TemporaryDirectory() as folder:
        page = Page(case.chromium, folder)
        try:
            told = page.call('Page.navigate', url=address).get('errorText')
            case.check(told == 'net::ERR_CERT_AUTHORITY_INVALID', 'who does not trust the CA is warned by the browser')
        finally:
            page.close()


def says_what_is_missing(case):
    with tempfile.TemporaryDirectory() as folder:
        bare = Page(case.chromium, folder, ['--disable-3d-apis'])
        try:
            bare.size(WIDTH, HEIGHT)
            bare.go(case.address)
            case.check(bare.until(text_of('#missing') + ".includes('no WebGL 2')"), 'a browser without WebGL 2 is told')
            case.check(bare.until('document.body?.dataset.state === "live"'), 'and sees the figures')
        finally:
            bare.close()


CASES = [shows_what_the_visualizer_shows, is_turned_by_mouse_fingers_and_keys, is_reached_by_keyboard,
         decodes_lz4_and_refuses_what_is_none, commands_where_allowed, is_small_and_breaks_no_rule,
         tells_faults_and_ends, says_what_is_missing, looks_as_asked_by_volume_iso_and_opacity, is_secured]


def main():
    chromium = find_chromium()
    if not chromium:
        print('page: there is no browser; apt-get install chromium')
        return 77
    with tempfile.TemporaryDirectory(prefix='kerf-page-') as work:
        rig = Rig(sys.argv[1], work)
        case = None
        try:
            case = Case(rig, chromium, os.path.join(work, 'profile'))
            for one in CASES:
                if len(sys.argv) < 3 or one.__name__ in sys.argv[2:]:
                    began = time.monotonic()
                    print(one.__name__, flush=True)
                    one(case)
                    print(f'  {time.monotonic() - began:.1f} s', flush=True)
        except AssertionError as problem:
            print(f'page: {problem}: no')
            return 1
        finally:
            if case:
                case.page.close()
            rig.close()
    return 0


if __name__ == '__main__':
    sys.exit(main())
