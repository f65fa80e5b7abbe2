// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>

namespace CLI {
class App;
}

namespace kerf::accuracy {

/// `kerf-lab accuracy`: its options, and the run.
class Command {
 public:
  /// Adds the subcommand to the program; must live as long as `app` parses.
  explicit Command(CLI::App& app);
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// After parsing.
  [[nodiscard]] bool chosen() const;
  /// Measures, tells each choice on `out`, writes the files. Throws `HilError`.
  void run(std::ostream& out) const;

 private:
  CLI::App* app_;
  std::string report_, csv_, plot_, page_;
  int core_ = -1;
};

}  // namespace kerf::accuracy
