# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Completion of kerf (and of ./kerf) in bash: its commands, options and their words as its own help has them. An installed program
# offers its own words behind its name.

# _kerf_values OPTION WORD: in COMPREPLY what may follow an option, whose help (one line each) comes in. Returns 1 if
# the option takes no value.
_kerf_values() {
  local option=$1 word=$2 line name words='' home=${COMP_WORDS[0]}
  line=$(grep -E -- "^ +([^ ]*,)?$option [^ ]" | head -n 1)
  line=${line#*"$option "}
  name=${line%% *}
  [[ -n $name && $name != @(Excludes|Needs): ]] || return 1
  case $name in
    FILE | PATH | DIR)
      compopt -o filenames 2>/dev/null
      if [[ $option == --scene ]]; then
        home=$(dirname "$(readlink -f "$(type -P "$home" || echo "$home")")")
        words=$(find "$home/scenes" -maxdepth 1 -name '*.toml' -printf '%f\n' 2>/dev/null | sed 's/\.toml$//')
      elif [[ $option == --hand ]]; then
        words=mouse
      fi
      mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word" && true; compgen -f -- "$word")
      ;;
    *)
      compopt +o default 2>/dev/null
      words=$(grep -oP '^[^ ]*:\{\K[^}]*' <<<"$line" | tr ',' ' ')
      if [[ -z $words ]]; then
        words=$(grep -oP '([a-z][a-z0-9-]*, )+[a-z][a-z0-9-]* or [a-z][a-z0-9-]*' <<<"$line" | head -n 1)
      fi
      mapfile -t COMPREPLY < <(compgen -W "$(sed 's/, / /g; s/ or / /' <<<"$words")" -- "$word")
      ;;
  esac
}

_kerf() {
  local command=${COMP_WORDS[1]:-} sub=${COMP_WORDS[2]:-} help
  if ((COMP_CWORD > 1)) && type "kerf-$command" &>/dev/null; then
    _completion_loader "kerf-$command" 2>/dev/null || true
    if declare -F "_kerf_$command" >/dev/null; then
      COMP_WORDS=("kerf-$command" "${COMP_WORDS[@]:2}")
      ((COMP_CWORD -= 1))
      "_kerf_$command" "kerf-$command" "$2" "$3"
      return
    fi
  fi
  if ((COMP_CWORD == 1)) || [[ $command == help ]]; then
    help=$("$1" --help 2>/dev/null | grep -oP '^  (\./)?kerf (\K[a-z-]+|NAME.* any program: \K[a-z ]+)' | tr ' ' '\n' | sort -u)
    if ((COMP_CWORD > 2)); then help=''; fi
  else
    # What is further to the right belongs to the line before.
    if ((COMP_CWORD > 2)) && [[ $sub == [a-z]* ]]; then help=$("$1" help "$command" "$sub" 2>/dev/null); fi
    help=$(if [[ -n $help ]]; then echo "$help"; else "$1" help "$command" 2>/dev/null; fi | sed -E ':a; N; $!ba; s/\n {15,}/ /g')
    if [[ $3 == -* ]] && _kerf_values "$3" "$2" <<<"$help"; then return; fi
    help=$({
      grep -oP '^ +(--?[A-Za-z][^ ]*)' <<<"$help" | tr ',' '\n'
      if ((COMP_CWORD == 2)); then sed -n '/ommands:$/,/^$/s/^  \([a-z][a-z-]*\)  .*/\1/p' <<<"$help"; fi
    } | sort -u)
  fi
  mapfile -t COMPREPLY < <(compgen -W "$help" -- "$2")
}
complete -o default -F _kerf kerf ./kerf
