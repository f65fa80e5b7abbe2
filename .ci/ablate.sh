#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Which constants and branches of the swept contact does a measured row need? Turns each of
# ablations.txt off in a copy of the tree, runs the rows of kerf-lab extremes and the contact's
# tests, and prints which rows move. Nothing in the tree is touched.
#
# One build holds all ablations: each text is replaced by (ablated(i) ? off : text), and the
# environment says which are off.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

usage() {
  cat <<'HELP'
./kerf lab ablate: which constants and branches of the contact does a row need?

  --only NAME,...  these of .ci/ablations.txt; NAME+NAME: both at once   (all)
  --list           the names
  --count          how many named constants the contact has
  --check          only whether each text still stands once in its file and its substitutes compile
  --full           every case of the rows, not a hundredth of them
  --stages N       no stages beyond: 1 walls, rests, slides, shapes; 2 tests of the contact; 3 traps;
                   4 tests of the servo; 5 cutting, isos, edges   (5)
  --jobs N         so many runs at once   (1)
  --again          forget what was measured before
  --page FILE      write what is measured as a page

Rows move by more than 1 % of their limit (of their value where they have none), or get lost. Runs go
from cheap to dear and end after the stage in which a row is lost, or worse by 5 % of its limit. Exit
codes: 0 fine, 2 bad input.
HELP
}

die() {
  echo "ablate: $*" >&2
  exit 2
}

list=.ci/ablations.txt
work=build/ablate
tree=$work/tree

