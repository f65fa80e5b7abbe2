// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "lab/run/lab_command.hpp"

namespace kerf::test {

/// What a program of commands returned and printed.
struct LabAnswer {
  int code;
  std::string out, err;
};

/// A program, by its function, with the words of `line`, in this process.
inline LabAnswer answer_of(decltype(run_lab)& run, const char* name, const std::string& line) {
  std::vector<std::string> words{name};
  std::istringstream in(line);
  for (std::string word; in >> word;) words.push_back(word);
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  std::ostringstream out, err;
  const int code = run(static_cast<int>(argv.size()), argv.data(), out, err);
  return {code, out.str(), err.str()};
}

/// `kerf-lab` with the words of `line`.
inline LabAnswer lab(const std::string& line) {
  return answer_of(run_lab, "kerf-lab", line);
}

/// The cases of a table in one text, `a; b; c`.
inline std::vector<std::string> cases_in(const std::string& text) {
  std::vector<std::string> cases;
  std::istringstream in(text);
  for (std::string one; std::getline(in >> std::ws, one, ';');) cases.push_back(one);
  return cases;
}

}  // namespace kerf::test
