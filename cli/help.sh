# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154  # root, bin and me are those of ./kerf
# Sourced by ./kerf: its help, and the check of what is typed against it, before anything is installed, configured or built.
# help/ has one file for each command, from which its options and their values are read. The files kerf-*.txt are what the
# programs print for --help, for a clone that has not built them: tests/script/help_test.py makes and compares them.

pages=$root/cli/help
# Commands that another name has, too.
declare -A same_as=([sweep]='lab sweep' ['bench kernels']='lab bench' ['bench pictures']=visualizer ['bench safety']='lab faults'
  ['bench bridge']='studies bridge' ['bench ranges']='studies ranges')
of_clones='setup test docs page package stand-in studies'

# commands: those of this script, by the first screen of its help; programs: those that the help has.
commands() {
  sed -nE '/kerf lab /d; s|^  \./kerf ([a-z-]+) .*|\1|p' "$pages/kerf.txt" | if [[ $me == kerf ]]; then grep -vxF "${of_clones// /$'\n'}"; else cat; fi
}
programs() { (cd "$pages" && printf '%s\n' kerf-*.txt) | sed 's/^kerf-\(.*\)\.txt$/\1/'; }

# first_screen: without what an installed kerf has not.
first_screen() {
  if [[ $me != kerf ]]; then
    cat "$pages/kerf.txt"
    return
  fi
  grep -vE "^  \./kerf (${of_clones// /|}) " "$pages/kerf.txt" | sed 's/source <(.*)/bash-completion brings it/; s|\./kerf|kerf|g'
  echo "Here it is installed: ${of_clones// /, }, bench safety, bench bridge and bench ranges need a clone of its sources."
}

