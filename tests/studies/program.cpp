// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <ostream>

#include "shared/text/command_line.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf {

int run_studies(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CommandLine app("Checks kerf itself, at length; only in a clone.", "kerf-studies",
                  "kerf-studies " KERF_VERSION);
  app.footer("Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up.");
  const std::array commands{
      make_extremes_command(app),     make_ranges_command(app), make_bridge_command(app),
      make_two_machines_command(app), make_burs_command(app),
  };
  return run_chosen(app, commands, "kerf-studies", argc, argv, out, err);
}

}  // namespace kerf
