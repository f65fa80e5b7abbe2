// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <sstream>
#include <string>
#include <vector>

#include "hil/program/emulator_options.hpp"

namespace kerf::test {

struct EmulatorRun {
  int code = -1;
  std::string out, err;
};

/// kerf-emulator with the words of `line`, in this process.
inline EmulatorRun run_emulator(const std::string& line, const std::atomic<bool>& stop) {
  std::istringstream in("kerf-emulator " + line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  std::ostringstream out, err;
  const int code = kerf::run_emulator(static_cast<int>(argv.size()), argv.data(), stop, out, err);
  return {code, out.str(), err.str()};
}
inline EmulatorRun run_emulator(const std::string& line) {
  static const std::atomic<bool> kGoOn{false};
  return run_emulator(line, kGoOn);
}

}  // namespace kerf::test
