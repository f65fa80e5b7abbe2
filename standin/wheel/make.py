#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the wheel kerf-standin of a build (docs/stand-ins.md): the stand-ins, their emulator and `./kerf stand-in` itself.

    python3 standin/wheel/make.py VERSION LIBRARIES EMULATOR OUT

Its platform follows from the symbol versions that its files ask of glibc. cmake/wheel_file.py writes it."""
import pathlib
import platform
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cmake"))
from wheel_file import Refusal, stripped, write  # noqa: E402

NAME = "kerf_standin"
# Each system with glibc has these, from that package alone; any other library would be a stranger's to install.
OF_GLIBC = re.compile(r"(libc|libm|libpthread|libdl|librt)\.so\.\d+|ld-linux[-_.a-z0-9]*\.so\.\d+")
EVERYWHERE = (2, 35)  # Ubuntu 22.04 has it, Debian 12 2.36
METADATA = """Metadata-Version: 2.1
Name: kerf-standin
Version: {version}
Summary: An emulated Touch and omega.3 behind libHD, libdhd and libdrd, for tests of haptic programs
License: Apache-2.0
Requires-Python: >=3.10
Classifier: Operating System :: POSIX :: Linux
Classifier: Topic :: Software Development :: Testing
Description-Content-Type: text/markdown

{page}"""


def asked_of_glibc(path):
    """The newest glibc that a program or library needs, as (2, 34)."""
    def printed(*options):
        return subprocess.run(["readelf", *options, path], capture_output=True, text=True, check=True).stdout
    for library in re.findall(r"\(NEEDED\).*\[(.*)\]", printed("-dW")):
        if not OF_GLIBC.fullmatch(library):
            raise Refusal(f"{path}: needs {library}, which no wheel may ask for; link it statically")
    return max((tuple(map(int, version.split("."))) for version in re.findall(r"Name: GLIBC_([0-9.]+)", printed("-VW"))),
               default=(2, 17))[:2]


def files_of(libraries, emulator):
    """{path in the package: bytes}, and the paths that are programs or libraries."""
    binaries = {"bin/kerf-emulator": emulator, **{f"lib/{name}": libraries / name for name in ("libHD.so", "libdrd.so.3")}}
    texts = {path.name: path for path in (ROOT / "standin/wheel").glob("__*.py")}
    texts |= {f"program/{path.name}": path for pattern in ("*.py", "*.toml") for path in (ROOT / "standin").glob(pattern)}
    texts |= {f"faults/{path.name}": path for path in (ROOT / "hil/faults").glob("*.toml")}
    headers = ROOT / "standin/include"
    texts |= {f"include/{path.relative_to(headers)}": path for path in headers.rglob("*.h")}
    texts |= {"help.txt": ROOT / "cli/help/stand-in.txt", "lib/libHDU.a": libraries / "libHDU.a"}
    for path in (*binaries.values(), texts["lib/libHDU.a"]):
        if not path.exists():
            raise Refusal(f"{path}: not built; ninja wheel builds it")
    content = {name: stripped(path) for name, path in binaries.items()}
    return content | {name: path.read_bytes() for name, path in texts.items()}, binaries


def make(version, libraries, emulator, out):
    content, binaries = files_of(libraries, emulator)
    glibc = max(map(asked_of_glibc, binaries.values()))
    tag = f"py3-none-manylinux_{glibc[0]}_{glibc[1]}_{platform.machine()}"
    page = (ROOT / "docs/stand-ins.md").read_text(encoding="utf-8")
    files = {f"{NAME}/{name}": data for name, data in content.items()}
    info = {"METADATA": METADATA.format(version=version, page=page).encode(),
            "entry_points.txt": f"[console_scripts]\nkerf-standin = {NAME}:exit_with_main\n".encode(),
            "LICENSE": (ROOT / "LICENSE").read_bytes()}
    wheel = write(out, NAME, version, tag, files, {f"{NAME}/{name}" for name in binaries}, info)
    if glibc > EVERYWHERE:
        print(f"wheel: {wheel.name}: asks for glibc {glibc[0]}.{glibc[1]}, which Debian 12 and Ubuntu 22.04 do not have; "
              "standin/wheel/Containerfile makes one for them", file=sys.stderr)
    return wheel


if __name__ == "__main__":
    try:
        print(make(sys.argv[1], *(pathlib.Path(path).resolve() for path in sys.argv[2:5])))
    except (Refusal, OSError, subprocess.CalledProcessError) as error:
        print(f"wheel: {error}", file=sys.stderr)
        sys.exit(2)
