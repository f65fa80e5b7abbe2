# SPDX-License-Identifier: Apache-2.0
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
    COMPREPLY=($(compgen -W "$(grep -oP '^  \./kerf \K[a-z]+' <<<"$help")
      controller emulator visualizer recorder record volume bridge lab" -- "$2"))
  else
    COMPREPLY=($(compgen -W "$(sed -n "/^$command:/,/^[a-z]*:/p" <<<"$help" | grep -oP '(?<= )--?[A-Za-z][a-z-]*')" -- "$2"))
  fi
}
complete -o default -F _kerf kerf ./kerf
