#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every source file: clang-format 14 has nothing to change, the licence comes first, a header guards
# itself.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

mapfile -t sources < <(find include shared controller record replay arm hil standin lab face python visualizer bridge web tests examples -name '*.[ch]pp' | sort)
status=0
# Many files to a call: it takes longer to start than to read one. Each line that would change is named.
# Another version forms otherwise. Debian 13 has none of them; what is changed there is formed on Debian 12.
formatter=clang-format-14
if ! command -v "$formatter" >/dev/null && ! .ci/packages.sh --missing check | grep -qx "$formatter"; then
  echo "check-format: this release has no $formatter: the form was not checked" >&2
  formatter=true
fi
if ! found=$(printf '%s\0' "${sources[@]}" |
  xargs -0 -P "$(nproc)" -n 48 "$formatter" --dry-run -Werror 2>&1); then
  lines='^([^ :]+):[0-9]+:[0-9]+: error: .*'
  if ! grep -E "$lines" <<<"$found" | sed -E "s/$lines/\1: not formatted; run clang-format-14 -i \1/" | sort -u; then
    echo "$found"
  fi
  status=1
fi
for file in "${sources[@]}"; do
  read -r first <"$file" || true
  if [[ $first != '// SPDX-License-Identifier: Apache-2.0' ]]; then
    echo "$file:1: no SPDX line; begin with // SPDX-License-Identifier: Apache-2.0"
    status=1
  fi
  if [[ $file == *.hpp ]] && ! grep -q '^#pragma once$' "$file"; then
    echo "$file: no #pragma once; put it below the SPDX line"
    status=1
  fi
done
exit "$status"
