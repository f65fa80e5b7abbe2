// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf {

/// The processor's name as Linux tells it, or words that say that it tells none.
[[nodiscard]] std::string processor_name();

/// The day of a run, UTC: 2026-01-31.
[[nodiscard]] std::string today();

}  // namespace kerf
