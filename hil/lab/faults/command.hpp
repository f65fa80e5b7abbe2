// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
}

namespace kerf::faults {

/// `kerf-lab faults`: every device, every fault script and every seed against the safety contract.
class Command {
 public:
  /// Adds the subcommand to the program; must live as long as `app` parses.
  explicit Command(CLI::App& app);
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// After parsing.
  [[nodiscard]] bool chosen() const;
  /// Runs the matrix, tells each row on `out`. Returns 1 where the contract was broken, else 0.
  /// Throws `HilError`.
  [[nodiscard]] int run(std::ostream& out) const;

 private:
  CLI::App* app_;
  std::string scene_ = "scenes/touch.toml", hand_ = "scenes/hands/touch.toml";
  std::string scripts_ = "hil/faults", report_;
  std::vector<std::string> devices_;
  unsigned seeds_ = 20;
  unsigned random_ = 1;
};

}  // namespace kerf::faults
