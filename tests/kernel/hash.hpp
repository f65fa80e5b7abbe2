// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>
#include <type_traits>

#include "shared/numeric/vec.hpp"

namespace kerf::test {

/// FNV-1a, eight bytes at a time, low byte first.
class Hash {
 public:
  void add(std::uint64_t value) noexcept {
    for (int byte = 0; byte < 8; ++byte) {
      state_ = (state_ ^ (value >> (8 * byte) & 0xff)) * 0x100000001b3u;
    }
  }
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
  [[nodiscard]] std::string hex() const {
    std::ostringstream text;
    text << std::hex << std::setw(16) << std::setfill('0') << state_;
    return text.str();
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

}  // namespace kerf::test
