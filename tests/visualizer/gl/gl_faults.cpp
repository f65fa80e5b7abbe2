// SPDX-License-Identifier: Apache-2.0
// Linked into every test program that draws: no test has to ask for it.
#include "tests/visualizer/gl/gl_faults.hpp"

#include <doctest/doctest.h>

#include "visualizer/gl/context.hpp"

namespace kerf::test {

void fail_for_gl_fault(const std::string& text) {
  FAIL_CHECK("OpenGL: " << text);
}

namespace {

[[maybe_unused]] const bool kReported = [] {
  report_gl_faults(fail_for_gl_fault);
  return true;
}();

}  // namespace
}  // namespace kerf::test
