# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Completion of kerf (and of ./kerf) in bash: its commands and options as its own help has them; behind the name of
# a program, what that program offers.
_kerf() {
  local command=${COMP_WORDS[1]:-} help
  if ((COMP_CWORD > 1)) && type "kerf-$command" &>/dev/null; then
    _completion_loader "kerf-$command" 2>/dev/null || true
    if declare -F "_kerf_$command" >/dev/null; then
      COMP_WORDS=("kerf-$command" "${COMP_WORDS[@]:2}")
      ((COMP_CWORD -= 1))
      "_kerf_$command" "kerf-$command" "$2" "$3"
      return
    fi
  fi
  help=$("$1" --help 2>/dev/null)
  if ((COMP_CWORD == 1)); then
    help=$(grep -oP '^  \./kerf (\K[a-z]+|NAME.* any program: \K[a-z ]+)' <<<"$help")
  else
    # A command's part of the help goes to the next heading. There words stand behind the heading or below them,
    # options anywhere.
    help=$(awk -v heading="$command:" '/^[^ ]/ { mine = $1 == heading } mine' <<<"$help" |
      grep -oP '^([a-z]+: +| {7,8})\K[a-z][a-z-]*|(?<= )--?[A-Za-z][a-z-]*' | sort -u)
  fi
  mapfile -t COMPREPLY < <(compgen -W "$help" -- "$2")
}
complete -o default -F _kerf kerf ./kerf
