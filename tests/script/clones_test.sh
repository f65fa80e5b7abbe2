#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# clones_test.sh ROOT: ./kerf in a clone that was copied, renamed, mounted or linked after its build, and with a build folder
# of another checkout, as a CI restores it. It has to run what its own sources say, and to write nowhere else. The sources are a small
# project. Exit code 77: all else is fine, but nothing can be mounted here.
set -euo pipefail
root=$1
lab=$(mktemp -d)
lab=$(readlink -f "$lab")
trap 'rm -rf "$lab"' EXIT
unset KERF_BIN KERF_DATA CCACHE_DIR
failures=0
expect() {
  if ! "${@:2}"; then
    failures=$((failures + 1))
    echo "clones: failed: $1 (${*:2})"
    sed 's/^/  | /' "$lab/said"
  fi
}

first=$lab/first
mkdir -p "$first/.ci" "$first/cmake"
cp -r "$root/kerf" "$root/cli" "$root/CMakePresets.json" "$first"
cp "$root/.ci/stages.sh" "$first/.ci"
printf '#!/bin/sh\n' >"$first/.ci/packages.sh"
chmod +x "$first/.ci/packages.sh"
touch "$first/cmake/wasm32-wasi.cmake"
# Like kerf: a compiled path, a unit that includes its files by absolute paths, the page of a browser.
cat >"$first/CMakeLists.txt" <<'PROJECT'
cmake_minimum_required(VERSION 3.25)
project(kerf VERSION 0.1.0 LANGUAGES CXX)
option(KERF_WEB "" OFF)
set(KERF_WORD "none" CACHE STRING "")
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_UNITY_BUILD ON)
add_executable(kerf-controller main.cpp word.cpp)
target_compile_definitions(kerf-controller PRIVATE ROOT="${PROJECT_SOURCE_DIR}" WORD="${KERF_WORD}")
add_custom_target(kerf-page COMMAND cmake -E make_directory page
  COMMAND cmake -E copy ${PROJECT_SOURCE_DIR}/word.cpp page/word.txt WORKING_DIRECTORY ${CMAKE_BINARY_DIR})
PROJECT
cat >"$first/main.cpp" <<'MAIN'
#include <cstdio>
const char* word();
int main() { std::printf("%s %s %s\n", word(), WORD, ROOT); }
MAIN
echo 'const char* word() { return "one"; }' >"$first/word.cpp"

# run FOLDER: what ./kerf controller there prints, and $lab/said has on the standard error.
run() { "$1/kerf" controller 2>"$lab/said" || echo "exit code $?"; }
prints() { [[ $(run "$1") == "$2" ]]; }
silent() { [[ ! -s $lab/said ]]; }
# told OF BUILD FOLDER: one line for the build folder that was made for another clone.
told() { [[ $(grep -c 'was made for' "$lab/said") == 1 ]] && grep -qx "kerf: $2 was made for $1; it is configured and built anew for $3" "$lab/said"; }
# files FOLDER: all of it, to the nanosecond.
files() { find "$1" -printf '%p %i %s %T@\n' | LC_ALL=C sort | cksum; }
untouched() { [[ $(files "$1") == "$2" ]]; }
edited() { sed -i "s/one/$2/" "$1/word.cpp"; }

expect 'a clone builds' prints "$first" "one none $first"
expect 'with a setting of its own' cmake -S "$first" -B "$first/build/release" -DKERF_WORD=set -Wno-dev --log-level=ERROR >"$lab/cmake"
expect 'which its programs have' prints "$first" "one set $first"
expect 'once they are built' prints "$first" "one set $first"
expect 'nothing more is said' silent
ln -s first "$lab/link"
expect 'by a link it is the same clone' prints "$lab/link" "one set $first"
expect 'and nothing is built' silent

before=$(files "$first")
copy="$lab/a copy"
cp -a "$first" "$copy"
edited "$copy" two
expect 'a copy builds its own sources, and keeps the setting' prints "$copy" "two set $copy"
expect 'it says so' told "$first" build/release "$copy"
expect 'and leaves the first alone' untouched "$first" "$before"
expect 'it says so once' prints "$copy" "two set $copy"
expect 'and no more' silent