declare -a names=() files=() texts=() offs=() meanings=() reasons=()
declare -A number=()
read_list() {
  local name file text off meaning why
  while IFS= read -r line; do
    [[ -n $line && $line != '#'* ]] || continue
    [[ $line == *' @ '*' @ '*' @ '*' @ '*' @'* ]] || die "$list: $line: not six parts; mend it"
    name=${line%% @ *} line=${line#* @ }
    file=${line%% @ *} line=${line#* @ }
    text=${line%% @ *} line=${line#* @ }
    off=${line%% @ *} line=${line#* @ }
    meaning=${line%% @*} why=${line#*@}
    [[ -z ${number[$name]:-} ]] || die "$list: $name: twice; rename one"
    number[$name]=${#names[@]}
    names+=("$name") files+=("controller/$file") texts+=("$text") offs+=("$off")
    meanings+=("$meaning") reasons+=("${why# }")
  done <$list
}

# edited I CONTENT: sets `content`, in which ablation I can be turned off. A constant is read when the
# program begins: `ablated` would tell the compiler, who tries to know it, that it is not.
edited() {
  local i=$1 text=${texts[$1]} off=${offs[$1]} rest switched
  switched="(ablated($i) ? $off : ($text))"
  if [[ $text == *constexpr* ]]; then
    switched="${text%% = *} = (kAblated[$i] ? $off : ${text#* = })"
    switched=${switched/static constexpr/static inline const}
    switched=${switched/constexpr/const}
  fi
  rest=${2/"$text"/}
  [[ $rest != "$2" ]] || die "${files[i]}: ${names[i]}: '$text' stands nowhere; mend $list"
  [[ $rest != *"$text"* ]] || die "${files[i]}: ${names[i]}: '$text' stands twice; mend $list"
  content=${2/"$text"/"$switched"}
}

# edit_all FOLDER: turns the files there into ones whose ablations can be turned off; without a folder
# only tries.
edit_all() {
  local i file content
  declare -A contents=()
  for i in "${!names[@]}"; do
    file=${files[i]}
    [[ -f $file ]] || die "$list: ${names[i]}: no file $file; mend the list"
    [[ -n ${contents[$file]:-} ]] || contents[$file]=$(<"$file")
    edited "$i" "${contents[$file]}"
    contents[$file]=$content
  done
  [[ -n ${1:-} ]] || return 0
  for file in "${!contents[@]}"; do
    content=${contents[$file]/'#include'/'#include "ablated.hpp"'$'\n#include'}
    [[ $content == "$(<"$1/$file")" ]] || printf '%s\n' "$content" >"$1/$file"
  done
}

# write_switches FILE: the header that tells what is off.
write_switches() {
  cat >"$1" <<'CPP'
#pragma once
#include <array>
#include <cstddef>
#include <cstdlib>
#include <type_traits>
namespace kerf {
/// By number, from the environment: "3,17".
inline const std::array<bool, 256> kAblated = [] {
  std::array<bool, 256> off{};
  const char* at = std::getenv("KERF_ABLATED");
  while (at != nullptr && *at != 0) {
    char* end = nullptr;
    off.at(static_cast<std::size_t>(std::strtol(at, &end, 10))) = true;
    at = *end == 0 ? end : end + 1;
  }
  return off;
}();
constexpr bool ablated(std::size_t i) noexcept {
  if (std::is_constant_evaluated()) return false;
  return kAblated[i];
}
}  // namespace kerf
CPP
}

# check: compiles the file that holds the whole contact, and what else is no header, with all switches in.
check() {
  local folder errors file
  folder=$(mktemp -d)
  # shellcheck disable=SC2064  # by its name of now
  trap "rm -rf '$folder'" EXIT
  git ls-files -z --cached --others --exclude-standard 'controller/*.[ch]pp' 'shared/*.hpp' |
    xargs -0 cp -p --parents -t "$folder"
  write_switches "$folder/ablated.hpp"
  edit_all "$folder"
  while IFS= read -r file; do
    errors=$("${CXX:-c++}" -std=c++20 -I "$folder" -S -o /dev/null "$folder/$file" 2>&1) ||
      die "$list: $file: does not compile: $(grep -m 1 error <<<"$errors"); mend it"
  done < <(printf '%s\n' controller/servo/contact_force.cpp "${files[@]}" | grep '\.cpp$' | sort -u)
  echo "ablate: ${#names[@]} texts stand once each and compile"
}

build() {
  local file
  mkdir -p "$tree"
  # What the list no longer names is copied anew.
  { grep -rlF '"ablated.hpp"' "$tree/controller" 2>/dev/null || true; } | while IFS= read -r file; do
    [[ " ${files[*]} " == *" ${file#"$tree/"} "* ]] || rm "$file"
  done
  git ls-files -z --cached --others --exclude-standard | xargs -0 cp -p --parents -u -t "$tree"
  write_switches "$tree/ablated.hpp.new"
  if cmp -s "$tree/ablated.hpp.new" "$tree/ablated.hpp"; then
    rm "$tree/ablated.hpp.new"
  else
    mv "$tree/ablated.hpp.new" "$tree/ablated.hpp"
  fi
  edit_all "$tree"
  local targets=(kerf-lab test_proxy test_point_shell)
  if ((stages > 3)); then targets+=(test_servo); fi
  echo "ablate: building $tree" >&2
  (cd "$tree" && cmake --preset release ${CCACHE_BASEDIR:+-DKERF_CCACHE=ON} --log-level=ERROR) >"$work/build.log" 2>&1 &&
    ninja -C "$tree/build/release" "${targets[@]}" >>"$work/build.log" 2>&1 ||
    { grep -m 5 -E 'error|Error' "$work/build.log" >&2; die "$tree: does not build ($work/build.log); mend $list"; }
}

# Rows as lines: group, name, value, limit or -.
rows_of() {
  awk -F'"' '
    $2 == "group" || $2 == "name" { at[$2] = $4 }
    $2 == "value" || $2 == "limit" { v = $3; gsub(/[ :,]/, "", v); at[$2] = v }
    $2 == "pass" && at["value"] != "null" {
      print at["group"] "\t" at["name"] "\t" at["value"] "\t" (at["limit"] == "null" ? "-" : at["limit"])
    }' "$1"
}

# measure OUT NUMBERS STAGE: adds the rows of a stage with these ablations off.
measure() {
  local out=$1 report status=0 quick=(--quick)
  report=$(readlink -f "$work")/$BASHPID
  export KERF_ABLATED=$2
  if [[ -n $full ]]; then quick=(); fi
  lab() {
    local status=0
    (cd "$tree" && timeout 900 build/release/bin/kerf-lab extremes "${quick[@]}" --only "$1" --report "$report.json") \
      >"$report.log" 2>&1 || status=$?
    if ((status > 1)); then
      printf 'runs\t%s end with %s\t1\t0\n' "$1" "$status" >>"$out"
    else
      rows_of "$report.json" >>"$out"
    fi
  }
  tests() {
    local status=0
    (cd "$tree" && timeout 300 "build/release/bin/$1" -tce='*Floating*' "${@:2}") >"$report.log" 2>&1 || status=$?
    ((status)) || return 0
    # A failed case names itself above its first error; a crash may leave none.
    awk -v test="${1#test_}" -v ends="$status" '
      /^TEST CASE:/ { sub("TEST CASE: *", ""); sub("<.*", ""); name = $0 }
      / ERROR: / && !(name in told) { told[name] = 1; print "test " test "\t" name "\t1\t0"; some = 1 }
      END { if (!some) print "test " test "\tends with " ends "\t1\t0" }' "$report.log" >>"$out"
  }
  # Tests that state the rules themselves would only say that they were turned off.
  case $3 in
    1) lab walls,rests,slides,shapes ;;
    2)
      tests test_proxy -sfe='*constraint_set_test*,*curvature_test*,*cap_test*,*jam_test*'
      tests test_point_shell
      ;;
    3) lab traps ;;
    4) tests test_servo ;;
    5)
      lab cutting,isos,edges
      tests test_proxy -sf='*jam_test*'
      ;;
  esac
  rm -f "$report".*
}

# changes BEFORE AFTER: rows that move: state, badness, group, name, before, after, limit; the worst first.
changes() {
  awk -F'\t' '
    NR == FNR { before[$1, $2] = $3; next }
    {
      b = ($1, $2) in before ? before[$1, $2] : 0
      a = $3
      limit = $4 == "-" ? 0 : $4
      scale = limit > 0 ? limit : (b < 0 ? -b : b)
      if (scale == 0) scale = 1
      move = (a - b) / scale
      was = $4 == "-" || b <= limit; is = $4 == "-" || a <= limit
      state = was && !is ? "lost" : !was && is ? "won" : $4 == "-" ? "other" : move > 0 ? "worse" : "better"
      if (was == is && move < 0.01 && move > -0.01) next
      rank = state == "lost" ? 1000 : state == "worse" ? 100 : state == "other" ? 0 : -100
      printf "%s\t%.9g\t%s\t%s\t%.4g\t%.4g\t%s\n", state, rank + (move > 99 ? 99 : move), $1, $2, b, a, $4
    }' "$1" "$2" | sort -t$'\t' -k2,2gr
}

# needs_it FILE: a row is lost, or worse by 5 % of its limit.
needs_it() { awk -F'\t' '$1 == "lost" || $1 == "worse" && $2 >= 100.05 { some = 1 } END { exit !some }' "$1"; }

# run_one LABEL [NAME+NAME...]: measures with these off, unless it is known.
run_one() {
  local part off='' stage result=$results/$1
  [[ ! -e $result.changes ]] || return 0
  for part in ${2//+/ }; do off+=${off:+,}${number[$part]}; done
  : >"$result.rows"
  for ((stage = 1; stage <= stages; ++stage)); do
    measure "$result.rows" "$off" "$stage"
    changes "$results/.none.rows" "$result.rows" >"$result.part"
    if needs_it "$result.part"; then break; fi
  done
  mv "$result.part" "$result.changes"
  tell "$1"
}

tell() {
  awk -F'\t' -v name="$1" '
    { n[$1]++ }
    NR == 1 { worst = $1 ": " $3 ", " $4 ": " $5 " -> " $6 " (limit " $7 ")" }
    END { printf "%-24s %2d lost %2d worse %2d better  %s\n", name, n["lost"], n["worse"], n["better"] + n["won"], worst }' \
    "$results/$1.changes"
}

# constants: how many the contact names.
constants() {
  grep -rhE 'constexpr' controller/kernel/proxy controller/kernel/point_shell controller/kernel/proxy/proxy.hpp |
    grep -oE '\bk[A-Z][A-Za-z]* =' | wc -l
}

declare -a only=()
full='' stages=5 jobs=1 page='' again=''
read_list
((${#names[@]})) || die "$list: names no ablation; mend it"
while (($#)); do
  case $1 in
    -h | --help) usage && exit ;;
    --list) printf '%s\n' "${names[@]}" && exit ;;
    --count) constants && exit ;;
    --check)
      check
      exit
      ;;
    --full) full=1 ;;
    --again) again=1 ;;
    --only | --jobs | --stages | --page)
      (($# > 1)) || die "$1: no value; see --help"
      case $1 in
        --only)
          IFS=, read -ra only <<<"$2"
          ((${#only[@]})) || die "--only: no name; see --list"
          ;;
        --jobs) jobs=$2 ;;
        --stages) stages=$2 ;;
        --page) page=$2 ;;
      esac
      shift
      ;;
    *) die "$1: unknown; see --help" ;;
  esac
  shift
