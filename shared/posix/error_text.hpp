// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

namespace kerf {

/// The way out of `error` of the system where there is one and only one: a limit of this machine or
/// of this user (open files, memory), links in a circle; else `usual`, what helps against every
/// other reason.
[[nodiscard]] const char* way_out_of(int error, const char* usual) noexcept;

/// In a handler, for the one place of each program that prints errors: what the exception in flight
/// says, on one line. Those of the standard library, which know of no way out, get one.
[[nodiscard]] std::string failure_text();

/// Why what was told on `out`, the standard output, is not all there, on one line. Empty: it is, or
/// its reader left early and has what it wanted.
[[nodiscard]] std::string why_untold(std::ostream& out);

/// What is told, after its name, of a place where nobody can say whether a file is there: a loop of
/// links, a folder of somebody else's. Empty: something is there, or nothing is.
[[nodiscard]] std::string why_unreachable(const std::filesystem::path& path);

}  // namespace kerf
