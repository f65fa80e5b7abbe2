// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace kerf {

/// Meaning of one column of a tick log, which is a field of `TickRecord`. Type and count are in
/// `layout_table.hpp`; the compiler checks that both have the same names in the same order.
struct LogColumn {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number
  std::string_view meaning;
  std::string_view valid = {};  ///< in which rows it is valid; empty: in all
};

/// One bit of the column `flags`, or one value of a column that is a code.
struct LogCode {
  std::uint32_t value;
  std::string_view name;
  std::string_view meaning;
};

[[nodiscard]] std::span<const LogColumn> log_columns();
/// The bits or codes of a column; empty if it has none.
[[nodiscard]] std::span<const LogCode> log_codes(std::string_view column);
[[nodiscard]] std::span<const LogCode> log_flags();
[[nodiscard]] std::span<const LogCode> log_commands();
[[nodiscard]] std::span<const LogCode> log_phases();
[[nodiscard]] std::span<const LogCode> log_faults();

}  // namespace kerf
