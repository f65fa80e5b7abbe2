#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# join_files.sh FILE...: C++ that is all these source files at once, each in a namespace of its own, so that their
# helpers may have the same names. What they include comes first: inside of a namespace it is no longer read.
set -eu
cat "$@" | awk '/^#include/ && !seen[$0]++'
i=0
for file; do
  i=$((i + 1))
  printf 'namespace file_%d {\n#include "%s"\n}\n' $i "$file"
done