mv "$copy" "$lab/renamed"
expect 'a renamed clone too' prints "$lab/renamed" "two set $lab/renamed"
expect 'it says so' told "$copy" build/release "$lab/renamed"
expect 'and does not make its old folder again' test ! -e "$copy"

# What a build that fails leaves behind is nothing that the next start would run.
cp -a "$first" "$lab/broken"
echo 'no C++' >"$lab/broken/word.cpp"
for _ in 1 2; do
  expect 'a copy that does not build runs nothing' prints "$lab/broken" 'exit code 2'
  expect 'not even for its help' test "$("$lab/broken/kerf" controller --help 2>&1 | grep -c "^one .*$first")" == 0
done

# Another preset, and the page.
expect 'a page' "$first/kerf" page --out "$lab/page" >"$lab/said" 2>&1
cp -a "$first" "$lab/of-web"
edited "$lab/of-web" three
before=$(files "$first")
expect 'of a copy' "$lab/of-web/kerf" page --out "$lab/page-2" >"$lab/said" 2>&1
expect 'is told' told "$first" build/web "$lab/of-web"
expect 'has its own sources' grep -q three "$lab/page-2/word.txt"
expect 'and the first is left alone' untouched "$first" "$before"

# A fresh checkout that a CI gives the build folder of another one, by ./kerf and by the stages of .ci.
mkdir "$lab/ci"
(cd "$first" && find . -mindepth 1 -maxdepth 1 ! -name build -exec cp -r -t "$lab/ci" {} +)
edited "$lab/ci" four
cp -a "$first/build" "$lab/ci"
before=$(files "$first")
cp -a "$lab/ci" "$lab/ci-2"
expect 'an old cache of a CI' prints "$lab/ci" "four set $lab/ci"
expect 'is told' told "$first" build/release "$lab/ci"
# shellcheck disable=SC2016  # for the inner shell
expect 'a stage with an old cache' bash -c 'cd "$1" && . .ci/stages.sh && build_strictly release' stage "$lab/ci-2" >"$lab/said" 2>&1
expect 'is told' told "$first" build/release "$lab/ci-2"
expect 'and builds its own sources' test "$("$lab/ci-2/build/release/bin/kerf-controller")" == "four set $lab/ci-2"
expect 'and both leave the first alone' untouched "$first" "$before"

# A build folder elsewhere: its link is copied, too.
cp -a "$first" "$lab/linked"
mv "$lab/linked/build" "$lab/elsewhere" && ln -s "$lab/elsewhere" "$lab/linked/build"
before=$(files "$lab/elsewhere/release/bin")
expect 'a link to the build folder of another clone' prints "$lab/linked" 'exit code 2'
expect 'is refused in one line' grep -qx "kerf: $lab/linked/build/release: leads to a build folder of $first; remove that link, then start again" "$lab/said"
expect 'and left alone' untouched "$lab/elsewhere/release/bin" "$before"

# Mounted, and the first place has gone from sight.
mkdir "$lab/mounted"
there=()
if unshare -m true 2>/dev/null; then there=(unshare -m); elif unshare -rm true 2>/dev/null; then there=(unshare -rm); fi
mounted() {
  # shellcheck disable=SC2016  # for the inner shell
  "${there[@]}" bash -c 'mount --bind "$1" "$2" && mkdir "$3/empty" && mount --bind "$3/empty" "$1" && "$2/kerf" controller' \
    mount "$first" "$lab/mounted" "$lab" 2>"$lab/said"
}
if ((${#there[@]})) && "${there[@]}" mount --bind "$first" "$lab/mounted" 2>/dev/null; then
  expect 'a mounted clone' test "$(mounted)" == "one set $lab/mounted"
  expect 'says so' told "$first" build/release "$lab/mounted"
  expect 'and writes nothing into its first place' test -z "$(ls -A "$lab/empty")"
  expect 'which has its own build again' prints "$first" "one set $first"
  expect 'and says so' told "$lab/mounted" build/release "$first"
else
  skipped='nothing can be mounted here, so no mounted clone was tried'
fi

((failures == 0)) || exit 1
if [[ -n ${skipped:-} ]]; then
  echo "skipped: $skipped; all else is fine" >&2
  exit 77
fi
echo 'clones: fine'
