// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/numeric/energy_source.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Components of the force of one tick, at the device port. The rest of the force that is sent
/// belongs to `EnergySource::hold`.
template <class N>
struct ForceParts {
  using Force = DeviceVec<typename N::Real>;

  bool contact =
      false;  ///< `spring` and `friction` are those of a tool with contact forces in this tick
  Force spring{}, damping{}, friction{}, cutting{};
  Force limits{}, stabiliser{};
};

/// Work at the device port since the start of the run, in mJ: + is taken from the hand.
///
/// A force is held from one tick to the next, so W += -F(n-1) . (x(n) - x(n-1)) is exact whatever
/// the hand does in between (Hannaford and Ryu 2002). The sum is their passivity observer;
/// `lowest_mj` is its minimum so far: below 0 the loop had given more energy than it had taken.
///
/// Servo thread; no heap, no branch on energies, 30 products a tick.
template <class N>
class EnergyLedger {
 public:
  using Real = typename N::Real;
  using Energy = typename N::Energy;

  /// Books the work of a tip motion `moved_mm` that took `ticks` ticks, 1 to 1000, while the motors
  /// applied `sent_n`. If reports were missing, `sent_n` is the mean force in that time.
  constexpr void move(DeviceVec<Real> sent_n, DeviceVec<Real> moved_mm,
                      std::uint32_t ticks) noexcept {
    moved_mm_ = moved_mm;
    ticks_ = ticks;
    taken_mj_ = work_of_hand<N>(sent_n, moved_mm);
    total_mj_ = sum_of_energy<N>(total_mj_, taken_mj_);
    lowest_mj_ = std::min(lowest_mj_, total_mj_);
  }

  /// Splits the work of the last `move` by the components of the force that was sent before it;
  /// `now` are those of the force that is sent next. Call it once after each `move`.
  ///
  /// The spring is booked with the mean of its forces at both ends; for a linear spring that is
  /// exactly the energy that it stores. The hold keeps the first force instead: the difference is
  /// booked as leak. Over a gap of several ticks, each component is booked as if the hand had moved
  /// uniformly and every tick had been sampled; the rest of the motors' work is booked as hold.
  constexpr void split(const ForceParts<N>& now) noexcept {
    std::array<Energy, kEnergySources> part{};
    const auto of = [&](EnergySource source) -> Energy& { return part[index(source)]; };
    of(EnergySource::damping) = work_of_hand<N>(sent_.damping, moved_mm_);
    of(EnergySource::cutting) = work_of_hand<N>(sent_.cutting, moved_mm_);
    of(EnergySource::limits) = work_of_hand<N>(sent_.limits, moved_mm_);
    of(EnergySource::stabiliser) = work_of_hand<N>(sent_.stabiliser, moved_mm_);
    const bool both = sent_.contact && now.contact;
    for (const auto& [source, then, next] :
         {Elastic{EnergySource::spring, sent_.spring, now.spring},
          Elastic{EnergySource::friction, sent_.friction, now.friction}}) {
      const Energy grown = both ? work_of_hand<N>(next - then, moved_mm_) : Energy(0);
      const Energy half = grown / Energy(2);
      of(source) = sum_of_energy<N>(work_of_hand<N>(then, moved_mm_), half);
      of(EnergySource::leak) =
          difference_of_energy<N>(of(EnergySource::leak), half / static_cast<Energy>(ticks_));
    }
    Energy rest = taken_mj_;
    for (const Energy booked : part) rest = difference_of_energy<N>(rest, booked);
    of(EnergySource::hold) = rest;
    for (std::size_t i = 0; i < kEnergySources; ++i) {
      by_source_mj_[i] = sum_of_energy<N>(by_source_mj_[i], part[i]);
    }
    moved_mm_ = {};
    taken_mj_ = {};
  }

  /// What is sent until the next report.
  constexpr void send(const ForceParts<N>& parts) noexcept { sent_ = parts; }

  [[nodiscard]] constexpr Energy total_mj() const noexcept { return total_mj_; }
  [[nodiscard]] constexpr Energy lowest_mj() const noexcept { return lowest_mj_; }
  [[nodiscard]] constexpr const std::array<Energy, kEnergySources>& by_source_mj() const noexcept {
    return by_source_mj_;
  }

 private:
  struct Elastic {
    EnergySource source;
    DeviceVec<Real> then, next;
  };
  static constexpr std::size_t index(EnergySource source) noexcept {
    return static_cast<std::size_t>(source);
  }

  Energy total_mj_{}, lowest_mj_{};
  std::array<Energy, kEnergySources> by_source_mj_{};
  ForceParts<N> sent_;
  DeviceVec<Real> moved_mm_{};  ///< not split yet, as the next two
  std::uint32_t ticks_ = 1;
  Energy taken_mj_{};
};

}  // namespace kerf
