// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

#include <unistd.h>

#include "shared/text/words.hpp"

namespace kerf {

/// One line of kerf-controller on the standard error; its level has a colour on a terminal.
inline void log_line(const char* level, const char* colour, const std::string& text) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  std::fprintf(stderr, "kerf-controller: %s%s%s: %s\n", terminal ? colour : "", level,
               terminal ? "\033[m" : "", escaped(text).c_str());
}
/// One that needs no level.
inline void log_note(const std::string& text) {
  std::fprintf(stderr, "kerf-controller: %s\n", escaped(text).c_str());
}
inline void log_warning(const std::string& text) {
  log_line("warning", "\033[33m\033[1m", text);
}
inline void log_error(const std::string& text) {
  log_line("error", "\033[31m\033[1m", text);
}

}  // namespace kerf
