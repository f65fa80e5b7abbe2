// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

// The interface of a law: its settings, its memory in the servo, the inputs of the three kinds, and
// the registration under a name.

namespace kerf {

/// One named number of a law, which a scene may set: the reader of scenes with its messages,
/// docs/scene-keys.md and the JSON in the segment use it. Both ends are allowed values.
struct LawSetting {
  std::string_view name;  ///< with its unit, as `stiffness_n_per_mm`
  std::string_view unit;  ///< as text; empty: a plain number
  double lo = 0, hi = 0;
  double by_default = 0;
  std::string_view meaning;
};
inline constexpr std::size_t kMostLawSettings = 8;

/// The arguments of a law's constructor, at load: its settings, and constants of the loop.
class LawSetup {
 public:
  constexpr LawSetup(double rate_hz, double tip_noise_mm, std::span<const LawSetting> settings,
                     std::span<const double> values) noexcept
      : rate_hz_(rate_hz), tip_noise_mm_(tip_noise_mm), settings_(settings), values_(values) {}

  [[nodiscard]] constexpr double rate_hz() const noexcept { return rate_hz_; }
  [[nodiscard]] constexpr double period_s() const noexcept { return 1 / rate_hz_; }
  /// Largest error of an encoder reading of the tip, at the device port.
  [[nodiscard]] constexpr double tip_noise_mm() const noexcept { return tip_noise_mm_; }
  /// The value of one of the law's settings. A name that the law does not list gives 0, and the
  /// load fails with that name.
  [[nodiscard]] constexpr double operator[](std::string_view name) const noexcept {
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      if (settings_[i].name == name) return values_[i];
    }
    unknown_ = name;
    return 0;
  }
  /// The last name that was read and is not listed; empty: none.
  [[nodiscard]] constexpr std::string_view unknown() const noexcept { return unknown_; }

 private:
  double rate_hz_, tip_noise_mm_;
  std::span<const LawSetting> settings_;
  std::span<const double> values_;
  mutable std::string_view unknown_{};
};

// The servo does not know the type of a law: its constants lie in the plan, its memory in the
// servo's state, and one function pointer calls it. No heap, no virtual call, no exception.

inline constexpr std::size_t kMostLawBytes = 1024;       ///< of a law's constants
inline constexpr std::size_t kMostLawStateBytes = 4096;  ///< of its state

/// The memory of a law between two ticks. Plain bytes in the servo's state, so a snapshot of the
/// state contains them. `begin_anew` makes the next tick start with a fresh `State{}`.
struct LawMemory {
  alignas(std::max_align_t) std::array<std::byte, kMostLawStateBytes> bytes{};
  bool begun = false;

  constexpr void begin_anew() noexcept { begun = false; }
};

/// A class that can be a law of input `In`: constants made at load from a `LawSetup`, a `State` of
/// bounded size, and one step, which is const and returns `In::Output`.
template <class Law, class In>
concept LawOf =
    std::is_trivially_copyable_v<Law> && sizeof(Law) <=
        kMostLawBytes&& std::is_trivially_copyable_v<
            typename Law::State>&& std::is_default_constructible_v<typename Law::State> &&
    sizeof(typename Law::State) <=
        kMostLawStateBytes&& std::is_constructible_v<Law, const LawSetup&>&& requires(
            const Law& law, const In& in, typename Law::State& state) {
  { law.step(in, state) }
  noexcept->std::convertible_to<typename In::Output>;
};

/// A law as the servo runs it; constant during a run.
template <class In>
struct LawPlan {
  using Output = typename In::Output;
  using Step = Output (*)(const LawPlan& plan, LawMemory& memory, const In& in) noexcept;

  Step step = nullptr;  ///< null: the scene has none
  alignas(std::max_align_t) std::array<std::byte, kMostLawBytes> law{};

  [[nodiscard]] constexpr bool given() const noexcept { return step != nullptr; }
  /// Servo thread. Only if a law is given.
  [[nodiscard]] Output operator()(LawMemory& memory, const In& in) const noexcept {
    return step(*this, memory, in);  // NOLINT(clang-analyzer-core.CallAndMessage): see above
  }
};

/// A tick of a law of class `Law`: what its plan points to.
template <class Law, class In>
requires LawOf<Law, In>
[[nodiscard]] typename In::Output law_step(const LawPlan<In>& plan, LawMemory& memory,
                                           const In& in) noexcept {
  using State = typename Law::State;
  if (!memory.begun) {
    ::new (static_cast<void*>(memory.bytes.data())) State{};
    memory.begun = true;
  }
  return std::launder(reinterpret_cast<const Law*>(plan.law.data()))
      ->step(in, *std::launder(reinterpret_cast<State*>(memory.bytes.data())));
}

/// At load: the plan of one law with these settings.
template <class Law, class In>
requires LawOf<Law, In>
[[nodiscard]] LawPlan<In> law_plan(const LawSetup& setup) {
  LawPlan<In> plan;
  ::new (static_cast<void*>(plan.law.data())) Law(setup);
  plan.step = &law_step<Law, In>;
  return plan;
}

