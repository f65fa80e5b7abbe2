#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-mutations.sh [PATTERN]: can the kernel tests fail? Changes one token at a time in a copy of
# the tree, builds the kernel tests and demands that one of them notices. Prints a table of file,
# change and what caught it. PATTERN picks the changes whose line matches. Some minutes; nothing in
# the tree is touched.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

# FILE[,FILE] | what is wrong then | sed
mutations() {
  cat <<'LIST'
controller/kernel/gradient.hpp | a tap: central -1 -> -2 | s/\{0, -1, 0, 1, 0\}/{0, -2, 0, 1, 0}/
controller/kernel/gradient.hpp,controller/kernel/kernel_set.hpp | a tap in both tables: farid 55 -> 54 | s/\{5, 32, 55, 32, 5\}/{5, 32, 54, 32, 5}/
controller/kernel/gradient.hpp,controller/kernel/kernel_set.hpp | a sign in both tables: sobel5 2 -> -2 | s/\{-1, -2, 0, 2, 1\}/{-1, -2, 0, -2, 1}/
controller/kernel/gradient.hpp | rounding of a gradient | s/round_shift\(sum, shift\), kMax/sum >> shift, kMax/
controller/kernel/gradient.hpp | reach of a refresh one short | s/changed\.grown\(kGradientReach\)/changed.grown(1)/
controller/kernel/sampling.hpp | rounding of a weight product | s/round_shift\(std::int64_t\{a\} \* b, 15\)/std::int64_t{a} * b >> 15/
controller/kernel/sampling.hpp | rounding of a cell's weight | s/0xffff\) \+ 1\) >> 1/0xffff)) >> 1/
controller/kernel/sampling.hpp | rounding of a lerp | s/round_shift\(difference \* w, 15\)/(difference * w >> 15)/
controller/kernel/sampling.hpp | a weight's sign | s/w\.y - w\.z \+ yz/w.y - w.z - yz/
controller/kernel/sampling.hpp | border: cells at 0 left out | s/return low\.x >= 0 \&\&/return low.x > 0 \&\&/
controller/kernel/sampling.hpp | border: a cell at -1 touches nothing | s/return low\.x >= -1 \&\&/return low.x >= 0 \&\&/
controller/kernel/sampling.hpp | rounding of a sample's position | s/round_shift\(rotated, 5\)/(rotated >> 5)/
controller/kernel/overlap.hpp | rounding of a scaled overlap | s/round_shift\(std::int64_t\{sum\} \* volume_ratio, 20\)/(std::int64_t{sum} * volume_ratio >> 20)/
controller/kernel/overlap.hpp | the carry's first lane | s/lowest_x - 2/lowest_x - 1/
controller/kernel/milling.hpp | shift of a loss | s/product >> \(rate\.exponent - 1\)/product >> rate.exponent/
controller/kernel/milling.hpp | the carry loses a bit | s/total & 0xffff/total \& 0xfffe/
controller/kernel/milling.hpp | the carry is not kept | s/owed = static_cast<std::uint16_t>\(total & 0xffff\)/owed = 0/
controller/kernel/milling.hpp | air is felt | s/ \|\| density\[at\] == 0\) continue/) continue/
controller/kernel/milling.hpp | rounding of a bent ratio | s/\(ratio & 127\) \+ 64\) >> 7/(ratio \& 127)) >> 7/
controller/kernel/sampling.hpp | rounding to the nearest voxel | s/round_shift\(at\.raw\(\), 16\)/at.raw() >> 16/
controller/kernel/kernel_set.hpp | rounding of the kept bits | s/round_shift\(taps\.factor \* sum, taps\.shift - kAlignedKeptBits\)/taps.factor * sum >> (taps.shift - kAlignedKeptBits)/
tests/kernel/definitions.hpp | the definition loses the last tap | s/for \(std::int32_t i = 0; i < 5; \+\+i\)/for (std::int32_t i = 0; i < 4; ++i)/
controller/kernel/overlap_methods.hpp | the box lies one voxel off | s/cell\.low\.y - kGradientReach/cell.low.y - 1/
controller/kernel/sets/scalar.cpp | a sign in the x filter | s/across -= taps/across += taps/
controller/kernel/sets/scalar.cpp | a mask row off by one | s/row = \(z \+ 1 - /row = (z - /
controller/kernel/sets/box_vector.hpp | border: one column too many | s/x >= from && x < to/x >= from \&\& x <= to/
controller/kernel/sets/box_vector.hpp | border: one column too few | s/x >= from \&\& x < to/x > from \&\& x < to/
controller/kernel/sets/correlate_vector.hpp | sums never widened | s/end - chunk > tool\.flush \?/false ?/
controller/kernel/sets/correlate_vector.hpp | sums widened a chunk late | s/chunk \+ tool\.flush : end/chunk + tool.flush + 1 : end/
controller/kernel/sets/box_vector.hpp | a shift of the removal | s/const std::int32_t s = exponent - 1;/const std::int32_t s = exponent;/
controller/kernel/sets/avx2.cpp | the carry-out compares signed | s/_mm256_max_epu16\(sum, part\)/_mm256_max_epi16(sum, part)/
controller/kernel/sets/avx2.cpp | rows written back from the box | s/V \/\*rho\*\//V rho/; s/write_whole<Simd>\(density, begin, count, loss, lost\)/store(density + begin, sub16(rho, loss))/
controller/kernel/sets/avx512.cpp | the carry-out counts equality | s/_mm512_cmplt_epu16_mask/_mm512_cmple_epu16_mask/
controller/kernel/sets/avx512.cpp | the mask of a loss is whole | s/density \+ begin, lost, sub16/density + begin, ~0u, sub16/
controller/kernel/sets/avx512.cpp | sums no longer in registers | s/__asm__\("vpdpwssd.*/sum = _mm512_dpwssd_epi32(sum, a, b);/
controller/kernel/kernel_set.hpp | a tap of exact sums: central 32 -> 31 | s/\{0, 0, 32, 0, 0\}/{0, 0, 31, 0, 0}/
controller/kernel/kernel_set.hpp | the low parts of a wide sum are lost | s/high \+ \(low >> shift\)/high/
controller/kernel/sets/set_common.hpp | rounding of a sample's place | s/z\[i\] \+ 16\) >> 5/z[i]) >> 5/
controller/kernel/sets/set_common.hpp | rounding of a weight product | s/wy \* wz \+ kHalf/wy * wz/
controller/kernel/sets/gather_vector.hpp | border: one cell too many | s/grid\.nx - 2\)/grid.nx - 1)/
controller/kernel/sets/gather_vector.hpp | sums widened too late | s/kGatherBlock = 65536/kGatherBlock = 262144/
controller/kernel/sets/gather_vector.hpp | samples beyond the last count | s/\(i < count\) & //
controller/kernel/sets/splat_loops.hpp | rounding of a scaled overlap | s/ \+ \(1 << 19\)\) >> 20/) >> 20/
controller/kernel/sets/splat_loops.hpp | air is felt | s/density == INT16_MIN \? 0 : covered/covered/
controller/kernel/sets/splat_loops.hpp | what lies beyond a full voxel is lost | s/sums\[x\] - covered : sums/0 : sums/
controller/kernel/sets/set_common.hpp | the way from outside is forgotten | s/FreeSpaceMap::at_least\(distance, outside\[i\]\)/distance/
controller/kernel/sets/set_common.hpp | border: the volume is a brick longer | s/beyond\(place >> 16, n\)/beyond(place >> 16, n + 1)/
controller/kernel/sets/set_common.hpp | the brick of one group | s/ >> kToBrick;/ >> (kToBrick + (i == 3));/
controller/kernel/overlap_methods.hpp | the box lies one voxel off | s/low\.y - kGradientReach/low.y - 1/
controller/plan/tables/sample_tables.cpp | the flush bound is twice too large | s/\(2 \* largest \* 32768\)/(largest * 32768)/
controller/plan/tables/sample_tables.cpp | a mask's lane off by one | s/static_cast<std::size_t>\(v\.x\) \+ 2 \+ moved/static_cast<std::size_t>(v.x) + 1 + moved/
LIST
}

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
git ls-files -z --cached --others --exclude-standard | xargs -0 cp --parents -t "$scratch"

