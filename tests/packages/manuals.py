#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""manuals.py ROOT BUILD: every option of each program's --help stands in its man page, which roff reads without a
word, and bash offers it. Exit code 77: all else is fine, but there is no groff.

Of ./kerf: every command and option of its own."""
import pathlib
import re
import shutil
import subprocess
import sys

root, build = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
wrong = []
roff = shutil.which('groff')


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def options_in(text):
    """Those that a help lists: at the start of a line, and behind a comma."""
    return {word for line in re.findall(r'^ +(-[^ ]+)', text, re.M) for word in line.split(',') if word.startswith('-')}


def offered(name, words):
    """What bash offers for the last of these words."""
    script = (f'. {build}/completion/{name}; COMP_WORDS=({name} {" ".join(words)} ""); COMP_CWORD={len(words) + 1};'
              f'_{name.replace("-", "_")} {name} -- {words[-1] if words else name}; printf "%s\\n" "${{COMPREPLY[@]}}"')
    return set(said('bash', '-c', script).split())


def check(name, page, words, wanted):
    plain = page.replace('\\-', '-')
    for option in sorted(wanted):
        if not re.search(re.escape('\\fB' + option + '\\fR'), plain):
            wrong.append(f'{name}.1: lacks {" ".join([*words, option])}')
    for option in sorted(o for o in wanted if o.startswith('--')):
        if option not in offered(name, words):
            wrong.append(f'completion of {name}: lacks {" ".join([*words, option])}')


names = sorted(p.stem for p in (build / 'man').glob('*.1'))
checked = 0
for name in names:
    page = (build / 'man' / (name + '.1')).read_text()
    if roff:
        odd = subprocess.run(['groff', '-man', '-Tutf8', '-ww', '-z', build / 'man' / (name + '.1')], capture_output=True, text=True)
        wrong += odd.stderr.splitlines()
    if name == 'kerf':
        plain = page.replace('\\-', '-').replace('\\e', '\\')
        for command in ('demo', 'bench', 'doctor'):  # an installed kerf has them
            if said(root / 'kerf', 'help', command).replace('./kerf', 'kerf').strip() not in plain:
                wrong.append(f'kerf.1: has not what kerf help {command} says')
        if 'kerf setup' in plain or './kerf' in plain:
            wrong.append('kerf.1: is of a clone')
        # What is typed behind `kerf`, and what bash offers then; behind an option no other options.
        for words, offer in [(['demo', '--sec'], ['--seconds']), (['demo', '--device', 'o'], ['omni', 'omega']),
                             (['demo', '--renderer', 'cast'], ['cast', 'cast-blend']), (['demo', '--port', 'u'], ['usb']),
                             (['demo', '--gradient', 'f'], ['farid5']), (['demo', '--scene', 'two'], ['two_arms', 'two_teeth']),
                             (['demo', '--scene', 'scenes/wal'], ['scenes/wall.toml']), (['demo', '--hand', 'mo'], ['mouse']),
                             (['demo', '--volume', 'sce'], ['scenes']), (['demo', '--seconds', ''], []),
                             (['demo', '--mute', '--sec'], ['--seconds']), (['test', '--preset', 'a'], ['asan'])]:
            script = (f'. {build}/completion/kerf; cd {root}; COMP_WORDS=({root}/kerf {" ".join(words[:-1])} "{words[-1]}");'
                      f'COMP_CWORD={len(words)}; _kerf {root}/kerf "{words[-1]}" {words[-2]}; echo "${{COMPREPLY[@]}}"')
            found = [word for word in said('bash', '-c', script).split() if offer != ['mouse'] or word == 'mouse']
            if sorted(found) != sorted(offer):
                wrong.append(f'completion of kerf: offers {found} for {" ".join(words)}')
        continue
    program = build / 'bin' / name
    help_text = said(program, '--help')
    check(name, page, [], options_in(help_text))
    commands = re.findall(r'^  ([a-z][a-z-]*) ', help_text.partition('Subcommands:')[2], re.M)
    for command in commands:
        if command not in said('bash', '-c', f'. {build}/completion/{name}; COMP_WORDS=({name} ""); COMP_CWORD=1; _{name.replace("-", "_")} {name} "" {name}; echo "${{COMPREPLY[@]}}"').split():
            wrong.append(f'completion of {name}: lacks {command}')
        options = options_in(said(program, command, '--help'))
        check(name, page, [command], options)
        checked += len(options)
    checked += len(options_in(help_text))
print('\n'.join(wrong) or f'manuals: {len(names)} pages, {checked} options' + ('' if roff else '\nskipped: no groff to read them'))
sys.exit(1 if wrong else 0 if roff else 77)