/// The force of a force law on the hand in N, and the part of it that a spring stores and returns:
/// all of it, unless the law gives another. The energy ledger books the rest as damping. A law that
/// cannot give a force returns `failed()`, in all numbers: the fault `force_law`, motors off.
template <class Real>
struct LawForce : DeviceVec<Real> {
  DeviceVec<Real> spring_n;
  bool has_failed = false;

  constexpr LawForce(DeviceVec<Real> force_n) noexcept  // NOLINT: a law may return its force alone
      : LawForce(force_n, force_n) {}
  constexpr LawForce(DeviceVec<Real> force_n, DeviceVec<Real> of_spring_n) noexcept
      : DeviceVec<Real>(force_n), spring_n(of_spring_n) {}

  [[nodiscard]] static constexpr LawForce failed() noexcept {
    LawForce none{DeviceVec<Real>{}};
    none.has_failed = true;
    return none;
  }
};

/// Input of a force law in one tick of the swept contact. In air the spring and the normal are 0.
template <class N>
struct ForceInput {
  using Output = LawForce<typename N::Real>;

  DeviceVec<typename N::Real> tip_mm;             ///< of the hand, at the device port
  WorldVec<typename N::Real> scene_tip_mm;        ///< the same position in the scene
  DeviceVec<typename N::Real> velocity_mm_per_s;  ///< at the device port, as estimated
  /// From the hand to the proxy, which rests on the surface.
  DeviceVec<typename N::Real> spring_mm;
  DeviceVec<typename N::Unit> normal;  ///< out of the solid, of all that the tool presses on
};

/// A force law returns the force on the hand, before any limit; that of a scene that names none is
/// the virtual coupling (virtual_coupling.hpp). It runs in each tick that may send a force, and
/// begins anew after any other tick.
template <class N>
using ForceLawPlan = LawPlan<ForceInput<N>>;

/// Input of a stabiliser in a tick with a report while the motors are on; at the device port.
template <class N>
struct StabiliserInput {
  using Output = DeviceVec<typename N::Real>;

  DeviceVec<typename N::Real> wanted_n;  ///< force to send, after all limits
  DeviceVec<typename N::Real> sent_n;    ///< force that the last tick sent
  DeviceVec<typename N::Real> moved_mm;  ///< by the tip since the last report
  std::uint32_t ticks = 1;               ///< since then
  DeviceVec<typename N::Real> velocity_mm_per_s;
  /// SUM -F_sent . dx up to this tip, in mJ (fixed: 32 fraction bits): energy that the loop took
  /// from the hand; below 0 it has given more than it took.
  typename N::Energy taken_mj{};
  bool contact = false;  ///< the tool presses on something
};

/// A stabiliser returns the force to send in place of `wanted_n`. All limits of the force apply to
/// it again: peak and slope. If it returns `wanted_n` itself no bit changes. It begins anew after
/// each tick with the motors off or on hold.
template <class N>
using StabiliserPlan = LawPlan<StabiliserInput<N>>;

/// Input of a velocity estimator with each report that has a finite pose.
template <class N>
struct VelocityInput {
  using Output = DeviceVec<typename N::Real>;

  DeviceVec<typename N::Real> tip_mm;  ///< at the device port
  std::uint32_t ticks = 1;  ///< since the last one, 1 to 1000: above 1 after missing reports
  /// There was none, or the device was calibrated with it: the tip counts as at rest here before.
  bool first = false;
};

/// A velocity estimator returns the velocity of the tip in mm/s, for this tick and the following
/// ones without a report.
template <class N>
using VelocityEstimatorPlan = LawPlan<VelocityInput<N>>;

enum class LawKind : std::uint8_t { force, velocity, stabiliser };

/// One law that a scene can name, with everything known before it is constructed. Static; it is
/// registered once, before the first scene is read.
struct LawRow {
  LawKind kind;
  std::string_view name;
  std::string_view meaning;
  std::span<const LawSetting> settings;
  const LawRow* next = nullptr;  ///< of the list
};

/// The row of a kind whose input is `In<N>`, with the functions that make the plan in each bundle
/// of numbers.
template <template <class> class In>
struct LawRowOf : LawRow {
  template <class N>
  using Make = LawPlan<In<N>> (*)(const LawSetup& setup);

  Make<FixedNumbers> fixed;
  Make<DoubleNumbers> float64;
};
using ForceLawRow = LawRowOf<ForceInput>;
using VelocityEstimatorRow = LawRowOf<VelocityInput>;
using StabiliserRow = LawRowOf<StabiliserInput>;

/// The row of a class template `Law<N>`, whose `kName`, `kMeaning` and `kSettings` do not
/// depend on N. `step` is compiled for both.
template <template <class> class Law, template <class> class In>
[[nodiscard]] constexpr LawRowOf<In> law_row(LawKind kind) noexcept {
  using Fixed = Law<FixedNumbers>;
  static_assert(std::size(Fixed::kSettings) <= kMostLawSettings, "a law has too many settings");
  return {{kind, Fixed::kName, Fixed::kMeaning, Fixed::kSettings},
          &law_plan<Fixed, In<FixedNumbers>>,
          &law_plan<Law<DoubleNumbers>, In<DoubleNumbers>>};
}

/// Laws of the program's own files, the last registered first. Written only before main.
inline constinit const LawRow* first_own_law = nullptr;

/// Adds a row to the list, at static initialisation.
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
