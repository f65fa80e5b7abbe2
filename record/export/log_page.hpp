// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf {

/// docs/log.md: `./kerf record columns > docs/log.md`.
[[nodiscard]] std::string log_page();

}  // namespace kerf
