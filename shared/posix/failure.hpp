// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

namespace kerf {

/// The way out of `error` of the system where that is a limit of this machine or of this user (open
/// files, memory); else `usual`, what helps against every other reason.
[[nodiscard]] const char* way_out_of(int error, const char* usual) noexcept;

/// In a handler, for the one place of each program that prints errors: what the exception in flight
/// says, on one line. Those of the standard library, which know of no way out, get one.
[[nodiscard]] std::string failure_text();

/// The exit code of a program that has told all it has to tell on `out`: `code`, but 2 and a line
/// on `err` where that could not be written. A reader that left early has what it wanted.
[[nodiscard]] int when_told(int code, const char* program, std::ostream& out, std::ostream& err);

}  // namespace kerf
