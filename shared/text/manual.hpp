// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace kerf {

/// An option or an argument, as a person may write it.
struct ManualOption {
  std::vector<std::string> names;  ///< `--scene`, `-h`; of an argument by its place, its name alone
  std::string value;               ///< the word that stands for it; empty: takes none
  std::vector<std::string> choices;  ///< all that it may be; empty: anything
  std::string meaning;
};

/// What a program takes, or one of its commands.
struct ManualPart {
  std::string name, about, footer;
  std::vector<ManualOption> places, options;
};

struct Manual {
  ManualPart program;
  std::vector<ManualPart> commands;
  std::string version;
};

/// As a page of section 1 for man.
[[nodiscard]] std::string man_page(const Manual& manual);

/// As a script for bash-completion: options, commands and choices; else files.
[[nodiscard]] std::string bash_completion(const Manual& manual);

}  // namespace kerf
