// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf::zwidth {

// Colours of Okabe and Ito, which differ for every kind of colour vision; cells are their light
// shades.
inline constexpr const char* kRests = "'#CFE8DC'";
inline constexpr const char* kActive = "'#F7E3A1'";
inline constexpr const char* kSwings = "'#F0B79B'";
inline constexpr const char* kNone = "'#D9D9D9'";

}  // namespace kerf::zwidth
