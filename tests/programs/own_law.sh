#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# own_law.sh BUILD: installs a build into a new prefix and follows docs/own-law.md to the letter, as a new user
# would, in an empty folder. The page's blocks that name a file are that file, and equal examples/own-law.
set -euo pipefail
root=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
mkdir "$home/law"
cd "$home/law"

awk '
  /^```[a-z]+ [A-Za-z_.]+$/ { file = $2; next }
  /^```sh$/ { file = "../steps.sh"; next }
  /^```/ { file = ""; next }
  file != "" { print >file }
' "$root/docs/own-law.md"
diff -r . "$root/examples/own-law" || {
  echo "own_law: docs/own-law.md and examples/own-law differ (above); make them the same" >&2
  exit 1
}
lines=$(cat ./* | wc -l)
((lines <= 100)) || { echo "own_law: the example has $lines lines; 100 are promised" >&2; exit 1; }

cmake --install "$1" --prefix "$home/kerf" >"$home/install.log"
HOME=$home CMAKE_BUILD_PARALLEL_LEVEL=2 bash -euo pipefail "$home/steps.sh"
