# SPDX-License-Identifier: Apache-2.0
"""A visitor with a link, a keyboard alone, or a page around the page, in headless Chromium.

    visitor_test.py PAGE-FOLDER [--pictures FOLDER]

PAGE-FOLDER is what ./kerf page wrote. Exit code 77: skipped, for want of it or of a browser."""
import sys
import time

from tab import IS_LED, REMOVED, RUNS, arguments, check, exit_code, keep

MISSING = "document.getElementById('missing')"
SMALL = """[...document.querySelectorAll('button, select, input, summary, a')].filter(e => e.checkVisibility()).map(e =>
  [e.id || e.tagName, e.getBoundingClientRect()]).filter(([, r]) => r.width < 24 || r.height < 24).map(([name, r]) => `${name} ${r.width} x ${r.height}`)"""


def link_shows_what_it_says(page, address):
    page.go(f'{address}/#scene=nosuch')
    check(page.until(f'{MISSING}?.hidden === false', 60), 'an unknown scene is refused')
    time.sleep(2)
    said = page.evaluate(f'{MISSING}.textContent')
    check('scene=nosuch: use phantom, touch' in said and page.evaluate('document.body.dataset.run') == 'refused', said)
    check(page.evaluate("document.getElementById('state').textContent") == 'not started', 'nothing runs')
    keep(page, 'refused')
    words = '#scene=torus&hand=mine&set=force.stiffness_n_per_mm=0.7&view=20,40,60,1,0,0&iso=0.4'
    page.evaluate(f'location.hash = {words!r}')
    check(page.until(RUNS, 120) and page.evaluate(f'{MISSING}.hidden'), 'the address is corrected: it runs')
    time.sleep(1)
    check(page.evaluate('location.hash') == words, f"the address stays {page.evaluate('location.hash')}")
    check(page.evaluate("document.getElementById('stiffness').value") == '0.7', 'the slider has its value')
    page.press('#clip')
    time.sleep(1)
    check(page.evaluate('location.hash') == words + '&clip=z:0.5', 'a control is in the address')
    page.press('#copy')
    check(page.until("document.getElementById('copied').textContent !== ''", 5), 'the link is copied')
    page.go('about:blank')
    page.go(f'{address}/{words}')
    check(page.until(RUNS, 120) and page.evaluate('location.hash') == words, 'another tab shows the same')


def keys_alone_cut(page, address):
    page.go('about:blank')
    page.go(f'{address}/#scene=phantom&hand=mine')
    check(page.until(IS_LED, 120), 'the hand waits to be led')
    for _ in range(2):  # the picture is the first thing of the page
        if page.evaluate('document.activeElement.id') != 'picture':
            page.key('Tab', code='Tab')
    check(page.evaluate("document.activeElement.id === 'picture' && getComputedStyle(document.activeElement).outlineStyle !== 'none'"),
          'tab goes to the picture, which is seen to have the focus')
    check('space bar' in page.evaluate("document.getElementById(document.activeElement.getAttribute('aria-describedby')).textContent"),
          'what its keys do is told')

    def hold(kind, key, code):
        page.call('Input.dispatchKeyEvent', type=kind, key=key, code=code, windowsVirtualKeyCode=32 if key == ' ' else 0)
    before, end = page.evaluate(REMOVED), time.monotonic() + 60
    for key, seconds in (('ArrowDown', 0.4), *[('PageUp', 0.3)] * 40):  # from above the crown into it
        if time.monotonic() > end or page.evaluate("parseFloat(document.getElementById('force').textContent) > 0.03"):
            break
        hold('keyDown', key, key)
        time.sleep(seconds)
        hold('keyUp', key, key)
        time.sleep(0.3)
    check(page.evaluate("parseFloat(document.getElementById('force').textContent)") > 0.03, 'arrow down and page up lead to the tooth')
    check(page.evaluate(REMOVED) == before, 'which cuts nothing')
    end = time.monotonic() + 60
    hold('keyDown', ' ', 'Space')
    while time.monotonic() < end and not page.evaluate(REMOVED) > before + 0.05:
        for key in ('ArrowLeft', 'ArrowRight'):
            for kind in ('keyDown', 'keyUp'):
                hold(kind, key, key)
                time.sleep(0.1)
    hold('keyUp', ' ', 'Space')
    time.sleep(1)
    after = page.evaluate(REMOVED)
    check(after > before + 0.05, f'space cuts: {after} mm3')
    time.sleep(1)
    check(page.evaluate(REMOVED) == after, 'space is up: it rests')
    check(page.evaluate("document.body.innerText.match(/removed/g).length") == 1, 'one figure of what was removed')


def is_large_enough(page):
    for width, height in ((1280, 800), (390, 844), (320, 568), (200, 200)):
        page.size(width, height, touch=width < 400)
        time.sleep(1)
        keep(page, f'{width}x{height}')
        check(page.evaluate('document.documentElement.scrollWidth') <= width, f'nothing is beside {width} pixels')
        small = page.evaluate(SMALL)
        check(small == [], f'each control has 24 pixels at {width}: {small}')
        if width < 400:
            check(page.box('#view')[3] < height, 'something of the panel is seen')


def leaves_the_wheel_to_a_page_around_it(page, address):
    page.size(1280, 800)
    page.go(f'{address}/kerf.css')  # any file of the same origin: what is around it is written here
    time.sleep(1)
    page.evaluate("document.body.style.height = '5000px', document.body.innerHTML = '<iframe src=\"./#scene=touch\" width=900 height=500></iframe>'")
    check(page.until("document.querySelector('iframe').contentDocument.body?.dataset.run === 'runs'", 120), 'it runs in a frame')
    page.mouse('mouseMoved', 150, 200)
    page.mouse('mouseWheel', 150, 200, deltaX=0, deltaY=60)
    check(page.until('scrollY > 0', 10), 'a wheel over the frame scrolls the page around it')
    page.evaluate('scrollTo(0, 0)')
    time.sleep(0.5)
    page.drag([(150, 200)])
    time.sleep(0.5)
    page.mouse('mouseWheel', 150, 200, deltaX=0, deltaY=60)
    time.sleep(2)
    check(page.evaluate('scrollY') == 0, 'after a click it is the picture\'s')


def is_described(page, address):
    page.go(f'{address}/')
    content = "[...document.querySelectorAll('meta[name=description], meta[property^=\"og:\"]')].map(e => e.content)"
    check(page.until(f'{content}.length >= 5 && {content}.every(Boolean)', 10), f'described: {page.evaluate(content)}')
    check(page.evaluate("fetch(document.querySelector('meta[property=\"og:image\"]').content).then(a => a.ok)"), 'its picture is there')


def all_visits(page, address):
    link_shows_what_it_says(page, address)
    keys_alone_cut(page, address)
    is_large_enough(page)
    leaves_the_wheel_to_a_page_around_it(page, address)
    is_described(page, address)


sys.exit(exit_code(*arguments(__doc__, 'PAGE-FOLDER'), all_visits))
