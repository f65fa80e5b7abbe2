// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tests/lab/lab_line.hpp"
#include "tests/studies/study_commands.hpp"

namespace kerf::test {

/// `kerf-studies` with the words of `line`, in this process.
inline LabAnswer studies(const std::string& line) {
  return answer_of(run_studies, "kerf-studies", line);
}

}  // namespace kerf::test
