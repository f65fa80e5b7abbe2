# SPDX-License-Identifier: Apache-2.0
"""Renderers by volume, iso value and opacities, beside native pictures of the same look."""
from case import LIKE, PANEL, likeness, text_of
from rig import AWAY, TWO_TEETH


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
    # Below the figures and the tool, which has turned about itself.
    below = (width, PANEL[1])
    case.check(likeness(moved, iso, below) < LIKE, 'which is seen there too')
    like = likeness(moved, rig.native_picture(width, height), below)
    case.check(like >= LIKE, f'iso 0.55: {100 * like:.3f} %')
