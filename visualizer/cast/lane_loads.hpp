// SPDX-License-Identifier: Apache-2.0
// For the x86 files that define `Simd` only: loads for single lanes.
//
// In place of gather instructions: those take half as long again where they are microcode, as on
// Zen, and longer still on the many processors whose microcode mends "Downfall" (CVE-2022-40982).
#pragma once

#include <cstddef>
#include <cstdint>

#include <immintrin.h>

namespace kerf {
namespace {

/// Four bytes from entry `at` on.
inline std::int32_t load_bytes(const void* p, std::int32_t at, int entry_bytes) noexcept {
  std::int32_t value = 0;
  __builtin_memcpy(&value, static_cast<const char*>(p) + std::ptrdiff_t{at} * entry_bytes,
                   sizeof(value));
  return value;
}

/// Two entries from `a` on, then two from `b` on.
inline __m128 load_pairs(const std::uint32_t* a, const std::uint32_t* b) noexcept {
  const __m128i low = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(a));
  return _mm_loadh_pi(_mm_castsi128_ps(low), reinterpret_cast<const __m64*>(b));
}

}  // namespace
}  // namespace kerf
