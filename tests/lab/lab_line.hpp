// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "lab/run/lab_command.hpp"

namespace kerf::test {

/// What `kerf-lab` returned and printed.
struct LabAnswer {
  int code;
  std::string out, err;
};

/// `kerf-lab` with the words of `line`, in this process.
inline LabAnswer lab(const std::string& line) {
  std::vector<std::string> words{"kerf-lab"};
  std::istringstream in(line);
  for (std::string word; in >> word;) words.push_back(word);
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  std::ostringstream out, err;
  const int code = run_lab(static_cast<int>(argv.size()), argv.data(), out, err);
  return {code, out.str(), err.str()};
}

/// The cases of a table in one text, `a; b; c`.
inline std::vector<std::string> cases_in(const std::string& text) {
  std::vector<std::string> cases;
  std::istringstream in(text);
  for (std::string one; std::getline(in >> std::ws, one, ';');) cases.push_back(one);
  return cases;
}

}  // namespace kerf::test
