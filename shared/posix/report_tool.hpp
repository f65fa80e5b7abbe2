// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// The Python tool of lab/report, which turns the JSON of a command into a page or a plot.

namespace kerf {

/// No Python, no matplotlib, or JSON that the tool refuses; one line.
class ReportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Where what the tool prints on standard error goes: into the message of a ReportError, or to the
/// terminal too, for a tool that measures and shows its progress.
enum class ReportErrors { kept, shown };

/// Runs `python3 lab/report WORDS...` (`lab/report/__main__.py` lists the words) with `json` as its
/// input and returns its output. The tool lies beside the program, or below share/kerf. It writes
/// no file. Takes half a second for a plot. Throws ReportError.
[[nodiscard]] std::string make_report(const std::vector<std::string>& words, std::string_view json,
                                      ReportErrors errors = ReportErrors::kept);

/// Throws ReportError if no plot can be drawn here: for a command that measures for minutes first.
void check_can_plot();

}  // namespace kerf
