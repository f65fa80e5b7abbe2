#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Normals that the page draws of cubes and of voxels with unequal edges, in headless Chromium with the page's own modules.

    normals_test.py [CASE...]      print_all: the angles alone
Exit code 77: skipped, for want of a browser."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

from tab import ROOT, check, exit_code

# Those of the visualizer's own test, at 99 of 100 points.
MOST_DEGREES, MOST_OF_BINARY = 3.0, 3.75
RATIOS = [(1, 1, 1), (1, 1, 2), (2, 1, 1), (1, 2, 1), (1, 1, 5), (1, 5, 1), (5, 1, 1), (1, 1, 10), (1, 10, 1), (10, 1, 1), (1, 10, 10)]
FEW = [(1, 1, 1), (1, 1, 1.5), (1, 3.7, 1), (1, 2, 8), (10, 1, 1), (1, 10, 10)]


def make_folder(folder):
    """The page's modules, with shaders whose light is the normal."""
    for place in ('bridge/page/web/*.js', 'tests/web/browser_script/*.js'):
        for file in ROOT.glob(place):
            shutil.copy(file, folder)
    light = folder / 'normals.cmake'
    light.write_text((ROOT / 'visualizer/gl/web_shaders.cmake').read_text().replace('lighting.frag', 'normals.frag'))
    for output, arguments in (('constants.js', [f'-DROOT={ROOT}', '-P', ROOT / 'bridge/page/constants.cmake']),
                              ('shaders.js', [f'-DSHADERS={ROOT}/shaders', '-P', light])):
        subprocess.run(['cmake', f'-DOUTPUT={folder / output}', *arguments], check=True)
    (folder / 'index.html').write_text('<!doctype html><title>normals</title>')


class Bodies:
    """The functions of bodies.js in a tab."""

    def __init__(self, page):
        self.page = page

    def call(self, name, ratio, *words):
        edges = [0.1 * one for one in ratio]
        given = ', '.join([str(edges), *(f"'{word}'" for word in words)])
        return self.page.evaluate(f"import('./bodies.js').then(bodies => bodies.{name}({given}))")

    def angles(self, ratio, *words):
        found = self.call('anglesOf', ratio, *words)
        assert found['error'] == 0 and found['pixels'] > 200, found
        return found


def balls_have_their_normals(bodies):
    for ratios, kind, border, most in ((RATIOS, 'iso', 'partial', MOST_DEGREES), (FEW, 'iso', 'binary', MOST_OF_BINARY),
                                       (FEW, 'blend', 'partial', MOST_DEGREES)):
        for ratio in ratios:
            p99 = bodies.angles(ratio, kind, border)['p99']
            check(p99 < most, f'{kind}, {border} border, edges {ratio}: {p99:.2f} degrees at 99 of 100 points')


def a_trench_within_a_thick_slice_has_walls(bodies):
    found = bodies.angles((1, 1, 10), 'iso', 'trench')
    check(found['median'] < 15, f"walls of a trench of half a slice: {found['median']:.1f} degrees in the middle of {found['pixels']} pixels")


def cuts_are_drawn_as_if_made_anew(bodies):
    for ratio in ((1, 1, 1), (1, 1, 2), (1, 5, 1)):
        for kind in ('iso', 'blend'):
            found = bodies.call('wrongAfterCuts', ratio, kind)
            check(found['wrong'] == 0 and found['changed'] > 1000 and found['drawn'] > 0 and found['error'] == 0,
                  f'{kind}, edges {ratio}: {found}')


def the_longest_voxels_are_drawn(bodies):
    for ratio in ((1, 1, 100), (100, 1, 1), (1, 100, 100)):
        for kind in ('iso', 'blend'):
            found = bodies.call('anglesOf', [0.3 * one for one in ratio], kind)
            check(found['error'] == 0, f'{kind}, edges {ratio}: {found}')


def print_all(bodies):
    for ratio in sorted({*FEW, *RATIOS}):
        print(ratio, *(f"{kind} {border} {bodies.angles(ratio, kind, border)['p99']:.2f}" for kind in ('iso', 'blend')
                       for border in ('partial', 'binary')), flush=True)


CASES = [balls_have_their_normals, a_trench_within_a_thick_slice_has_walls, cuts_are_drawn_as_if_made_anew,
         the_longest_voxels_are_drawn, print_all]


def all_cases(page, address):
    page.go(address + '/index.html')
    page.until("document.title === 'normals'")
    for case in CASES:
        if case.__name__ in sys.argv[1:] or (len(sys.argv) == 1 and case is not print_all):
            case(Bodies(page))


if __name__ == '__main__':
    with tempfile.TemporaryDirectory() as made:
        make_folder(pathlib.Path(made))
        sys.exit(exit_code(pathlib.Path(made), all_cases, needs=()))
