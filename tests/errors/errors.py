#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/errors/errors.md: what each program says to wrong input, made by giving it that input.

errors.py ROOT BIN check|write|show [WORD]    WORD, of show: only the cases whose title or lines have it

Each case of cases.txt runs in a folder of its own, with the rights of a user. It must end with the exit
code that its title says, leave nothing behind, and say one line, "place: what is wrong; way out". `check`
compares all with the page, `write` makes the page.
"""
import concurrent.futures
import difflib
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / 'support'))
import lack

# Commands that have another answer without a network; then their rows are not compared.
NETWORKED = ('--port udp:0', ' 192.0.2.1:', 'ws://127.0.0.1:9 --wait')
SECONDS = 20  # that one case may take
LONGEST = 400  # characters of an answer
HEAD = """# What it says to wrong input

Made by `tests/errors/errors.py`, which gives the programs these inputs and looks at what comes back: always one
line on the standard error, with the place, what is wrong there and the way out, and exit code 2; but 1 where it says
"(1)": a recording, which is a folder with a file `ticks.npy`, that is damaged or contradicts itself. A refused command leaves
no file and no folder behind. `cases.txt` beside it has the files that each case needs.
"""
# Runs the lines of a case; what the last one says goes into a file, and what it leaves is told.
SHELL = r'''
. "$HERE/prelude.sh"
{ %s
} >/dev/null
there() { find . -path ./private -prune -o -print | sort; }
there >private/before
( %s ) 2>private/said
code=$?
there | comm -13 private/before - >private/left
exit $code
'''


def cases():
    """(part, title, lines of bash, of which the last is the command) in the order of cases.txt."""
    part, title, lines = '', '', []
    for line in (HERE / 'cases.txt').read_text().splitlines() + ['']:
        if line.startswith('  '):
            lines.append(line[2:])
            continue
        if lines:
            yield part, title, lines
            lines = []
        if line.startswith('== '):
            part = line[3:]
        elif not line.startswith('#'):
            title = line


class Runner:
    def __init__(self, root, programs, shared):
        self.root, self.programs, self.shared = root, programs, shared

    def __call__(self, lines, folder=None):
        """Exit code and what was said, with DIR for the folder that it ran in; or what else is wrong."""
        if folder is None:
            with tempfile.TemporaryDirectory(prefix='kerf-errors-', ignore_cleanup_errors=True) as own:
                return self(lines, own)
        os.symlink(self.root / 'scenes', f'{folder}/scenes')
        os.mkdir(f'{folder}/private', 0o700)
        private = pathlib.Path(folder, 'private')
        environment = {
            'PATH': f'{self.programs}:{self.root}:/usr/sbin:/usr/bin:/sbin:/bin', 'HOME': folder, 'LC_ALL': 'C.UTF-8',
            'KERF_BIN': str(self.programs), 'TMPDIR': f'{folder}/private', 'XDG_RUNTIME_DIR': f'{folder}/private',
            'HERE': str(HERE), 'LOG': f'{self.shared}/log', 'MPLCONFIGDIR': f'{self.shared}/fonts',
            'MESA_SHADER_CACHE_DISABLE': 'true',  # else llvmpipe of Debian 13 leaves files in HOME
            'KERF_HIDE_SETS': os.environ.get('KERF_HIDE_SETS', '')}
        # Root without its power over files: what a user has no rights to, it has none to either.
        user = ['setpriv', '--bounding-set=-dac_override,-dac_read_search', '--inh-caps=-all']
        shell = subprocess.Popen(
            [*(user if os.geteuid() == 0 else []), 'bash', '-c', SHELL % ('\n'.join(lines[:-1]) or ':', lines[-1])],
            cwd=folder, env=environment, start_new_session=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            odd = shell.communicate(timeout=SECONDS)[1].decode()
        except subprocess.TimeoutExpired:
            odd = f'still at work after {SECONDS} s'
        finally:
            try:
                os.killpg(shell.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            shell.wait()
            subprocess.run(['chmod', '-R', 'u+rwx', folder], stderr=subprocess.DEVNULL)
        left = private / 'left'
        if odd or not left.exists():
            return -1, odd or 'what it needs could not be made'
        said = (private / 'said').read_text(errors='replace').rstrip('\n').replace(folder, 'DIR')
        said = re.sub(r'process \d+', 'process N', said)
        said = re.sub(r'ended on .* GMT', 'ended on DAY', said)
        said = re.sub(r'(screen cannot be opened) \((X11: Failed to open|Failed to detect)[^)]*\)', r'\1 (REASON)', said)
        said = re.sub(r'the recording ends at tick \d+', 'the recording ends at tick N', said)  # it runs by the clock
        # A note of another process, and no answer: on a busy machine it comes before the answer or after it.
        said = re.sub(r'^kerf-controller: waiting for .*\n?', '', said, flags=re.M)
        # This machine gives no right to real time.
        said = re.sub(r'^kerf-[a-z]+: warning: no (right to )?(SCHED_FIFO|locked memory) .*\n?', '', said, flags=re.M).rstrip('\n')
        return shell.returncode, said + ''.join(f'\nleft: {name}' for name in left.read_text().splitlines())


def faults(title, code, said):
    if code != (wanted := 1 if title.endswith(' (1)') else 2):
        yield f'exit code {code}, not {wanted}'
    if '\n' in said or not said:
        yield f'{len(said.splitlines())} lines'
    elif not re.match(r'kerf(-[a-z]+)?: .', said):
        yield 'no program'
    elif len(said) > LONGEST:
        yield f'{len(said)} characters'


def code_span(text):
    fence = '``' if '`' in text else '`'
    space = ' ' if '`' in text else ''
    return fence + space + text.replace('|', r'\|') + space + fence


def page(chosen, ends):
    lines, part = [HEAD.rstrip('\n')], None
    for (of, title, commands), (_, said) in zip(chosen, ends):
        if of != part:
            part = of
            lines += ['', f'## {part}', '', '| what is wrong | command | answer |', '|---|---|---|']
        lines.append(f'| {title} | {code_span(commands[-1])} | {code_span(said)} |')
    return '\n'.join(lines) + '\n'


def main():
    root, programs = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
    mode, word = sys.argv[3], (sys.argv[4:] or [''])[0]
    chosen = [c for c in cases() if word in '\n'.join([c[0], c[1], *c[2]])]
    left_out = () if lack.has_network() else NETWORKED
    if left_out:
        print('skipped: ' + lack.NETWORK)
    chosen = [c for c in chosen if not any(part in c[2][-1] for part in left_out)]
    with tempfile.TemporaryDirectory(prefix='kerf-errors-shared-') as shared:
        run = Runner(root, programs, shared)
        if run(['record_log', 'true'], shared)[0] != 0:
            sys.exit('errors: the recording that some cases need could not be made')
        # Most of them wait.
        with concurrent.futures.ThreadPoolExecutor(max_workers=8) as pool:
            ends = list(pool.map(lambda case: run(case[2]), chosen))
    wrong = 0
    for (part, title, lines), (code, said) in zip(chosen, ends):
        found = list(faults(title, code, said))
        wrong += bool(found)
        if found or mode == 'show':
            print(f'{part}: {title}: {lines[-1]}\n    {said}' + ''.join(f'\n    *** {fault}' for fault in found))
    made, file = page(chosen, ends), root / 'tests/errors/errors.md'
    if mode == 'write':
        file.write_text(made)
    elif mode == 'check':
        before = ''.join(line for line in file.read_text().splitlines(True) if not any(part in line for part in left_out))
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), made.splitlines(True), 'tests/errors/errors.md', 'now', n=0))
        wrong += before != made
    print(f'errors: {len(chosen)} cases, {wrong} wrong')
    sys.exit(wrong != 0)


main()
