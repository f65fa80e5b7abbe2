#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# clang-tidy over every library and program; by .ci/all and by hand, since it takes ten minutes of two cores.
#     .ci/check-tidy.sh [FILE-REGEX]      e.g. .ci/check-tidy.sh controller/kernel
# The files of a library are joined as in the build from cold: the headers that they share are read once (a tenth of the time).
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
.ci/packages.sh build check lint
clang=$(cmake/clang-version.sh)
cmake -B build/tidy -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="clang++-$clang" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON \
  -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON --log-level=NOTICE
# What the compiler reads of each: a source of the tree, or one of the build that joins such. Generated sources are made first.
mapfile -t files < <(python3 - "$PWD" "${1:-.}" <<'PYTHON'
import json, pathlib, re, subprocess, sys
root, wanted = pathlib.Path(sys.argv[1]), re.compile(sys.argv[2])
build = root / "build/tidy"
for file in sorted({pathlib.Path(entry["file"]) for entry in json.loads((build / "compile_commands.json").read_text())}):
    joined = [pathlib.Path(one) for one in re.findall(r'^#include "(.*)"$', file.read_text(), re.M)] if "Unity" in file.parts else [file]
    made = [one for one in joined if build in one.parents]
    if joined == made or joined[0].relative_to(root).parts[0] in ("tests", "examples"):
        continue
    if any(wanted.search(str(one.relative_to(root))) for one in joined):
        for one in made:
            subprocess.run(["ninja", "-C", build, one.relative_to(build)], check=True, stdout=sys.stderr)
        print(file)
PYTHON
)
((${#files[@]} > 0)) || { echo "tidy: no source has a name that matches '$1'" >&2; exit 2; }
# A joined source includes others by its nature.
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" "clang-tidy-$clang" --quiet -p build/tidy --checks=-bugprone-suspicious-include \
    --extra-arg=-Wno-unused-command-line-argument
