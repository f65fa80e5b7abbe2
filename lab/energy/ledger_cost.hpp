// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace kerf::energy {

/// Time that something adds to each tick in contact.
struct TickCostRow {
  std::string name;
  std::string numeric;
  double ns = 0;  ///< mean of the fastest of 9 rounds
};

/// Of the ledger with its observer and the split of the spring, and of each stabiliser.
[[nodiscard]] std::vector<TickCostRow> ledger_costs();

}  // namespace kerf::energy
