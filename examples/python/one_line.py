# SPDX-License-Identifier: Apache-2.0
"""What these examples share: wrong words are answered with the usage, wrong files and missing packages with one line;
exit code 2."""
import importlib.util
import inspect
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))  # kerf_reader, or install that
if not importlib.util.find_spec("matplotlib"):  # which needs NumPy
    print(f"{sys.argv[0]}: matplotlib is not installed; on Debian: sudo apt install python3-matplotlib", file=sys.stderr)
    sys.exit(2)


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
