// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "controller/law/force_law.hpp"
#include "controller/law/law_setting.hpp"
#include "controller/law/stabiliser.hpp"
#include "controller/law/velocity_estimator.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

enum class LawKind : std::uint8_t { force, velocity, stabiliser };

/// One law that a scene can name: all that is known of it before it is made. Static; once, and
/// before the first scene is read, it enters the list of its program.
struct LawRow {
  LawKind kind;
  std::string_view name;
  std::string_view meaning;
  std::span<const LawSetting> settings;
  const LawRow* next = nullptr;  ///< of the list
};

/// The row of a kind whose input is `In<N>`: with what makes the plan, in each bundle of numbers.
template <template <class> class In>
struct LawRowOf : LawRow {
  template <class N>
  using Make = LawPlan<In<N>, typename N::Real> (*)(const LawSetup& setup);

  Make<FixedNumbers> fixed;
  Make<FloatNumbers> float32;
  Make<DoubleNumbers> float64;
};
using ForceLawRow = LawRowOf<ForceInput>;
using VelocityEstimatorRow = LawRowOf<VelocityInput>;
using StabiliserRow = LawRowOf<StabiliserInput>;

/// The row of a class template `Law<N>`, whose `kName`, `kMeaning` and `kSettings` are the same
/// whatever N. `step` is compiled in all three.
template <template <class> class Law, template <class> class In>
[[nodiscard]] constexpr LawRowOf<In> law_row(LawKind kind) noexcept {
  using Fixed = Law<FixedNumbers>;
  static_assert(std::size(Fixed::kSettings) <= kMostLawSettings, "a law has too many settings");
  return {{kind, Fixed::kName, Fixed::kMeaning, Fixed::kSettings},
          &law_plan<Fixed, In<FixedNumbers>, FixedNumbers::Real>,
          &law_plan<Law<FloatNumbers>, In<FloatNumbers>, FloatNumbers::Real>,
          &law_plan<Law<DoubleNumbers>, In<DoubleNumbers>, DoubleNumbers::Real>};
}

/// Laws of the program's own files, the last registered first. Written before main alone.
inline constinit const LawRow* first_own_law = nullptr;

/// Enters a row into the list, at static initialisation.
struct LawRegistration {
  explicit LawRegistration(LawRow& row) noexcept {
    row.next = first_own_law;
    first_own_law = &row;
  }
};

}  // namespace kerf

// In a .cpp, at namespace scope, once: the class template `Law` can be named in a scene.
#define KERF_REGISTER_LAW(Law, Row, In, kind)                                              \
  namespace {                                                                              \
  ::kerf::Row kerf_row_of_##Law = ::kerf::law_row<Law, ::kerf::In>(::kerf::LawKind::kind); \
  const ::kerf::LawRegistration kerf_registration_of_##Law(kerf_row_of_##Law);             \
  }
#define KERF_REGISTER_FORCE_LAW(Law) KERF_REGISTER_LAW(Law, ForceLawRow, ForceInput, force)
#define KERF_REGISTER_VELOCITY_ESTIMATOR(Law) \
  KERF_REGISTER_LAW(Law, VelocityEstimatorRow, VelocityInput, velocity)
#define KERF_REGISTER_STABILISER(Law) \
  KERF_REGISTER_LAW(Law, StabiliserRow, StabiliserInput, stabiliser)
