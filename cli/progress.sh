# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2034  # what its readers use
# Sourced by ./kerf and .ci/packages.sh: how far the steps before a start are, as one percentage over packages, configuring
# and building. Each step has a range of it, so the figure never falls.
# KERF_DONE: percent of all that is done; 0 or unset at the beginning. A child takes it from its parent.

# Ends of the ranges of packages and of configuring. On two cores packages take a fifth of a first start, configuring seconds.
packages_end=20
configure_share=3

# show_steps END: how far the step is that standard input reports on, as percentages from KERF_DONE to END, and how long a
# build takes at the pace so far: on a terminal one line with the work at hand, else a line for each tenth and at least
# every 15 s. Reads ninja's lines and apt's status lines; passes all others, such as errors. Silent if there is nothing to do.
show_steps() {
  local from=${KERF_DONE:-0} end=$1 line='' part='' status percent='' highest=-1 left='' text='' drawn='' shown spoken=$SECONDS
  local said=$((from / 10))
  local began=$SECONDS
  while :; do
    status=0
    IFS= read -r -t 5 part || status=$?
    line+=$part
    if ((status == 0)); then
      percent=''
      if [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ (.*) ]]; then
        text=${BASH_REMATCH[3]}
        if [[ $text == Re-* ]]; then  # ninja looks for new files
          percent=0 left=''
        else
          percent=$((100 * BASH_REMATCH[1] / BASH_REMATCH[2]))
          if ((SECONDS - began >= 3)); then
            left=$(((SECONDS - began) * (BASH_REMATCH[2] - BASH_REMATCH[1]) / BASH_REMATCH[1]))
            left=$( ((left)) && printf ', %d:%02d left' $((left / 60)) $((left % 60))) || left=''
          fi
        fi
      elif [[ $line =~ (dl|pm)status:[^:]*:([0-9]+)[^:]*:(.*) ]]; then  # first all downloads, then all else
        text=${BASH_REMATCH[3]} percent=$((BASH_REMATCH[2] / 2))
        if [[ ${BASH_REMATCH[1]} == pm ]]; then percent=$((percent + 50)); fi
      elif [[ $line == '-- '* ]]; then
        text=${line#-- } percent=$((highest < 0 ? 0 : highest))
      elif [[ $line != ninja:*@(Entering|'no work')* ]]; then
        if [[ -n $drawn ]]; then printf '\r\e[K'; fi
        echo "$line"
      fi
      line=''
    elif ((status <= 128)); then
      break
    fi
    if [[ -n $percent ]] && ((percent > highest)); then highest=$percent; fi
    if ((highest < 0)); then continue; fi  # nothing to do so far
    shown=$((from + (end - from) * highest / 100))
    if [[ -t 1 ]]; then
      printf '\r\e[K%3d %%%s  %.60s' "$shown" "$left" "$text"
      drawn=1
    elif ((shown / 10 > said || SECONDS - spoken >= 15)); then
      printf '  %d %%%s%s\n' "$shown" "$left" "${text:+  ${text:0:60}}"
      said=$((shown / 10)) spoken=$SECONDS
    fi
  done
  if [[ -n $line ]]; then echo "$line"; fi
  if [[ -n $drawn ]]; then printf '\r\e[K'; fi
}
