// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::web {

/// The line that a reader makes of what its parser throws. Without exceptions the reader cannot
/// catch it, so absent/exceptions.cpp puts this line in its place, while this lives: one at a time.
class ParserLine {
 public:
  explicit ParserLine(std::string line);
  ~ParserLine();
  ParserLine(const ParserLine&) = delete;
  ParserLine& operator=(const ParserLine&) = delete;
};

}  // namespace kerf::web
