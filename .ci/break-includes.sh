#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Can .ci/check-includes.sh fail? In a copy of the tree, one line or file at a time that breaks a
# rule; each must be refused with its reason, and the copy itself be fine. Some seconds.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
check=$PWD/.ci/check-includes.sh
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT
cp -r shared controller record hil lab visualizer bridge tests "$lab"
cd "$lab"
failures=0

# refused FILE LINE REASON: FILE, new or not, with LINE below its own.
refused() {
  local file=$1 line=$2 reason=$3 said
  mkdir -p "$(dirname "$file")"
  if [[ -e $file ]]; then cp "$file" .kept; fi
  echo "$line" >>"$file"
  if said=$("$check" "$lab" 2>/dev/null) || ! grep -qF -- "$reason" <<<"$said"; then
    echo "break-includes: not refused: $file: $line" >&2
    failures=$((failures + 1))
  fi
  if [[ -e .kept ]]; then mv .kept "$file"; else rm "$file"; fi
  find . -type d -empty -delete
}

"$check" "$lab"
kernel=controller/kernel/x.hpp
above='includes from a floor above'
refused $kernel '#include "controller/plan/compile.hpp"' "$above"
refused $kernel '#include <controller/plan/compile.hpp>' "$above"
refused $kernel '  #  include  "controller/plan/compile.hpp"' "$above"
refused $kernel $'#\tinclude\t<controller/plan/compile.hpp>' "$above"
refused $kernel '#include <../plan/compile.hpp>' 'includes from no room'
refused $kernel '#include "controller/kernel/../plan/compile.hpp"' 'includes from no room'
refused $kernel '#include "definitions.hpp"' definitions.hpp
refused $kernel '# include <vector>' '<vector>'
refused hil/device/x.cpp '#include <record/recorder.hpp>' 'the programs meet only in shared'
refused record/x.cpp '#include "tests/scene/support.hpp"' 'includes from no room'

refused controller/newroom/a.cpp 'int a;' 'controller/newroom/   <- no room of that name'
refused newprog/a.cpp '#include "controller/plan/compile.hpp"' 'newprog/   <- no room of that name'
refused shared/wire/a.h '#include "controller/plan/compile.hpp"' 'C++ ends in .cpp or .hpp'
mv record .record # a row of the list that nothing stands for
mkdir record
refused shared/wire/a.hpp '' 'record/   <- a room without C++'
rm -rf record
mv .record record

mkdir docs # as full as a folder may be, and one more
touch docs/{1..40}.md
"$check" "$lab"
refused docs/41.md '' 'docs/   <- 41 files, of 40 at most'
rm -r docs

refused shared/segment/x.cpp '#include <png.h>' '<png.h>'
refused controller/servo/x.cpp '#include <zlib.h>' '<zlib.h>'
refused controller/servo/x.cpp '#include <unistd.h>' '<unistd.h>'
refused controller/servo/x.cpp '#include "shared/segment/writer.hpp"' 'shared/segment/writer.hpp'
refused shared/numeric/x.hpp '#include <immintrin.h>' '<immintrin.h>'
refused shared/text/text.hpp '#include <toml++/toml.h>' '<toml++/toml.h>'
refused shared/text/other.cpp '#include <nlohmann/json.hpp>' '<nlohmann/json.hpp>'
refused tests/shell/x.cpp '#include <nlohmann/json.hpp>' '<nlohmann/json.hpp>'
refused shared/text/json.cpp '#include <CLI/CLI.hpp>' '<CLI/CLI.hpp>'
refused hil/program/x.cpp '#  include <toml++/toml.h>' '<toml++/toml.h>'

refused controller/device/x.cpp '#include <libusb-1.0/libusb.h>' '<libusb'
refused record/x.cpp '#include <linux/firewire-cdev.h>' '<linux/firewire'
refused lab/rig/x.cpp '#include <epoxy/gl.h>' '<epoxy'
refused controller/volume/file/x.cpp '#include <itkImage.h>' '<itkImage.h>'
refused controller/servo/x.cpp 'auto t = std::chrono::system_clock::now();' system_clock
((failures == 0)) && echo 'break-includes: every break is refused'
