#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# kerf-manual.sh VERSION: the man page of ./kerf from its help and that of its commands.
set -euo pipefail
cat <<HEAD
.TH KERF 1 "" "kerf $1" "kerf"
.SH NAME
kerf \- haptic milling of a tooth
.SH SYNOPSIS
.B kerf
\fICOMMAND\fR [\fIOPTION\fR]...
.SH COMMANDS
.nf
HEAD
# As an installed kerf has it.
# shellcheck disable=SC2034  # for help.sh
root=. me=kerf
# shellcheck source=cli/help.sh
source cli/help.sh
{
  first_screen | tail -n +3
  for command in $(commands); do
    if [[ -e cli/help/$command.txt ]]; then printf '\n' && cat "cli/help/$command.txt"; fi
  done
} | sed 's|\./kerf|kerf|g; s/\\/\\e/g; s/-/\\-/g; s/^\([.'"'"']\)/\\\&\1/'
cat <<'FOOT'
.fi
.SH SEE ALSO
kerf-controller(1), kerf-emulator(1), kerf-visualizer(1), kerf-recorder(1), kerf-record(1), kerf-replay(1), kerf-volume(1),
kerf-bridge(1), kerf-lab(1), kerf-arm(1)
FOOT
