// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT
#include <cstdio>

#include <doctest/doctest.h>

#include "hil/hil_error.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

/// Skips with its reason, exit code 77, where nothing can be mounted.
int main(int argc, char** argv) {
  constexpr int kSkipped = 77;
  try {
    const kerf::test::TempFolder folder;
    const kerf::FuseMount probe(folder.path());
  } catch (const kerf::HilError& error) {
    std::printf("skipped: %s\n", error.what());
    return kSkipped;
  }
  doctest::Context context(argc, argv);
  return context.run();
}
