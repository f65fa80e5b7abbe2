// SPDX-License-Identifier: Apache-2.0
#pragma once

// Your force law, velocity estimator or stabiliser: a class template over the loop's numbers, fixed
// point or double. Only programs that link it know it: `kerf_programs` in CMake makes controller,
// lab and replay with it. Elsewhere link its object files; the linker drops a registration from a
// static library. docs/own-law.md leads through it.
//
//     template <class N>
//     class Cubic {
//      public:
//       static constexpr const char* kName = "cubic";
//       static constexpr const char* kMeaning = "K d^3";
//       static constexpr std::array<kerf::LawSetting, 1> kSettings{
//           {{"stiffness_n_per_mm3", "N/mm^3", 0, 10, 0.1, "K"}}};
//       struct State {};
//       explicit Cubic(const kerf::LawSetup& setup) : k_(setup["stiffness_n_per_mm3"]) {}
//       kerf::DeviceVec<typename N::Real> step(const kerf::ForceInput<N>& in,
//                                              State&) const noexcept {
//         return in.spring_mm * (k_ * dot(in.spring_mm, in.spring_mm));
//       }
//      private:
//       typename N::Real k_;
//     };
//     KERF_REGISTER_FORCE_LAW(Cubic)
//
// `step` runs in the servo's thread, in each tick that may send a force: no exception, lock, system
// call, allocation or unbounded loop. In double a value that is not finite latches a fault, motors
// off; fixed point saturates. A force law may ask for that fault in both, by `LawForce::failed()`.

#include "controller/law/law.hpp"                    // inputs, settings, registration
#include "controller/law/registry/law_registry.hpp"  // a law by its name, for tests
#include "controller/law/virtual_coupling.hpp"       // kerf's own force law
