// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::test {

/// What every GL context of these test programs tells its faults, from before `main` on: the test
/// that is running fails, with GL's own words, and goes on.
void fail_for_gl_fault(const std::string& text);

}  // namespace kerf::test
