// SPDX-License-Identifier: Apache-2.0
// std::random_device of g++ 12 asks Debian 12's glibc 2.36 for arc4random, which Ubuntu 22.04
// (glibc 2.35) has not. The wheel's emulator brings its own.
#include <cstdint>
#include <cstdlib>

#include <unistd.h>

extern "C" std::uint32_t arc4random() noexcept {  // NOLINT(readability-identifier-naming): glibc
  std::uint32_t number = 0;
  if (getentropy(&number, sizeof number) != 0) std::abort();
  return number;
}
