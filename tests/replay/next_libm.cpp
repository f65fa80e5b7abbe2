// SPDX-License-Identifier: Apache-2.0
// Another C library, to be preloaded: each elementary function returns the double beside the usual
// one. What is loaded and stepped must not notice.
#include <cmath>
#include <limits>

#include <dlfcn.h>

namespace {

template <class Function>
Function* usual(const char* name) noexcept {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

double beside(double value) noexcept {
  return std::nextafter(value, std::numeric_limits<double>::infinity());
}

}  // namespace

#define KERF_OF_ONE(NAME)                           \
  double NAME(double x) noexcept {                  \
    return beside(usual<double(double)>(#NAME)(x)); \
  }
#define KERF_OF_TWO(NAME)                                      \
  double NAME(double x, double y) noexcept {                   \
    return beside(usual<double(double, double)>(#NAME)(x, y)); \
  }

extern "C" {
KERF_OF_ONE(sin)
KERF_OF_ONE(cos)
KERF_OF_ONE(tan)
KERF_OF_ONE(asin)
KERF_OF_ONE(acos)
KERF_OF_ONE(atan)
KERF_OF_ONE(exp)
KERF_OF_ONE(exp2)
KERF_OF_ONE(log)
KERF_OF_ONE(log2)
KERF_OF_ONE(log10)
KERF_OF_ONE(cbrt)
KERF_OF_TWO(atan2)
KERF_OF_TWO(hypot)
KERF_OF_TWO(pow)
void sincos(double x, double* sine, double* cosine) noexcept {
  *sine = sin(x);
  *cosine = cos(x);
}
}
