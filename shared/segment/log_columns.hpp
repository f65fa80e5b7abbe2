// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace kerf {

/// Meaning of a column of a tick log, a field of `TickRecord`. Name, type and count are those of
/// `layout_table.hpp`, in its order; the compiler checks that every column has its row here.
struct LogColumn {
  std::string_view name;
  std::string_view unit;  ///< if empty, a plain number
  std::string_view meaning;
  std::string_view valid = {};  ///< condition; if empty, in every row
};

/// One bit of the column `flags`, or one value of a column that is a code.
struct LogCode {
  std::uint32_t value;
  std::string_view name;
  std::string_view meaning;
};

[[nodiscard]] std::span<const LogColumn> log_columns();
[[nodiscard]] std::span<const LogCode> log_flags();
[[nodiscard]] std::span<const LogCode> log_commands();
[[nodiscard]] std::span<const LogCode> log_phases();
[[nodiscard]] std::span<const LogCode> log_faults();

}  // namespace kerf
