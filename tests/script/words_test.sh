#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# words_test.sh ROOT: what is typed behind ./kerf in a clone that has built nothing, on a machine without python3. A wrong word is
# one line and exit code 2, help and version are printed, and nothing is installed, configured, built or written for it.
set -euo pipefail
root=$1
lab=$(mktemp -d)
trap 'chmod -R u+w "$lab" && rm -rf "$lab"' EXIT
unset KERF_BIN KERF_DATA
clone=$lab/clone
mkdir -p "$clone/.ci" "$lab/tools"
cp -r "$root"/{kerf,cli,scenes,demo,standin,CMakeLists.txt,CMakePresets.json} "$clone"
cp "$root"/.ci/{tests.sh,later-tests.sh,tiers.txt} "$clone/.ci"
sed -i 's|/usr/bin/python3|/nowhere/python3|g' "$clone/kerf"
# shellcheck disable=SC2016  # for the inner shells
for tool in apt-get sudo cmake ninja ctest cpack mkdocs g++ dpkg-query; do printf '#!/bin/sh\necho "%s $*" >>%s/calls\nexit 1\n' $tool "$lab" >"$lab/tools/$tool"; done
# shellcheck disable=SC2016
for script in packages.sh doctor.sh ablate.py; do printf '#!/bin/sh\necho "%s $*" >>%s/calls\nif [ "$1" = --missing ]; then echo python3; else exit 2; fi\n' $script "$lab" >"$clone/.ci/$script"; done
chmod +x "$lab"/tools/* "$clone"/.ci/*
export PATH=$lab/tools:$PATH

checks=0 failures=0
expect() {
  checks=$((checks + 1))
  if ! "${@:2}"; then
    failures=$((failures + 1))
    echo "words: failed: $1 (${*:2})"
    sed 's/^/  | /' "$lab/said"
  fi
}
# gives CODE WORD...: ./kerf WORD... ends with it, its output is in $lab/said, and it has called and written nothing.
gives() {
  local code=0
  rm -f "$lab/calls"
  "$clone/kerf" "${@:2}" >"$lab/said" 2>"$lab/errors" || code=$?
  cat "$lab/errors" >>"$lab/said"
  [[ $code == "$1" && ! -e $lab/calls && ! -e $clone/build ]] || { cat "$lab/calls" 2>/dev/null && return 1; }
}
one_line() { [[ $(<"$lab/said") == "$1" ]]; }
begins() { [[ $(<"$lab/said") == "$1"* ]]; }
lines_at_most() { (($(wc -l <"$lab/said") <= $1)); }
# refused WORDS ANSWER: WORDS are split at blanks.
refused() {
  # shellcheck disable=SC2086
  expect "$1" gives 2 $1
  expect "the answer to $1" one_line "kerf: $2"
}

expect 'without a word' gives 0
expect 'there is the first screen' begins 'kerf: haptic milling of a tooth'
expect 'of 20 lines' lines_at_most 20
cp "$lab/said" "$lab/first"
for words in --help -h help 'help --help' 'help help'; do
  # shellcheck disable=SC2086
  expect "$words" gives 0 $words
  expect 'is the same' cmp -s "$lab/said" "$lab/first"
done
expect 'it says how Tab works' grep -qF 'source <(./kerf completion)' "$lab/first"
expect 'the version' gives 0 --version
version="kerf $(sed -n 's/^project(kerf VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")"
expect 'is that of the sources' one_line "$version"
expect 'that of a program' gives 0 volume --version
expect 'is the same' one_line "$version"

# Each command and program has its own help, by both ways, and no other.
for command in $(sed -nE 's|^  \./kerf ([a-z-]+) .*|\1|p' "$lab/first") $(sed -n 's/.*any program: //p' "$lab/first") 'lab zwidth' 'studies ranges' 'volume info' 'bench kernels' 'bench bridge'; do
  # shellcheck disable=SC2086
  expect "help $command" gives 0 help $command
  cp "$lab/said" "$lab/page"
  # shellcheck disable=SC2086
  expect "$command --help" gives 0 $command --help
  expect 'is the same' cmp -s "$lab/said" "$lab/page"
  expect 'and is some' test -s "$lab/page"
done
expect 'the help of a program' gives 0 volume --help
expect 'is its own' cmp -s "$lab/said" <(sed -n '/^## kerf-volume$/,/^## /p' "$root/cli/help/kerf-volume.txt" | sed '/^## /d')
expect 'help behind other options' gives 0 demo --seconds 1 --help
expect 'is of the command' begins './kerf demo: '
expect 'the help of a demo' test "$(grep -c 'stand-in: \|--junit' "$lab/said")" == 0

refused dmeo 'dmeo: unknown; did you mean demo? see ./kerf --help'
refused contoller 'contoller: unknown; did you mean controller? see ./kerf --help'
refused setpu 'setpu: unknown; did you mean setup? see ./kerf --help'
refused 'help dmeo' 'dmeo: unknown; did you mean demo? see ./kerf --help'
refused --versoin '--versoin: unknown option; did you mean --version? see ./kerf --help'
refused --fast '--fast: unknown option; see ./kerf --help'
refused '--version now' '--version: now: unknown; leave it out'
refused polish "polish: unknown; known are $(sed -nE '/kerf lab /d; s|^  \./kerf ([a-z-]+) .*|\1|p' "$lab/first" | paste -sd ' ') \
arm bridge controller emulator lab record recorder replay studies visualizer-monkey visualizer volume"
refused kerf "kerf: unknown; known are $(sed 's/.*known are //' "$lab/said")"
refused ../kerf "../kerf: unknown; known are $(sed 's/.*known are //' "$lab/said")"
refused 'setup foo' 'setup: foo: unknown; see ./kerf setup --help'
refused 'docs foo' 'docs: foo: unknown; see ./kerf docs --help'
refused 'package foo' 'package: foo: unknown; see ./kerf package --help'
refused 'doctor --dmeo' 'doctor: --dmeo: unknown; did you mean --demo? see ./kerf doctor --help'
refused 'demo --scen' 'demo: --scen: unknown; did you mean --scene? see ./kerf demo --help'
refused 'demo --fast' 'demo: --fast: unknown; see ./kerf demo --help'
refused 'demo fast' 'demo: fast: unknown; see ./kerf demo --help'
refused 'demo --rate --out x' 'demo: --rate: no value; see ./kerf demo --help'
refused 'demo --seconds=3' 'demo: --seconds=3: unknown; did you mean --seconds? see ./kerf demo --help'
refused 'demo --virtual --scene toch' 'demo: --scene toch: no such scene file; did you mean touch?'
refused 'demo --scene scenes/two_teth.toml' 'demo: --scene scenes/two_teth.toml: no such scene file; did you mean two_teeth?'
refused 'controller --scene toch' 'controller: --scene toch: no such scene file; did you mean touch?'
refused 'sweep toch --set a=1:2:3 --out x' 'sweep: toch: no such scene file; did you mean touch?'
refused 'sweep touch --sett a=1:2:3' 'sweep: --sett: unknown; did you mean --set? see ./kerf sweep --help'
refused 'test shell' 'test: shell: unknown; see ./kerf test --help'
refused 'test -R' 'test: -R: no value; see ./kerf test --help'
refused 'test -R [' 'test: -R [: is no regular expression; write \ before a sign that stands for itself'
refused 'test --hlep' 'test: --hlep: unknown; did you mean --help? see ./kerf test --help'
refused 'test --preset foo' 'test: --preset foo: unknown; take dev, release, asan or tsan'
refused 'test --prest dev' 'test: --prest: unknown; did you mean --preset? see ./kerf test --help'
refused 'bench' 'bench: no command; take kernels pictures safety bridge ranges'
refused 'bench kernls' 'bench: kernls: unknown; did you mean kernels? see ./kerf bench --help'
refused 'bench kernels --pagee x' 'bench kernels: --pagee: unknown; did you mean --page? see ./kerf bench kernels --help'
refused 'stand-in --lokstep -- true' 'stand-in: --lokstep: unknown; did you mean --lockstep? see ./kerf stand-in --help'
refused 'stand-in true' 'stand-in: true: unknown; see ./kerf stand-in --help'
refused 'page' 'page: no --out; name a new or empty folder: --out DIR'
refused 'page --out' 'page: --out: no value; see ./kerf page --help'
refused 'completion zsh' 'completion: zsh: unknown; see ./kerf completion --help'
refused 'volume inof' 'volume: inof: unknown; did you mean info? see ./kerf volume --help'
refused 'volume' 'volume: no command; take import info crop resample phantom'
refused 'volume info --windw 1,2' 'volume info: --windw: unknown; did you mean --window? see ./kerf volume info --help'
refused 'volume import a --out' 'volume import: --out: no value; see ./kerf volume import --help'
refused 'lab zwidht' 'lab: zwidht: unknown; did you mean zwidth? see ./kerf lab --help'
refused 'lab extremes' 'lab: extremes: unknown; see ./kerf lab --help'
refused 'studies extrems' 'studies: extrems: unknown; did you mean extremes? see ./kerf studies --help'
refused 'visualizer --renderr iso' 'visualizer: --renderr: unknown; did you mean --renderer? see ./kerf visualizer --help'

# What is right goes on.
goes_on() { ! gives 2 "$@" >/dev/null && grep -q "^packages.sh build" "$lab/calls"; }
for words in demo 'demo --scene touch --hand mouse --spacing 1,2,3' 'demo --scene scenes/touch.toml' 'controller --scene wall --wait=3 --window -1000 3000' \
  'volume info a.nrrd --window -1,2' 'stand-in --lockstep -- true --any' 'test -R shell --preset dev' setup 'sweep touch --set a=1:2:3 --out x' \
  'bench kernels --page x' 'lab zwidth --quick' 'replay log --set a.b=1'; do
  # shellcheck disable=SC2086
  expect "$words" goes_on $words
  rm -rf "$clone/build"
done

# Wherever the standard output is closed.
for words in '' --help --version 'help demo' 'demo --help' demo 'volume --help' 'volume info x' test setup doctor bench completion dmeo; do
  code=0
  rm -f "$lab/calls"
  # shellcheck disable=SC2086
  "$clone/kerf" $words >&- 2>"$lab/said" || code=$?
  expect "$words with a closed output" test "$code" == 2 -a ! -e "$lab/calls"
  expect 'is one line' one_line 'kerf: standard output: is closed; send it to a file, a pipe or /dev/null'
done
code=0
"$clone/kerf" dmeo 2>&- || code=$?
expect 'a closed error output changes no exit code' test "$code" == 2

# offers ANSWER WORD...: what Tab offers for the last of these words behind ./kerf, each once.
offers() {
  local wanted=$1
  shift
  offered=$(bash -c '. <("$1" completion); COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)); _kerf "$1" "${!#}" "${*: -2:1}"; echo "${COMPREPLY[*]}"' \
    tab "$clone/kerf" "$@")
  echo "$offered" >"$lab/said"
  [[ $(tr ' ' '\n' <<<"$offered" | LC_ALL=C sort | paste -sd ' ') == "$wanted" ]]
}
rm -f "$lab/calls"
all='arm bench bridge completion controller demo docs doctor emulator identify lab package page record recorder replay setup stand-in sweep test visualizer volume'
expect 'Tab offers commands and programs' offers "$all" ''
expect 'and behind help' offers "$all" help ''
expect 'or those that begin so' offers 'docs doctor' 'do'
expect 'what a bench can measure' offers 'bridge kernels pictures ranges safety' bench ''
expect 'or what begins so' offers 'kernels' bench k
expect 'the option of the doctor' offers '--demo' doctor ''
expect 'each option once' offers '--device --help --jobs --out --seconds --set' sweep --
expect 'those of a test' offers '--junit --preset -R' test -
expect 'those of a demo' offers '--scene --seconds --serve --set --sheet --size --spacing --stereo' demo --s
expect 'what the bridge can do' offers '--help --version -h join serve' bridge ''
expect 'and the lab' offers 'laws' lab la
expect 'the options of what it can do' offers '--quantum --quick' lab zwidth --qu
expect 'the words of a program' offers 'omega omni' controller --device om
expect 'nothing of what has no options' offers '' docs ''
expect 'and it builds nothing for that' test ! -e "$lab/calls" -a ! -e "$clone/build"

echo "words: $checks checks, $failures failed"
((failures == 0))
