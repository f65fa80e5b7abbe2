// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "shared/text/text.hpp"

namespace kerf::number_test {

TEST_CASE("the whole text must be a finite number") {
  CHECK(number_in("0.125") == 0.125);
  CHECK(number_in("-1e3") == -1000.0);
  for (const char* text : {"", "x", "1x", " 1", "1 ", "1,2", "nan", "inf", "1e999"}) {
    CAPTURE(text);
    CHECK_FALSE(number_in(text));
  }
}

}  // namespace kerf::number_test
