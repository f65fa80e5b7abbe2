// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

/// Tests of a property on random inputs, by RapidCheck, which also looks for the smallest input
/// that fails. Only property.cpp includes its headers: they take longer to compile than most tests.
namespace kerf::test {

/// Whether `check` passes on 100 random inputs, small ones first. Prints the smallest that fails.
[[nodiscard]] bool property(const std::function<void()>& check);

// For use within a property.

/// A number in [low, high).
[[nodiscard]] std::int64_t random_in_range(std::int64_t low, std::int64_t high);
template <class T>
[[nodiscard]] T in_range(T low, T high) {
  return static_cast<T>(
      random_in_range(static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
}

/// Any number of so many bits, often a small one.
[[nodiscard]] std::int64_t random_of_bits(int bits);
template <class T>
[[nodiscard]] T any() {
  return static_cast<T>(random_of_bits(8 * static_cast<int>(sizeof(T))));
}
template <>
[[nodiscard]] inline bool any<bool>() {
  return in_range(0, 2) != 0;
}

/// Leaves out this input.
[[noreturn]] void discard();
[[noreturn]] void fail_property(const char* file, int line, const char* condition);

}  // namespace kerf::test

/// Ends the property with a failure unless the condition is true.
#define HOLDS(...) \
  if (!(__VA_ARGS__)) ::kerf::test::fail_property(__FILE__, __LINE__, #__VA_ARGS__)
