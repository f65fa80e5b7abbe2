// SPDX-License-Identifier: Apache-2.0
#include "shared/segment/command.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace kerf {

bool is_valid(const Command& command, const CommandLimits& limits) noexcept {
  if (!std::all_of(std::begin(command.value), std::end(command.value),
                   [](double v) { return std::isfinite(v); })) {
    return false;
  }
  switch (command.kind) {
    case CommandKind::select_tool:
      return command.argument < limits.tools;
    case CommandKind::hold:
      return command.argument <= 1;
  }
  return false;
}

}  // namespace kerf
