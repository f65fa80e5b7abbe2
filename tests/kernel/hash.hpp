// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <type_traits>

#include "shared/numeric/fnv1a.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/text/text.hpp"

namespace kerf::test {

/// FNV-1a, eight bytes at a time, low byte first.
class Hash {
 public:
  void add(std::uint64_t value) noexcept { state_ = fnv1a_bytes(state_, value); }
  void add(double value) noexcept { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::int64_t value) noexcept { add(static_cast<std::uint64_t>(value)); }
  template <class Space, class S>
  void add(const Vec<S, Space>& v) noexcept {
    for (const S s : {v.x, v.y, v.z}) {
      if constexpr (std::is_integral_v<S>) {
        add(static_cast<std::int64_t>(s));
      } else {
        add(static_cast<double>(s));
      }
    }
  }
  [[nodiscard]] std::string hex() const { return hex64(state_); }

 private:
  std::uint64_t state_ = kFnv1aBasis;
};

}  // namespace kerf::test
