// SPDX-License-Identifier: Apache-2.0
// The force is K d + H d^3, in each kind of the loop's numbers.
#include <cmath>
#include <cstdio>

#include <kerf/law.hpp>

template <class N>
int failures() {
  constexpr double kK = 0.5, kH = 0.25;
  const kerf::LawChoice choice{kerf::LawKind::force,
                               "hardening_spring",
                               {{"stiffness_n_per_mm", kK}, {"hardening_n_per_mm3", kH}}};
  const auto spring = kerf::plan_law<kerf::ForceInput, N>(choice, {});
  kerf::LawMemory memory;
  int failures = 0;
  for (const double d : {0.0, 0.125, 0.5, 1.0, 3.0}) {
    kerf::ForceInput<N> in;
    in.spring_mm.y = typename N::Real(d);
    const double force_n = double(spring(memory, in).y), truth_n = kK * d + kH * d * d * d;
    if (std::abs(force_n - truth_n) <= 1e-4) continue;
    std::printf("%s: %g mm gives %g N and not %g\n", N::kName, d, force_n, truth_n);
    ++failures;
  }
  return failures;
}

int main() {
  return failures<kerf::FixedNumbers>() + failures<kerf::DoubleNumbers>();
}