done
[[ $jobs =~ ^[1-9][0-9]?$ ]] || die "--jobs $jobs: not 1 to 99; take 1"
[[ $stages =~ ^[1-5]$ ]] || die "--stages $stages: not 1 to 5; take 5"
if [[ -n $page ]]; then { : >>"$page"; } 2>/dev/null || die "--page $page: cannot be written; name another"; fi
for name in "${only[@]}"; do
  for part in ${name//+/ }; do
    [[ -n ${number[$part]:-} ]] || die "--only $part: unknown; see --list"
  done
done

# run_all NAME...: $jobs at once.
run_all() {
  local name
  for name in "$@"; do
    while (($(jobs -pr | wc -l) >= jobs)); do wait -n; done
    run_one "$name" "$name" &
  done
  wait
}

page() {
  local name i
  cat <<HEAD
# Ablation

Made by \`./kerf lab ablate --page $page\`; nothing is typed by hand. Each constant and each branch of the swept
contact (\`.ci/ablations.txt\`) is turned off alone; A+B: both at once. Then these are run, from cheap to dear, and
what comes after a stage that loses a row is left out, so more rows may get lost than are told:

1. \`kerf-lab extremes$([[ -n $full ]] || echo ' --quick')\`: walls, rests, slides and shapes
2. the tests of proxy and point shell, in fixed point; a failed one counts as a lost row
3. traps
4. the tests of the servo
5. cutting, isos, edges, and the test of a tool that turns askew in a tight hollow

Here up to stage $stages. A row moves by more than 1 % of its limit. What is needed loses one, or
makes one worse by 5 % of its limit or more.

$(date -u +%F), commit $(git rev-parse --short HEAD), $("${CXX:-c++}" --version | sed -n 1p). The contact has
$(constants) named constants (\`./kerf lab ablate --count\`).

| off | where | means | rows that move, the worst first | verdict |
|---|---|---|---|---|
HEAD
  for name in "$@"; do
    i=${number[${name%%+*}]}
    awk -F'\t' -v name="$name" -v file="${files[i]#controller/}" -v means="${meanings[i]}" -v why="${reasons[i]}" '
      { n[$1]++ }
      $1 == "worse" && $2 >= 100.05 { worn = 1 }
      NR <= 2 && $1 != "better" {
        cell = cell (cell == "" ? "" : "; ") $3 ", " $4 ": " $5 " to " $6 ($7 == "-" ? "" : ", limit " $7) ($1 == "lost" ? " **lost**" : "")
      }
      END {
        counts = sprintf("%d lost, %d worse, %d better", n["lost"], n["worse"], n["better"] + n["won"])
        if (NR == 0) counts = "none"
        verdict = n["lost"] ? "needed: a row is lost" : worn ? "needed: a row is worse" : why != "" ? "stays: " why : "no row needs it"
        print "| " name " | " file " | " (name ~ /\+/ ? "both" : means) " | " counts (cell == "" ? "" : ": " cell) " | " verdict " |"
      }' "$results/$name.changes"
  done
}

trap 'jobs -pr | xargs -r kill 2>/dev/null || true' EXIT
command -v ninja >/dev/null || die "ninja: missing; run ./kerf setup"
edit_all
mkdir -p "$work"
key=$(git ls-files -z --cached --others --exclude-standard controller lab shared tests | xargs -0 cat | cat - <(sed 's/@[^@]*$//' $list) | sha256sum)
results=$work/${full:+full-}${key:0:12}
if [[ -n $again ]]; then rm -rf "$results"; fi
mkdir -p "$results"
build
if [[ ! -s $results/.none.rows ]]; then
  : >"$results/.none.new"
  for stage in 1 2 3 4 5; do measure "$results/.none.new" '' "$stage"; done
  mv "$results/.none.new" "$results/.none.rows"
fi
if ((${#only[@]} == 0)); then only=("${names[@]}"); fi
run_all "${only[@]}"
if [[ -n $page ]]; then page "${only[@]}" >"$page"; fi
