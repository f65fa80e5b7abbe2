// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>

namespace kerf {

/// A number a kernel may compute with: `Fixed<F>`, `float` or `double`.
///
/// Conversions are explicit, so a kernel says where it rounds.
template <class S>
concept Scalar = std::default_initializable<S> && std::totally_ordered<S> &&
    std::constructible_from<S, double> && std::constructible_from<double, S> && requires(S a, S b) {
  { a + b } -> std::same_as<S>;
  { a - b } -> std::same_as<S>;
  { a* b } -> std::same_as<S>;
  { a / b } -> std::same_as<S>;
  { -a } -> std::same_as<S>;
};

}  // namespace kerf
