// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/json.hpp"

namespace kerf::test {

/// What a guest printed (hil/guest/init): a line begins with the device that it is about.
class GuestLog {
 public:
  explicit GuestLog(std::string text) : text_(std::move(text)) {
    std::istringstream in(text_);
    for (std::string line; std::getline(in, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();  // the terminal's
      lines_.push_back(line);
    }
  }

  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

  /// The rests of the lines that begin with `words`.
  [[nodiscard]] std::vector<std::string> after(const std::string& words) const {
    std::vector<std::string> rests;
    for (const std::string& line : lines_) {
      if (line.starts_with(words + ' ')) rests.push_back(line.substr(words.size() + 1));
    }
    return rests;
  }
  /// The only such rest; empty where there is none or another one.
  [[nodiscard]] std::string only(const std::string& words) const {
    const auto rests = after(words);
    return rests.size() == 1 ? rests.front() : std::string();
  }
  /// The JSON report of a program; null where it is not there or is none.
  [[nodiscard]] ReadJson report(const std::string& device, const std::string& program) const {
    std::string text;
    for (const std::string& line : after(device + ' ' + program + " report")) text += line;
    try {
      return read_json(text);
    } catch (const JsonError&) {
      return {};
    }
  }

 private:
  std::string text_;
  std::vector<std::string> lines_;
};

/// The logs of two runs of the same guest.
[[nodiscard]] const GuestLog& first_run();
[[nodiscard]] const GuestLog& second_run();

}  // namespace kerf::test
