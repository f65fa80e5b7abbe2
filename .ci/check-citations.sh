#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Whether what comments and pages cite is there: a page (docs/theory.md), a numbered section of it
# (docs/theory.md 3.2), a source file (contact_peak.hpp), the target of a link. Prints each that dangles.
#     .ci/check-citations.sh [ROOT]      another tree, for the check of this check
set -euo pipefail
cd "${1:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}"

cited() {
  awk '
    # The part of a line that people read: all of a page, else its comment.
    function prose(line) {
      if (FILENAME ~ /\.md$/) return line
      if (FILENAME ~ /\.([ch]pp|frag|vert|comp|glsl)$/)
        return match(line, /(^|[ \t;{}(),])\/\/.*/) ? substr(line, RSTART) : ""
      if (FILENAME ~ /mutations\.txt$/ && line !~ /^#/) return ""  # code, some of it with #include
      return match(line, /(^|[ \t])#.*/) ? substr(line, RSTART) : ""
    }
    function say(kind, what) { print kind "\t" what "\t" FILENAME ":" FNR }
    FNR == 1 { held = "" }
    FILENAME ~ /\.md$/ && /^#+ [0-9]+(\.[0-9]+)?\.? / {
      number = $2; sub(/\.$/, "", number)
      say("heading", FILENAME " " number)
    }
    {
      read = prose($0)
      text = read
      was_held = held
      if (held != "") {  # a citation that goes on in the next line
        sub(/^[ \t]*(\/\/\/?|#|\*)?[ \t]*/, "", text)
        text = held " " text
      }
      held = match(read, /[A-Za-z0-9_.\/-]+\.md$/) ? substr(read, RSTART) : ""
      while (match(text, /[A-Za-z0-9_.\/-]*[A-Za-z0-9_]\.(md|[ch]pp|sh)([ ]+[0-9]+(\.[0-9]+)?)?/)) {
        what = substr(text, RSTART, RLENGTH); text = substr(text, RSTART + RLENGTH)
        if (what ~ /\.md +[0-9]/) say("section", what)
        sub(/ .*/, "", what)
        if (what != was_held && text !~ /^[A-Za-z0-9_{*]/) say("file", what)
      }
      # A page without its end.
      if (match(read, /(^|[^a-z0-9-])[a-z]+-[a-z]+ [0-9]+\.[0-9]+/))
        say("bare", substr(read, RSTART, RLENGTH))
      # A page that is named inside of a message is a promise too.
      text = $0
      while (match(text, /docs\/[a-z_-]+\.md/)) {
        say("file", substr(text, RSTART, RLENGTH)); text = substr(text, RSTART + RLENGTH)
      }
      text = read
      while (FILENAME ~ /\.md$/ && match(text, /\]\([^)#: ]+\)/)) {
        say("link", substr(text, RSTART + 2, RLENGTH - 3)); text = substr(text, RSTART + RLENGTH)
      }
    }' "$@"
}

mapfile -t files < <(git ls-files --cached --others --exclude-standard |
  grep -E '\.([ch]pp|frag|vert|comp|glsl|md|sh|txt|cmake|toml)$|^kerf$|^\.ci/run$' |
  while IFS= read -r file; do [[ -f $file ]] && echo "$file"; done)

dangling=$({
  git ls-files --cached --others --exclude-standard | sed 's/^/tree\t/'
  cited "${files[@]}"
} | awk -F '\t' '
  $1 == "tree" {  # a file may be cited by any end of its path
    whole[$2]; path = $2
    ends[path]
    while (sub(/^[^\/]*\//, "", path)) ends[path]
    next
  }
  $1 == "heading" { headings[$2]; next }
  { line[++lines] = $0 }
  END {
    for (i = 1; i <= lines; ++i) {
      split(line[i], part, "\t")
      what = part[2]
      if (seen[part[3] what]++) continue
      if (part[1] == "file") {
        sub(/^(\.\/|\/(.*\/)?)/, "", what)
        if (!(what in ends)) print part[3] ": " what ": no such file"
      } else if (part[1] == "link") {
        from = part[3]; sub(/[^\/]*$/, "", from)
        if (!((from what) in whole)) print part[3] ": " what ": no such target"
      } else if (part[1] == "bare") {
        print part[3] ": " what ": no page; write docs/PAGE.md N.M"
      } else {
        page = what; sub(/ .*/, "", page); number = what; sub(/.* /, "", number)
        if (page !~ /\//) page = "docs/" page
        if (!((page " " number) in headings)) print part[3] ": " page " has no section " number
      }
    }
  }')
if [[ -n $dangling ]]; then
  echo "$dangling"
  echo "check-citations: the lines above cite what is not there; name the page, the section or the file that is" >&2
  exit 1
fi
