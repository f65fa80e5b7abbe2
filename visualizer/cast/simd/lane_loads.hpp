// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <immintrin.h>

// For the x86 files that define `Simd` only: loads for single lanes.
//
// In place of gather instructions: with those a picture took 18 to 30 % longer on Zen 5, where they
// are microcode. With AVX-512 it takes a fifth less on Sapphire Rapids, so there is a file for
// both; with AVX2 it does not pay.

namespace kerf {
namespace {

/// Four bytes from entry `at` on.
inline std::int32_t load_bytes(const void* p, std::int32_t at, int entry_bytes) noexcept {
  std::int32_t value = 0;
  __builtin_memcpy(&value, static_cast<const char*>(p) + std::ptrdiff_t{at} * entry_bytes,
                   sizeof(value));
  return value;
}

/// Eight bytes from entry `a` on, then as many from `b` on.
inline __m128 load_pairs(const void* p, std::int32_t a, std::int32_t b, int entry_bytes) noexcept {
  const auto* const bytes = static_cast<const char*>(p);
  const void* const from_a = bytes + std::ptrdiff_t{a} * entry_bytes;
  const void* const from_b = bytes + std::ptrdiff_t{b} * entry_bytes;
  const __m128i low = _mm_loadl_epi64(static_cast<const __m128i*>(from_a));
  return _mm_loadh_pi(_mm_castsi128_ps(low), static_cast<const __m64*>(from_b));
}

}  // namespace
}  // namespace kerf
