#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# load_test.sh MODULE ROOT: load_test.js, or 77 if there is no module or no Node to run it.
set -euo pipefail
for there in "$1" "$(command -v node)"; do
  if [[ ! -e $there ]]; then
    echo "skipped: ${there:-node}: is not there; ninja -C build/web kerf-web-load makes the module"
    exit 77
  fi
done
exec node --experimental-default-type=module "$(dirname "$0")/load_test.js" "$@"
