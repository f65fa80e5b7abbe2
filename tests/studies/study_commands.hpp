// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>

#include "lab/run/lab_command.hpp"

/// The commands of `kerf-studies`, by which kerf checks itself: long measurements with limits, and
/// the pages of docs/ that come from them. Built with the tests and not installed; what users
/// measure with is `kerf-lab`.
namespace kerf {

// One factory for each command; its class is private to its source file.
[[nodiscard]] std::unique_ptr<LabCommand> make_bridge_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_burs_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_extremes_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_ranges_command(Arguments& program);
[[nodiscard]] std::unique_ptr<LabCommand> make_two_machines_command(Arguments& program);

/// `kerf-studies`. Returns the exit code: that of the command, or 2 for bad input or set-up.
[[nodiscard]] int run_studies(int argc, const char* const* argv, std::ostream& out,
                              std::ostream& err);

}  // namespace kerf
