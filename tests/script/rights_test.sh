#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# rights_test.sh ROOT: ./kerf in a built clone that another user owns, with a TMPDIR that is not there and under a limit of memory. What
# needs no rights runs, the rest is one line with the way out. The programs are a small project.
set -euo pipefail
root=$1
lab=$(readlink -f "$(mktemp -d)")
trap 'chmod -R u+w "$lab" && rm -rf "$lab"' EXIT
unset KERF_BIN KERF_DATA CCACHE_DIR
failures=0
expect() {
  if ! "${@:2}"; then
    failures=$((failures + 1))
    echo "rights: failed: $1 (${*:2})"
    sed 's/^/  | /' "$lab/said"
  fi
}
# Root without its power over files: what a user has no rights to, it has none to either.
user=()
if ((EUID == 0)); then user=(setpriv '--bounding-set=-dac_override,-dac_read_search' --inh-caps=-all); fi

clone=$lab/clone
mkdir -p "$clone/.ci"
cp -r "$root"/{kerf,cli,demo,scenes,CMakePresets.json} "$clone"
cp "$root"/.ci/{doctor.sh,tests.sh,later-tests.sh,tiers.txt} "$clone/.ci"
printf '#!/bin/sh\n' >"$clone/.ci/packages.sh"
chmod +x "$clone/.ci/packages.sh"
cat >"$clone/CMakeLists.txt" <<'PROJECT'
cmake_minimum_required(VERSION 3.25)
project(kerf VERSION 0.1.0 LANGUAGES CXX)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
file(GLOB sources CONFIGURE_DEPENDS *.cpp)  # so that ninja looks for new files first, as it does for kerf
foreach(name controller emulator visualizer recorder record volume)
  add_executable(kerf-${name} ${sources})
  list(APPEND programs kerf-${name})
endforeach()
add_custom_target(products DEPENDS ${programs})
add_executable(test_all ${sources})
PROJECT
# Asked for more than two words it falls, as a library without memory lets it.
cat >"$clone/main.cpp" <<'MAIN'
#include <csignal>
#include <cstdio>
int main(int count, char**) {
  if (count > 3) return std::raise(SIGSEGV);
  std::puts("runs");
}
MAIN
expect 'the clone builds' "$clone/kerf" setup >"$lab/said" 2>&1
expect 'its programs' test -x "$clone/build/release/bin/kerf-volume"
expect 'and no test' test ! -e "$clone/build/release/bin/test_all"
# gives CODE COMMAND...: and what it says lies in $lab/said.
gives() {
  local code=0
  "${user[@]}" "${@:2}" >"$lab/said" 2>&1 || code=$?
  [[ $code == "$1" ]]
}
# shellcheck disable=SC2053  # a pattern
one_line() { [[ $(<"$lab/said") == $1 ]]; }
copy="copy of your own: cp -r $clone kerf"
whose="belongs to $(stat -c %U "$clone"), and $(id -un) may not write there"

chmod -R a-w "$clone"
before=$(find "$clone" -printf '%p %s %T@\n' | sort | cksum)
expect 'the version' gives 0 "$clone/kerf" --version
expect 'is told' one_line 'kerf 0.1.0'
expect 'the help of a demo' gives 0 "$clone/kerf" demo --help
expect 'a program that is built' gives 0 "$clone/kerf" volume info x
expect 'runs' one_line runs
for command in test package docs; do
  expect "$command" gives 2 "$clone/kerf" $command
  expect 'has a line' one_line "kerf: $command: $clone/build: $whose; make a $copy"
done
expect 'a page' gives 2 "$clone/kerf" page --out "$lab/page"
expect 'has a line' one_line "kerf: page: $clone/build: $whose; make a $copy"
expect 'and makes no folder' test ! -e "$lab/page"
expect 'nothing was written' test "$before" == "$(find "$clone" -printf '%p %s %T@\n' | sort | cksum)"
chmod u+w "$clone/main.cpp"
echo '// newer' >>"$clone/main.cpp"
expect 'a program whose sources are newer' gives 2 "$clone/kerf" volume info x
expect 'has a line' one_line "kerf: $clone/build/release: $whose; it has to be built; make a $copy"
cp -r "$clone" "$lab/own"
chmod -R u+w "$lab/own"
expect 'a copy of it' gives 0 "$lab/own/kerf" volume info x
expect 'builds and runs' grep -qx runs "$lab/said"

cd "$lab"
expect 'all of it' gives 0 "$lab/own/kerf" setup
expect 'a demo whose program falls under a limit of memory' gives 1 bash -c "ulimit -v 900000; exec '$lab/own/kerf' demo --headless --seconds 1"
expect 'says which limit' one_line 'kerf: demo: *: ended at a memory limit of 878 MiB (by signal 11); raise it: ulimit -v'
expect 'without a limit' gives 1 "$lab/own/kerf" demo --headless --seconds 1
expect 'it has only fallen' one_line 'kerf: demo: *: ended by signal 11'
expect 'a demo without a place for its files' gives 2 env TMPDIR=/proc/nowhere "$lab/own/kerf" demo --headless --seconds 1
expect 'says how to name one' one_line 'kerf: demo: /proc/nowhere: cannot be written; *'
expect 'a program needs none' gives 0 env TMPDIR=/proc/nowhere "$lab/own/kerf" volume info x
expect 'nor does help' gives 0 env TMPDIR=/proc/nowhere "$lab/own/kerf" help demo

((failures == 0)) || exit 1
echo 'rights: fine'