# caught_by EXECUTABLE...: builds and runs one after the other up to the first that fails, and says
# which test failed. Says nothing when all pass; 2 when it cannot be built. The golden hashes see
# nearly everything and explain nothing, so they come last.
caught_by() {
  local which test status
  for which in -tce -tc; do
    for test in "$@"; do
      if ! cmake --build "$scratch/build" --target "$test" >"$scratch/build.log" 2>&1; then
        grep -qE 'static assertion failed|non-constant condition' "$scratch/build.log" || return 2
        echo 'the compiler: a static assertion'
        return
      fi
      status=0
      (cd "$scratch" && timeout 300 "build/bin/$test" "$which=*known hash*" -aa=1) \
        >"$scratch/test.log" 2>&1 || status=$?
      ((status)) || continue
      # Its name stands above the first error; a crash may leave none.
      awk '/^TEST CASE:/ { sub("TEST CASE: *", ""); name = $0 } /ERROR/ { print name; exit }' \
        "$scratch/test.log" | grep . || echo "$test ends with $status"
      return
    done
  done
  if [[ $(uname -m) == x86_64 ]]; then
    find "$scratch/build" -path '*kerf_kernel_sets.dir*' -name '*.o' -print0 |
      xargs -0 "$scratch/.ci/check-hot-loops.sh" >/dev/null 2>&1 || echo 'check-hot-loops.sh'
  fi
}

