// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

// Errors of the system and exceptions as one line each, with a remedy.

namespace kerf {

/// The remedy for an errno that has exactly one: a limit of this machine or user (open files,
/// memory), links in a circle; for any other errno, `usual`.
[[nodiscard]] const char* remedy_for(int error, const char* usual) noexcept;

/// In a handler: the message of the current exception, on one line, with a remedy added to those of
/// the standard library. For the one place of each program that prints errors.
[[nodiscard]] std::string failure_text();

/// Why `out`, the standard output, was not written completely, on one line. Empty if it was, or if
/// its reader closed it early.
[[nodiscard]] std::string stdout_error(std::ostream& out);

/// The message, to follow its name, for a path whose existence cannot be determined: a loop of
/// links, a folder without permission. Empty if it is known whether something is there.
[[nodiscard]] std::string access_error(const std::filesystem::path& path);

}  // namespace kerf
