// SPDX-License-Identifier: Apache-2.0
// What a hand gains or loses on a closed way over a solid that nobody cuts.
#include <doctest/doctest.h>

#include "lab/stability/energy_measures.hpp"

namespace kerf::closed_loops_test {

TEST_CASE("F5 through the whole servo: a closed way takes nothing but friction, and leaks") {
  for (const kerf::energy::LoopWork& row : kerf::energy::closed_loops()) {
    CAPTURE(row.model);
    CAPTURE(row.numeric);
    CHECK(row.share <= row.most_share);
    CHECK(row.leak_mj < 0);
    if (row.model.find("friction") != std::string::npos) {
      CHECK(row.friction_mj > 0.01);
    } else {
      CHECK(row.friction_mj == 0);
    }
    MESSAGE(row.model << " " << row.numeric << " share " << row.share << " friction "
                      << row.friction_mj << " leak " << row.leak_mj);
  }
}

}  // namespace kerf::closed_loops_test
