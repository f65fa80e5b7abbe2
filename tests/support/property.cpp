// SPDX-License-Identifier: Apache-2.0
#include "tests/support/property.hpp"

#include <stdexcept>
#include <string>

#include <rapidcheck.h>

namespace kerf::test {

bool property(const std::function<void()>& check) {
  return rc::check([&check] { check(); });
}

std::int64_t random_in_range(std::int64_t low, std::int64_t high) {
  return *rc::gen::inRange(low, high);
}

std::int64_t random_of_bits(int bits) {
  switch (bits) {
    case 8:
      return *rc::gen::arbitrary<std::int8_t>();
    case 16:
      return *rc::gen::arbitrary<std::int16_t>();
    case 32:
      return *rc::gen::arbitrary<std::int32_t>();
    default:
      return *rc::gen::arbitrary<std::int64_t>();
  }
}

void discard() {
  RC_DISCARD("");
  throw std::logic_error("not reached");
}

void fail_property(const char* file, int line, const char* condition) {
  throw std::runtime_error(std::string(file) + ":" + std::to_string(line) + ": " + condition);
}

}  // namespace kerf::test
