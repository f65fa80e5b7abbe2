# SPDX-License-Identifier: Apache-2.0
"""What these examples share: wrong words are answered with the usage, wrong files with one line; exit code 2."""
import inspect
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))  # kerf_reader, or install that


def run(draw, usage):
    """draw(*words of the command line)."""
    words = sys.argv[1:]
    try:
        inspect.signature(draw).bind(*words)
    except TypeError:
        print(usage, file=sys.stderr)
        sys.exit(2)
    try:
        draw(*words)
    except (OSError, ValueError) as error:
        print(f"{sys.argv[0]}: " + " ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
