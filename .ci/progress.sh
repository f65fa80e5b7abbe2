# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Sourced by ./kerf: how far a build is.

# Shows how far ninja is, and how long the rest takes at the pace so far: on a terminal with the step
# at work, else a line for every tenth. Passes what is no step, such as an error, and is silent when
# there is nothing to do.
show_steps() {
  local line percent left shown=0 drawn='' began=$SECONDS
  while IFS= read -r line; do
    if [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ (.*) ]]; then
      percent=$((100 * BASH_REMATCH[1] / BASH_REMATCH[2])) left=''
      if ((SECONDS - began >= 3)); then
        left=$(((SECONDS - began) * (BASH_REMATCH[2] - BASH_REMATCH[1]) / BASH_REMATCH[1]))
        left=$(printf ', %d:%02d left' $((left / 60)) $((left % 60)))
      fi
      if [[ ${BASH_REMATCH[3]} == Re-* ]]; then  # ninja looks for new files
        shown=0
      elif [[ -t 1 ]]; then
        printf '\r\e[K%3d %%%s  %.60s' "$percent" "$left" "${BASH_REMATCH[3]}"
        drawn=1
      elif ((percent / 10 > shown)); then
        shown=$((percent / 10))
        echo "  ${shown}0 %$left"
      fi
    elif [[ $line != '-- '* && $line != ninja:*@(Entering|'no work')* ]]; then
      echo "$line"
    fi
  done
  if [[ -n $drawn ]]; then printf '\r\e[K'; fi
}
