#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every header stands alone, though the build has precompiled headers of the standard library, which
# hide a forgotten include. First by text: a header that names something of such a standard header
# includes it, itself or by a header of ours. Then each header is compiled with nothing before it but what it
# includes itself; what the text has shown to be included is precompiled here, too: a quarter of the time.
#     .ci/check-headers.sh [ROOT]      another tree, for the check of this check
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
cd "${1:-$here/..}"
mapfile -t headers < <(find include shared controller record replay arm hil standin lab face visualizer bridge web tests -name '*.hpp' | sort)

# As in CMakeLists.txt; of each, the names by which a header shows that it needs it.
needs='
algorithm  (sort|stable_sort|find|find_if|min|max|clamp|copy|fill|any_of|all_of|none_of|count_if|min_element|max_element|nth_element|lower_bound|upper_bound|transform|replace|reverse|equal|ranges::(sort|find|any_of|all_of|copy|fill|count|max|min|max_element|min_element))\(
array      (array\b|to_array)
atomic     (atomic|memory_order)
chrono     chrono::
cmath      (abs|fabs|sqrt|hypot|floor|ceil|round|lround|llround|pow|exp|log|log2|log10|sin|cos|tan|asin|acos|atan|atan2|isfinite|isnan|fmod|cbrt)\(
cstdint    u?int(8|16|32|64)_t\b
filesystem filesystem::
fstream    [io]?fstream\b
functional (function|ref|cref|bind|hash|less|greater|plus)[<(]
memory     (unique_ptr|shared_ptr|weak_ptr|make_unique|make_shared|addressof)\b
optional   (optional|nullopt)\b
random     (mt19937|mt19937_64|uniform_\w+_distribution|normal_distribution|random_device)\b
span       span\b
sstream    [io]?stringstream\b
string     (string\b|to_string|getline)
thread     (thread\b|jthread|this_thread::)
vector     vector\b'

by_text() {
  perl -e '
    my ($needs, @headers) = @ARGV;
    my (%text, %seen);
    for my $file (@headers) { local $/; open my $in, "<", $file or die; $text{$file} = <$in>; }
    sub closure {  # of one header: each standard header that it includes, in the end
      my ($file, $into) = @_;
      return if $into->{$file}++;
      $into->{$1} = 1 while ($text{$file} // "") =~ /^#include <([^>]+)>/mg;
      my @below = ($text{$file} // "") =~ /^#include "([^"]+)"/mg;
      s{^kerf/}{include/kerf/} for @below;  # as other programs include it
      closure($_, $into) for @below;
    }
    for my $file (@headers) {
      my (%has, $code);
      closure($file, \%has);
      ($code = $text{$file}) =~ s{//[^\n]*}{}g;
      for (split /\n/, $needs) {
        my ($header, $names) = split " ", $_, 2 or next;
        next if $has{$header} or $code !~ /\bstd::($names)/;
        print "$file: std::$1 without <$header>\n";
      }
    }' "$needs" "${headers[@]}"
}
forgotten=$(by_text)
if [[ -n $forgotten ]]; then
  echo "$forgotten"
  echo "check-headers: include what the lines above name" >&2
  exit 1
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
compiler="clang++-$("$here/../cmake/clang-version.sh") -std=c++20 -I. -Iinclude -Istandin/include $(pkg-config --cflags epoxy imgui glfw3) $(printf -- '-isystem %s ' /usr/include/gdcm-*)"
compiler+=" -DBOOST_ASIO_HAS_CO_AWAIT -DBOOST_ASIO_HAS_STD_COROUTINE"  # as bridge/CMakeLists.txt
awk 'BEGIN { print "#define KERF_VERSION \"\"" } NF { print "#include <" $1 ">" }' <<<"$needs" >"$work/standard.hpp"
# Templates that it asks for are made here, not again for each header.
$compiler -fpch-instantiate-templates -x c++-header "$work/standard.hpp" -o "$work/standard.pch"
# Not compiled: parts of a kernel, whose including file says first which vectors they mean, and what
# tests share, which CMake gives names of folders.
parts='^tests/|^controller/kernel/sets/(.*_(vector|loops)|set_table)\.hpp$|^visualizer/cast/simd/packet_|^visualizer/scene/simd/filter_rows\.hpp$'
# Lines of headers, each of which includes all that stand before it and all that these include: what it sees there, it
# would see alone. So one file shows all of a line.
in_chains() {
  perl -e '
    my ($standard, @headers) = @ARGV;
    my (%includes, %closure, @chains);
    my %precompiled = map { $_ => 1 } split " ", $standard;
    for my $file (@headers) {
      local $/;
      open my $in, "<", $file or die;
      $includes{$file} = [map { s{^kerf/}{include/kerf/}r } <$in> =~ /^#include [<"]([^">]+)/mg];
    }
    sub closure {
      my ($file) = @_;
      $closure{$file} //= do {
        my %all = map { $_ => 1, %{closure($_)} } grep { !$precompiled{$_} } @{$includes{$file} // []};
        \%all;
      };
    }
    for my $file (sort { keys %{closure($a)} <=> keys %{closure($b)} || $a cmp $b } @headers) {
      my %own = %{closure($file)};
      my ($longest) = sort { keys %{closure($b->[-1])} <=> keys %{closure($a->[-1])} }
        grep { my $last = $_->[-1]; $own{$last} && !grep { !$own{$_} } keys %{closure($last)} } @chains;
      if ($longest) { push @$longest, $file } else { push @chains, [$file] }
    }
    print "@$_\n" for @chains;' "$(awk 'NF { print $1 }' <<<"$needs")" "$@"
}
mapfile -t compiled < <(printf '%s\n' "${headers[@]}" | grep -vE "$parts")
in_chains "${compiled[@]}" >"$work/chains"
failed=0
xargs -a "$work/chains" -P "$(nproc)" -I{} sh -c \
  "printf '#include \"%s\"\\n' {} | $compiler -include-pch $work/standard.pch -fsyntax-only -x c++ - ||
   { echo 'check-headers: one of these does not stand alone: {}' >&2; exit 1; }" || failed=1
exit "$failed"
