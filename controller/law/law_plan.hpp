// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <new>
#include <type_traits>

#include "controller/law/law_setting.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

// How the servo holds a law whose type it does not know: its constants in the plan, what it
// remembers in the servo's state, one function pointer. No heap, no virtual call, no exception.

inline constexpr std::size_t kMostLawBytes = 1024;       ///< of a law's constants
inline constexpr std::size_t kMostLawStateBytes = 4096;  ///< of its state

/// What a law remembers between two ticks. Plain bytes in the servo's state, so a snapshot of that
/// has them. A law begins anew with a fresh `State{}`.
struct LawMemory {
  alignas(std::max_align_t) std::array<std::byte, kMostLawStateBytes> bytes{};
  bool begun = false;

  constexpr void begin_anew() noexcept { begun = false; }
};

/// A class that can be a law of input `In` in the numbers of `Real`: constants made at load from a
/// `LawSetup`, a `State` of bounded size, and one step, which is const.
template <class Law, class In, class Real>
concept LawOf =
    std::is_trivially_copyable_v<Law> && sizeof(Law) <=
        kMostLawBytes&& std::is_trivially_copyable_v<
            typename Law::State>&& std::is_default_constructible_v<typename Law::State> &&
    sizeof(typename Law::State) <=
        kMostLawStateBytes&& std::is_constructible_v<Law, const LawSetup&>&& requires(
            const Law& law, const In& in, typename Law::State& state) {
  { law.step(in, state) }
  noexcept->std::same_as<DeviceVec<Real>>;
};

/// A law as the servo runs it; constant during a run.
template <class In, class Real>
struct LawPlan {
  using Step = DeviceVec<Real> (*)(const LawPlan& plan, LawMemory& memory, const In& in) noexcept;

  Step step = nullptr;  ///< null: the scene names none
  alignas(std::max_align_t) std::array<std::byte, kMostLawBytes> law{};

  [[nodiscard]] constexpr bool given() const noexcept { return step != nullptr; }
  /// Servo thread. Only where a law is given.
  [[nodiscard]] DeviceVec<Real> operator()(LawMemory& memory, const In& in) const noexcept {
    return step(*this, memory, in);
  }
};

/// At load: the plan of one law with these settings.
template <class Law, class In, class Real>
requires LawOf<Law, In, Real>
[[nodiscard]] LawPlan<In, Real> law_plan(const LawSetup& setup) {
  using Plan = LawPlan<In, Real>;
  using State = typename Law::State;
  Plan plan;
  ::new (static_cast<void*>(plan.law.data())) Law(setup);
  plan.step = [](const Plan& of, LawMemory& memory, const In& in) noexcept -> DeviceVec<Real> {
    if (!memory.begun) {
      ::new (static_cast<void*>(memory.bytes.data())) State{};
      memory.begun = true;
    }
    return std::launder(reinterpret_cast<const Law*>(of.law.data()))
        ->step(in, *std::launder(reinterpret_cast<State*>(memory.bytes.data())));
  };
  return plan;
}

}  // namespace kerf
