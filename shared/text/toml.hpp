// SPDX-License-Identifier: Apache-2.0
#pragma once

/// toml++ as scenes, scripts and transfer functions use it: without exceptions, its parser compiled
/// once, in toml.cpp. Debian's 3.3.0 asserts that a table header begins with a letter of a key
/// before it has looked: `[!]` in a file would end the program. The check behind the assertion
/// reports that properly, so assertions are off here, in every build type (with NDEBUG they would
/// become assumptions).
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_HEADER_ONLY 0
#define TOML_ASSERT(expr) static_cast<void>(0)
#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include <string>

namespace kerf {

/// `problem; way out` of text that is no TOML. May hold control characters of the text.
[[nodiscard]] std::string toml_problem(const toml::parse_error& error);

}  // namespace kerf
