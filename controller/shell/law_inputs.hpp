// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include "controller/law/law_row.hpp"
#include "shared/text/format.hpp"

namespace kerf {

/// What a law was given last, as numbers: written before the step, read by whoever outlives it.
struct LastInput {
  std::array<double, 16> number{};
};

/// Inputs at random: of each number a third at an end of its range, 0, or one step of fixed point.
class LawInputs {
 public:
  template <class N>
  void next(ForceInput<N>& in, LastInput& last) {
    spring(in.spring_mm, last);
    vec(in.velocity_mm_per_s, kEnd, last, 3);
    vec(in.tip_mm, 1000, last, 6);
    in.scene_tip_mm = relabel<WorldSpace>(in.tip_mm);
    const double length = static_cast<double>(norm(in.spring_mm));
    for (auto of : {&DeviceVec<typename N::Unit>::x, &DeviceVec<typename N::Unit>::y,
                    &DeviceVec<typename N::Unit>::z}) {
      in.normal.*of = typename N::Unit(0);
    }
    if (length > 0) in.normal.y = typename N::Unit(1);
  }
  template <class N>
  void next(VelocityInput<N>& in, LastInput& last) {
    vec(in.tip_mm, kEnd, last, 0);
    constexpr std::array<std::uint32_t, 4> kTicks{1, 1, 2, 1000};
    in.ticks = kTicks[bits_() % kTicks.size()];
    last.number[3] = in.ticks;
  }
  template <class N>
  void next(StabiliserInput<N>& in, LastInput& last) {
    vec(in.wanted_n, 10, last, 0);
    vec(in.sent_n, 10, last, 3);
    vec(in.moved_mm, 100, last, 6);
    vec(in.velocity_mm_per_s, kEnd, last, 9);
    in.ticks = 1 + static_cast<std::uint32_t>(bits_() % 3);
    const double taken_mj = number(1000);
    if constexpr (N::kIsFixed) {
      in.taken_mj = static_cast<std::int64_t>(taken_mj * 4294967296.0);
    } else {
      in.taken_mj = static_cast<typename N::Energy>(taken_mj);
    }
    in.contact = bits_() % 2 == 0;
    last.number[12] = in.ticks;
    last.number[13] = taken_mj;
  }

  /// What `last` says of a law of this kind.
  [[nodiscard]] static std::string text(LawKind kind, const LastInput& last) {
    const auto& n = last.number;
    const auto vec = [&](const char* name, std::size_t at) {
      return format("%s [%g, %g, %g]", name, n[at], n[at + 1], n[at + 2]);
    };
    switch (kind) {
      case LawKind::force:
        return vec("spring_mm", 0) + ", " + vec("velocity_mm_per_s", 3) + ", " + vec("tip_mm", 6);
      case LawKind::velocity:
        return vec("tip_mm", 0) + format(", ticks %g", n[3]);
      case LawKind::stabiliser:
        break;
    }
    return vec("wanted_n", 0) + ", " + vec("sent_n", 3) + ", " + vec("moved_mm", 6) + ", " +
           vec("velocity_mm_per_s", 9) + format(", ticks %g, taken_mj %g", n[12], n[13]);
  }

 private:
  static constexpr double kEnd = 32767;  ///< of the loop's numbers

  double number(double end) {
    const std::array<double, 5> special{0, 1.0 / 65536, -1.0 / 65536, end, -end};
    const std::uint64_t draw = bits_();
    if (draw % 3 == 0) return special[draw / 3 % special.size()];
    return end * (2 * (static_cast<double>(draw >> 11) / 9007199254740992.0) - 1);
  }
  template <class V>
  void vec(V& v, double end, LastInput& last, std::size_t at) {
    using Real = decltype(v.x);
    for (auto of : {&V::x, &V::y, &V::z}) {
      last.number[at] = number(end);
      v.*of = Real(last.number[at++]);
    }
  }
  /// Most springs are as long as a hand makes them.
  template <class V>
  void spring(V& v, LastInput& last) {
    constexpr std::array<double, 4> kLength{0.1, 1, 10, kEnd};
    vec(v, kLength[bits_() % kLength.size()], last, 0);
  }

  std::mt19937_64 bits_{18};
};

}  // namespace kerf
