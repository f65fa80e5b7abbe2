# SPDX-License-Identifier: Apache-2.0
"""The page of kerf-bridge in headless Chromium: real input, and its pixels beside the native picture.

    page_test.py BIN-FOLDER [CASE...]

Exit code 77: skipped, for want of a browser."""
import os
import sys
import tempfile
import time

from browser import Page, find_chromium
from case import Case, figure, HEIGHT, LIKE, likeness, PANEL, text_of, WIDTH
from looks import looks_as_asked_by_volume_iso_and_opacity
from rig import Rig, TOKEN
from secured import is_secured
from troubles import (draws_small_until_it_knows_the_cost, says_why_there_is_no_picture, shows_whole_passes_only,
                      tells_how_old_a_picture_is, uploads_few_boxes)


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
                moves('the wheel', lambda: (page.evaluate("document.getElementById('picture').focus()"),
                                            page.mouse('mouseWheel', x, y, deltaX=0, deltaY=-200)))]
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
    for _ in range(30):
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
    # The motors are on since tick 300: before that nothing is lost with the reports, and no fault told.
    case.check(page.until('Number(document.body.dataset.tick) > 1000'), 'the hand is at work')
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
    case.check(page.until(text_of('#banner') + ".startsWith('No news')"), 'over the picture, too')
    page.evaluate("""window.both = 0; new MutationObserver(() => window.both += document.body.dataset.state === 'live' &&
      !document.getElementById('banner').hidden && document.getElementById('banner').textContent.startsWith('No news'))
      .observe(document.body, {attributeFilter: ['data-state']})""")
    rig.start_bridge(address, *case.bridge)
    case.check(page.until('document.body.dataset.state === "live"'), 'and joined again')
    case.check(page.evaluate('window.both') == 0, 'and never both')


def is_small_and_breaks_no_rule(case):
    page = case.page
    page.go(case.address)
    case.check(page.until('document.readyState === "complete"'), 'loaded')
    page.events.clear()
    page.go(case.address)
    case.check(page.until('document.body?.dataset.state === "live"'), 'loaded again')
    sizes = [event['params']['encodedDataLength'] for event in page.events
             if event.get('method') == 'Network.loadingFinished']
    case.check(0 < sum(sizes) < 220_000, f'{sum(sizes)} bytes in {len(sizes)} files before the volume')
    wrong = [event['params'] for event in page.events
             if event.get('method') == 'Runtime.exceptionThrown' or
             event.get('method') == 'Log.entryAdded' and event['params']['entry']['level'] == 'error']
    case.check(not wrong, f'no error and no broken rule {wrong or ""}')
    unnamed = page.evaluate("""performance.getEntriesByType('resource').map(one => one.name.split('/').pop())
      .filter(name => name.endsWith('.js') && !document.querySelector(`[src="${name}"], [href="${name}"]`))""")
    case.check(not unnamed, f'index.html names every module, so that all come at once {unnamed or ""}')
    case.check(TOKEN not in page.evaluate('location.href'), 'the address keeps no token')


def follows_a_view_and_presents_its_own(case):
    page, rig, look = case.page, case.rig, '20,30,40,0,2,0,0.3,1,0'
    x, y, width, height = map(int, page.box('#picture'))
    rig.start('visualizer', '--headless', '--name', rig.name, '--present', '--camera', look, '--size', '64x64',
              '--every-ticks', '1000000000', '--out', rig.path('presenter'))
    case.check(page.until("!document.getElementById('follows').hidden"), 'a window presents its view')
    page.press('#follow')
    page.evaluate("document.activeElement.blur()")
    case.check(page.until("document.getElementById('picture').dataset.state === 'moving'"), 'the page follows it')
    seen, native = case.settle(), rig.native_picture(width, height, '--camera', look)
    like = likeness(seen, native)
    case.check(like >= LIKE, f'with the picture of kerf-visualizer --camera: {100 * like:.3f} %')
    rig.end('visualizer')
    case.check(page.until(text_of('#presenter') + ".startsWith('the presenter has gone')"), 'its end is told')
    case.check(likeness(case.settle(), seen) >= LIKE, 'and its last view stays')
    page.drag([case.middle(), (case.middle()[0] + 40, case.middle()[1])])
    case.check(page.until("!document.getElementById('follow').checked"), 'who moves the view has an own one')
    page.press('#present')
    page.evaluate("document.activeElement.blur()")
    own = case.settle()
    case.check(likeness(own, native) < LIKE, 'which is another')
    time.sleep(0.5)  # a message of the page, a file of the bridge
    like = likeness(own, rig.native_picture(width, height, '--follow-view'))
    case.check(like >= LIKE, f'kerf-visualizer --follow-view shows what the page presents: {100 * like:.3f} %')
    page.press('#present')
    case.choose('#picture', 'r')
    page.evaluate("document.activeElement.blur()")
    case.settle()


def decodes_lz4_and_refuses_what_is_none(case):
    results = case.page.evaluate("""import('./wire.js').then(({unpack}) => {
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


def says_what_is_missing(case):
    with tempfile.TemporaryDirectory() as folder:
        bare = Page(case.chromium, folder, ['--disable-3d-apis'])
        try:
            bare.size(WIDTH, HEIGHT)
            bare.go(case.address)
            case.check(bare.until(text_of('#missing') + ".includes('no WebGL 2')"), 'a browser without WebGL 2 is told')
            case.check(bare.until('document.body?.dataset.state === "live"'), 'and sees the figures')
            # As for a browser that keeps no cookie.
            bare.call('Network.setBlockedURLs', urls=['*.js', '*.css'])
            bare.call('Page.reload')
            case.check(bare.until(text_of('#state') + ".includes('where scripts or cookies are off')"),
                       'so is one whose scripts do not come')
        finally:
            bare.close()


CASES = [shows_what_the_visualizer_shows, is_turned_by_mouse_fingers_and_keys, is_reached_by_keyboard,
         follows_a_view_and_presents_its_own,
         decodes_lz4_and_refuses_what_is_none, shows_whole_passes_only, uploads_few_boxes,
         draws_small_until_it_knows_the_cost, says_why_there_is_no_picture, commands_where_allowed,
         is_small_and_breaks_no_rule, tells_how_old_a_picture_is, tells_faults_and_ends, says_what_is_missing,
         looks_as_asked_by_volume_iso_and_opacity, is_secured]


def main():
    chromium = find_chromium()
    if not chromium:
        print('skipped: no browser; apt-get install chromium')
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
