// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "shared/posix/new_file.hpp"

namespace kerf {

/// Keeps this process on one core, so that every figure of a run comes from it; negative: on the
/// last that it may use. Returns the core. Throws `HilError`.
int pin_lab(int core);

/// Day, processor and compiler of a run, for the page that it writes. One line.
[[nodiscard]] std::string lab_provenance();

/// A file that is opened before the measurement, so that a wrong name costs nothing. Does nothing
/// for an empty path. Throws `HilError` that names the option.
class LabOutput {
 public:
  LabOutput(const char* option, const std::string& path);
  void write(const std::string& text);

 private:
  const char* option_;
  std::optional<NewFile> file_;
};

}  // namespace kerf
