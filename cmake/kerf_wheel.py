#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the wheel of `import kerf` (docs/python.md): the module, its Python files, and the scenes and hands that come with kerf.

    python3 cmake/kerf_wheel.py VERSION MODULE OUT        by the Python for which MODULE is

It is of this Python and system alone: its tag promises no other. The module has kerf itself; libraries of others it loads from the
system, and their Debian packages stand in the page."""
import pathlib
import subprocess
import sys
import sysconfig

from wheel_file import ROOT, Refusal, stripped, write

METADATA = """Metadata-Version: 2.1
Name: kerf
Version: {version}
Summary: A haptic servo with emulated devices, recordings and stability maps
License: Apache-2.0
Requires-Python: =={python}.*
Requires-Dist: numpy<2
Classifier: Operating System :: POSIX :: Linux
Description-Content-Type: text/markdown

{page}"""


def files_of(module):
    """{path in the wheel: bytes}."""
    python = ROOT / "python"
    texts = {str(path.relative_to(python)): path for package in ("kerf", "kerf_reader") for path in (python / package).glob("*.py")}
    scenes = (path for pattern in ("*.toml", "*.stl") for path in (ROOT / "scenes").rglob(pattern))
    texts |= {f"kerf/{path.relative_to(ROOT)}": path for path in scenes}
    return {name: path.read_bytes() for name, path in texts.items()} | {f"kerf/{module.name}": stripped(module)}


def make(version, module, out):
    if not module.name.endswith(sysconfig.get_config_var("EXT_SUFFIX")):
        raise Refusal(f"{module}: not of this Python, {sys.executable}; take the one that CMake found")
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    short = "cp" + python.replace(".", "")
    system = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    info = {"METADATA": METADATA.format(version=version, python=python, page=page).encode(),
            "LICENSE": (ROOT / "LICENSE").read_bytes(), "copyright": (ROOT / "cmake/copyright").read_bytes()}
    return write(out, "kerf", version, f"{short}-{short}-{system}", files_of(module), (), info)


if __name__ == "__main__":
    try:
        print(make(sys.argv[1], *(pathlib.Path(path).resolve() for path in sys.argv[2:4])))
    except (Refusal, OSError, subprocess.CalledProcessError) as error:
        print(f"wheel: {error}", file=sys.stderr)
        sys.exit(2)
