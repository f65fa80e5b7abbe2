// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf::web {

/// What a reader that fails would say of its file. Without exceptions no caller can put that
/// before the words of a parser, so absent/exceptions.cpp does, if one throws while this lives.
class FailurePlace {
 public:
  /// The line is `place`, the parser's words in brackets, and `remedy`.
  FailurePlace(std::string place, std::string remedy);
  ~FailurePlace();
  FailurePlace(const FailurePlace&) = delete;
  FailurePlace& operator=(const FailurePlace&) = delete;
};

}  // namespace kerf::web
