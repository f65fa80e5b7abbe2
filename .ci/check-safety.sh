#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-safety.sh [PATTERN]: is every rule of docs/safety.md watched? Breaks one rule at a time, as
# .ci/safety-mutations.txt says, and demands that the fault script or the test named there notices.
# Prints a table of change and what caught it. PATTERN picks the changes whose line matches. A change
# whose text its file no longer has ends it with exit code 2, whatever PATTERN says.
#
# Uses the release build. Of each change one object is compiled, without optimisation, and linked
# before the libraries that hold the right one: nothing in the tree or its build is touched. Some
# minutes.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
root=$PWD build=$PWD/build/release list=.ci/safety-mutations.txt page=docs/safety.md
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT

die() {
  echo "check-safety: $*" >&2
  exit 2
}

# Page and list name the same changes: a rule without one is not on the page.
mapfile -t lines < <(grep -vE '^(#|$)' "$list")
for line in "${lines[@]}"; do
  grep -qF "\`${line%% | *}\`" "$page" || die "$list: ${line%% | *} stands nowhere in $page; name its rule there"
done
twice=$(printf '%s\n' "${lines[@]%% | *}" | sort | uniq -d | awk 'NR == 1')
[[ -z $twice ]] || die "$list: $twice stands there twice"
stale=$(for line in "${lines[@]}"; do
  IFS=$'\t' read -r name file object edit catcher <<<"${line// | /$'\t'}"
  if [[ ! -e $file ]] || sed -E "$edit" "$file" | cmp -s - "$file"; then echo "$name: $file has no place for it"; fi
done)
[[ -z $stale ]] || die "$stale; mend $list"
mapfile -t lines < <(printf '%s\n' "${lines[@]}" | grep -E -- "${1:-.}")
((${#lines[@]})) || die "${1:-}: no line of $list matches"

target_of() { if [[ $1 == test_* ]]; then echo "$1"; else echo kerf-lab; fi; }

# noticed_by PROGRAM CATCHER...: runs it; says what it found, nothing where it found nothing. 2: it
# cannot run.
noticed_by() {
  local program=$1 status=0 log=$1.log
  shift
  if [[ $1 == .ci/* ]]; then
    "$program" >"$log" 2>&1 || status=$?
  elif [[ $1 == test_* ]]; then
    timeout 200 "$program" -tc="${*:2}" -aa=1 >"$log" 2>&1 || status=$?
    if grep -q 'test cases: *0 ' "$log"; then return 2; fi
  else
    timeout 300 "$program" faults --device "$1" --scripts "hil/faults/$2.toml" --random 0 --seeds 4 \
      "${@:3}" >"$log" 2>&1 || status=$?
    if ((status == 2)); then return 2; fi
  fi
  ((status)) || return 0
  {
    sed -nE 's/^  (broken: seed [0-9]+: |(shows nothing): seed [0-9]+: )/\2 /p' "$log"
    awk '/^TEST CASE:/ { sub("TEST CASE: *", ""); name = $0 } /ERROR/ { print name; exit }' "$log"
    echo "exit code $status"
  } | awk 'NR == 1'
}

# compile FILE OBJECT OUT: OBJECT's own command with the changed FILE in $OUT's folder before the tree's.
compile() {
  local file=$1 object=$2 out=$3 over=${3%/*}/over command source
  command=$(ninja -C "$build" -t commands "$object" | tail -1)
  source=${command##* -c }
  if [[ $source == *unity* ]]; then  # files joined into one: the changed one in its place
    sed "s|$root/$file|$over/$file|" "$source" >"$over/joined.cpp"
    source=$over/joined.cpp
  elif [[ $source == "$root/$file" ]]; then
    source=$over/$file
  fi
  command=$(sed -E "s| -I$root| -I$over&|; s/ -O[0-3]/ -O0/g; s/ -(Werror|Winvalid-pch|fpch-preprocess)//g
    s/ -include [^ ]*pch[^ ]*//; s/ -MD .*//" <<<"$command")
  (cd "$build" && eval "$command -o $out -c $source") >"$out.log" 2>&1
}

# link TARGET OBJECT CHANGED OUT: TARGET's own command with CHANGED for OBJECT, or before all others: of what
# a header defines in several objects, tests among them, the first one counts.
link() {
  local command
  command=$(ninja -C "$build" -t commands "bin/$1" | grep -E -- " -o bin/$1( |\$)" | tail -1)
  if [[ $command == *" $2 "* ]]; then
    command=${command/" $2 "/" $3 "}
  else
    command=$(sed -E "s|( [^ ]+\.o)( )| $3\1\2|" <<<"$command")
  fi
  (cd "$build" && eval "${command/" -o bin/$1 "/" -o $4 "}") >"$4.link" 2>&1
}

# judge NUMBER LINE: one change; its row into $lab/NUMBER/row, or why there is none into $lab/NUMBER/bad.
judge() {
  local here=$lab/$1 name file object edit catcher words caught program
  IFS=$'\t' read -r name file object edit catcher <<<"${2// | /$'\t'}"
  read -ra words <<<"$catcher"
  mkdir -p "$here/over/${file%/*}"
  sed -E "$edit" "$file" >"$here/over/$file"
  program=$here/program
  if [[ ${words[0]} == .ci/* ]]; then
    # A check of the tree's text: on a copy.
    git ls-files -z --cached --others --exclude-standard | xargs -0 cp -p --parents -t "$here"
    cp "$here/over/$file" "$here/$file"
    rm -r "$here/over"
    program=$here/${words[0]}
  else
    object=$(ninja -C "$build" -t deps 2>/dev/null | awk -v file="$file" '/^[^ ].*:/ { at = $1; sub(":$", "", at) }
      substr($1, length($1) - length(file) + 1) == file { print at }' | grep -E -- "$object" | awk 'NR == 1') || true
    if [[ -z $object ]]; then
      echo "$name: no object of the build reads $file; mend $list" >"$here/bad"
      return
    fi
    if ! compile "$file" "$object" "$here/changed.o" ||
      ! link "$(target_of "${words[0]}")" "$object" "$here/changed.o" "$program"; then
      echo "$name: does not build: $(cat "$here"/*.log "$here"/*.link 2>/dev/null | grep -E 'error|undefined' | awk 'NR == 1')" >"$here/bad"
      return
    fi
  fi
  if ! caught=$(noticed_by "$program" "${words[@]}"); then
    echo "$name: '$catcher' cannot run: $(tail -1 "$program.log")" >"$here/bad"
    return
  fi
  printf '%-26s %-36s %s\n' "$name" "$catcher" "${caught:-NOTHING}" >"$here/row"
  rm -rf "$here/over" "$program" "$here/changed.o"
}

echo 'check-safety: building what notices, as it is' >&2
mapfile -t catchers < <(printf '%s\n' "${lines[@]##* | }" | sort -u)
mapfile -t targets < <(for catcher in "${catchers[@]}"; do target_of "${catcher%% *}"; done | sort -u)
if [[ ! -e $build/build.ninja ]]; then cmake --preset release --log-level=ERROR >/dev/null; fi
ninja -C "$build" "${targets[@]}" >"$lab/build.log" 2>&1 || die "$(tail -1 "$lab/build.log")"

jobs=$(nproc)
# each FUNCTION ITEM...: FUNCTION NUMBER ITEM for all, as many at once as there are cores.
each() {
  local work=$1 number=0 item
  shift
  for item in "$@"; do
    while (($(jobs -rp | wc -l) >= jobs)); do wait -n || true; done
    number=$((number + 1))
    "$work" "$number" "$item" &
  done
  wait
}

# as_it_is NUMBER CATCHER: must find nothing.
as_it_is() {
  local words found
  mkdir "$lab/as-it-is-$1"
  read -ra words <<<"$2"
  local program=$lab/as-it-is-$1/program
  if [[ ${words[0]} == .ci/* ]]; then
    printf '#!/bin/sh\nexec %s\n' "$root/${words[0]}" >"$program"
    chmod +x "$program"
  else
    ln -s "$build/bin/$(target_of "${words[0]}")" "$program"
  fi
  if ! found=$(noticed_by "$program" "${words[@]}") || [[ -n $found ]]; then
    echo "'$2' fails without any change: ${found:-$(tail -1 "$program.log")}" >"$lab/as-it-is-$1/bad"
  fi
}
each as_it_is "${catchers[@]}"
if cat "$lab"/*/bad 2>/dev/null; then die 'mend these first'; fi

printf '%-26s %-36s %s\n' change 'what must notice' 'caught by'
each judge "${lines[@]}"
cat "$lab"/[0-9]*/row 2>/dev/null || true
if cat "$lab"/*/bad 2>/dev/null; then die 'mend these lines'; fi
judged=$(cat "$lab"/[0-9]*/row 2>/dev/null | grep -c . || true)
if ((judged != ${#lines[@]})); then die "only $judged of ${#lines[@]} changes were tried"; fi
missed=$(cat "$lab"/[0-9]*/row | grep -c ' NOTHING$' || true)
echo "check-safety: ${#lines[@]} changes, $missed unseen, $SECONDS s"
if ((missed)); then exit 1; fi