echo "check-mutations: building the kernel tests as they are" >&2
cmake -S "$scratch" -B "$scratch/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_FLAGS_RELEASE=-O1 --log-level=ERROR >/dev/null
if ! before=$(caught_by test_kernel test_aligned test_point_shell) || [[ -n $before ]]; then
  tail "$scratch/build.log" >&2
  echo "check-mutations: the tests fail without any change (${before:-build}); mend them first" >&2
  exit 2
fi

missed=0
printf '%-34s %-42s %s\n' file change 'caught by'
while IFS='|' read -r files what edit; do
  [[ -z ${1:-} || "$files|$what" =~ $1 ]] || continue
  IFS=',' read -ra names <<<"${files// /}"
  for name in "${names[@]}"; do
    sed -E -i "$edit" "$scratch/$name"
    if cmp -s "$name" "$scratch/$name"; then
      echo "check-mutations: $name has no place for '$what'; mend the list" >&2
      exit 2
    fi
  done
  # First the tests that are nearer.
  tests=(test_kernel test_aligned)
  [[ $files =~ overlap_methods|kernel_set|sets ]] && tests=(test_aligned test_kernel)
  [[ $files =~ set_common ]] && tests+=(test_point_shell)
  if ! caught=$(caught_by "${tests[@]}"); then
    cat "$scratch/build.log"
    echo "check-mutations: '$what' does not compile; mend the list" >&2
    exit 2
  fi
  if [[ -z $caught ]]; then
    caught=NOTHING
    missed=$((missed + 1))
  fi
  printf '%-34s %-42s %s\n' "${names[0]#controller/}" "${what# }" "$caught"
  for name in "${names[@]}"; do cp "$name" "$scratch/$name"; done
done < <(mutations)

if ((missed)); then
  echo "check-mutations: $missed changes went unseen; add a test that fails with them" >&2
  exit 1
fi