# read_help NAME [COMMAND]: of a command or program, in `page` the text, in `takes` the value of each option (empty: a flag), in `words`
# the commands of a program. Returns 1 for an unknown one.
read_help() {
  local file=$pages/$1.txt here=1 wanted line option heading=''
  page='' words=()
  declare -gA takes=()
  if [[ ! -e $file ]]; then file=$pages/kerf-$1.txt wanted="## kerf-$1${2:+ $2}" here=''; fi
  [[ $1 =~ ^[a-z][a-z0-9-]*$ && -e $file ]] || return 1
  while IFS= read -r line; do
    if [[ $line == '## '* ]]; then
      here=''
      if [[ $line == "$wanted" ]]; then here=1; fi
      continue
    fi
    [[ -n $here ]] || continue
    page+=$line$'\n'
    if [[ $line =~ ^[A-Z] ]]; then heading=$line; fi
    if [[ $line =~ ^\ \ (-[^\ ]+)(\ [^\ ]+)? ]]; then
      for option in ${BASH_REMATCH[1]//,/ }; do
        takes[$option]=${BASH_REMATCH[2]}
        if [[ ${takes[$option]} == ' '@(Excludes|Needs): ]]; then takes[$option]=''; fi
      done
    elif [[ $heading == *ommands: && $line =~ ^\ \ ([a-z][a-z-]*)\ \  ]]; then
      words+=("${BASH_REMATCH[1]}")
    fi
  done <"$file"
  [[ -n $page ]]
}

# distance A B: letters to change, add, drop or exchange with the next.
distance() {
  local a=$1 b=$2 i j cost
  local -a older=() old=() row=()
  for ((j = 0; j <= ${#b}; ++j)); do row[j]=$j; done
  for ((i = 1; i <= ${#a}; ++i)); do
    older=("${old[@]}") old=("${row[@]}") row=("$i")
    for ((j = 1; j <= ${#b}; ++j)); do
      cost=$((old[j - 1] + 1))
      if [[ ${a:i-1:1} == "${b:j-1:1}" ]]; then cost=${old[j - 1]}; fi
      if ((old[j] + 1 < cost)); then cost=$((old[j] + 1)); fi
      if ((row[j - 1] + 1 < cost)); then cost=$((row[j - 1] + 1)); fi
      if ((i > 1 && j > 1)) && [[ ${a:i-1:1} == "${b:j-2:1}" && ${a:i-2:1} == "${b:j-1:1}" ]] && ((older[j - 2] + 1 < cost)); then
        cost=$((older[j - 2] + 1))
      fi
      row[j]=$cost
    done
  done
  echo "${row[${#b}]}"
}

# near WORD KNOWN...: `did you mean KNOWN? ` for the known word that begins so, or that has at most a third of its letters wrong.
near() {
  local word=${1##*(-)} known plain best='' away most least
  ((${#word} >= 2 && ${#word} <= 40)) || return 0
  most=$(((${#word} + 2) / 3)) least=$((most + 1))
  for known in "${@:2}"; do
    plain=${known##*(-)}
    if [[ $plain == "$word"* ]]; then
      best=$known
      break
    fi
    ((${#plain} - ${#word} <= most && ${#word} - ${#plain} <= most)) || continue
    away=$(distance "$word" "$plain")
    if ((away < least)); then least=$away best=$known; fi
  done
  if [[ -n $best ]]; then echo "did you mean $best? "; fi
}

# judge_scene TITLE NAME: is a file, or a scene of kerf, with or without folder and ending.
judge_scene() {
  local file known=() name=${2##*/}
  if [[ -e $2 ]]; then return; fi  # a pipe, too
  for file in "$root/$2" "$root/scenes/$2" "$root/scenes/$2.toml"; do
    if [[ -f $file ]]; then return; fi
  done
  for file in "$root"/scenes/*.toml; do known+=("$(basename "$file" .toml)"); done
  file=$(near "${name%.toml}" "${known[@]}") file=${file% }
  die "$1 $2: no such scene file; ${file:-name one, for example scenes/phantom.toml}"
}

# judge TITLE NAME COMMAND WORD...: dies at the first word that the help of NAME (and COMMAND, if not empty) does not know and at an
# option without its value; prints the help at --help.
judge() {
  local title=$1 name=$2 command=$3 word option
  shift 3
  read_help "$name" "$command" || return 0
  while (($#)); do
    word=$1 option=$1
    shift
    if [[ ! -e $pages/$name.txt ]]; then option=${word%%=*}; fi  # programs read --option=value, too
    case $word in
      --) return ;;
      -h | --help)
        show <<<"${page%$'\n'}"
        exit 0
        ;;
      --version)
        [[ -n ${takes[$word]+known} ]] || die "$title: $word: unknown; see $me --version"
        version
        exit 0
        ;;
      -[0-9.]* | -) ;;
      -*)
        [[ -n ${takes[$option]+known} ]] ||
          die "$title: $option: unknown; $(near "$option" "${!takes[@]}" --help)see $me $title --help"
        if [[ -z ${takes[$option]} || $option != "$word" ]]; then continue; fi
        needs_value "$title" "$option" "${1:-}"
        if [[ $option == --scene ]]; then judge_scene "$title: --scene" "$1"; fi
        shift
        ;;
      *)
        if [[ $name == lab && $command == sweep && $word != *=* ]]; then judge_scene "$title:" "$word"; fi
        if ((${#words[@]})) && [[ -z $command ]]; then
          [[ " ${words[*]} " == *" $word "* ]] ||
            die "$title: $word: unknown; $(near "$word" "${words[@]}")see $me $title --help"
          command=$word title+=" $word"
          read_help "$name" "$command" || return 0
        elif [[ -e $pages/$name.txt ]]; then
          die "$title: $word: unknown; see $me $title --help"
        fi
        ;;
    esac
  done
  ((${#words[@]} == 0)) || [[ -n $command ]] || die "$title: no command; take ${words[*]}"
}

# built PROGRAM: one of this clone's own, which judges its words itself.
built() { [[ -x $bin/kerf-$1 ]] && { [[ -n ${KERF_BIN:-} ]] || ! made_for "$root" "${bin%/bin}" >/dev/null; }; }

# known_command NAME: else dies, with the commands and programs that there are.
known_command() {
  local known
  mapfile -t known < <({
    commands
    if [[ -z ${KERF_BIN:-} ]]; then programs; fi
    find "$bin" -maxdepth 1 -name 'kerf-*' -printf '%f\n' 2>/dev/null | sed 's/^kerf-//' | sort
  } | awk '!seen[$0]++')
  if [[ " help $of_clones ${known[*]} " == *" $1 "* ]]; then return; fi
  if [[ -e $root/build/release/build.ninja ]] && known_programs "$root/build/release" | grep -qxF -- "$1"; then return; fi
  local hint
  hint=$(near "$1" help "${known[@]}")
  die "$1: unknown; ${hint:-known are ${known[*]}}${hint:+see $me --help}"
}

# judge_all COMMAND WORD...: before anything else happens.
judge_all() {
  local name=$1 title=$1 command=''
  known_command "$name"
  if [[ " $of_clones " == *" $name "* ]]; then needs_sources "$name"; fi
  shift
  if [[ $name == bench && -n ${same_as["bench ${1:-}"]:-} ]]; then
    title="bench $1"
    shift
  elif [[ $name == studies && ${1:-} == ablate ]]; then
    return
  fi
  if [[ -n ${same_as[$title]:-} ]]; then read -r name command <<<"${same_as[$title]}"; fi
  if [[ -e $pages/$name.txt ]] || ! built "$name"; then judge "$title" "$name" "$command" "$@"; fi
}

# tell_help [COMMAND...]: the first screen, or the help of one command.
tell_help() {
  if [[ ${1:-} == @(|help|-*) ]]; then
    first_screen | show
  else
    exec "$root/kerf" "$@" --help
  fi
}
