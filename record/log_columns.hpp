// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace kerf {

/// What a column of a tick log says. Name, type and count are those of `layout_table.hpp`, in its
/// order; the compiler sees that no column is without its row here.
struct LogColumn {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number
  std::string_view meaning;
  std::string_view valid = {};  ///< when; empty: in every row
};

/// One bit of the column `flags`, or one value of a column that is a code.
struct LogCode {
  std::uint32_t value;
  std::string_view name;
  std::string_view meaning;
};

[[nodiscard]] std::span<const LogColumn> log_columns();
[[nodiscard]] std::span<const LogCode> log_flags();
[[nodiscard]] std::span<const LogCode> log_phases();
[[nodiscard]] std::span<const LogCode> log_faults();

/// docs/log.md: `./kerf record columns > docs/log.md`.
[[nodiscard]] std::string log_page();

}  // namespace kerf
