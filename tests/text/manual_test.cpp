// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include <doctest/doctest.h>

#include "shared/text/command_line.hpp"

namespace kerf::manual_test {

TEST_CASE(
    "a manual of a command line has all that was declared, and nothing that roff would obey") {
  CommandLine line("Shows things.", "kerf-show", "1");
  line.footer(".dangerous\n'line\\end");
  std::string file, kind;
  int depth = 3;
  Arguments cut = line.command("cut", "cuts it");
  cut.option("FILE", file, "what is cut").required();
  cut.option("--kind", kind, "of the cut").one_of({"fine", "rough"});
  cut.option("--depth", depth, "how far").shows_default();
  const auto told = [&](const char* option) {
    std::ostringstream out;
    const char* const argv[] = {"kerf-show", option};
    CHECK(!line.parse(2, argv, out));
    return out.str();
  };
  const auto has = [](const std::string& text, const char* part) {
    CAPTURE(part);
    CHECK(text.find(part) != std::string::npos);
  };
  const std::string page = told("--man"), script = told("--completion");
  CAPTURE(page);
  CAPTURE(script);
  has(page, "kerf\\-show \\- Shows things.");
  has(page, ".SS cut FILE\ncuts it\n");
  has(page, "\\fB\\-\\-kind\\fR \\fITEXT\\fR\nof the cut; one of fine, rough\n");
  has(page, "\\fB\\-\\-depth\\fR \\fIINT\\fR\nhow far (default: 3)\n");
  has(page, "\\&.dangerous\n\\&'line\\eend\n");
  has(script, "cut:--kind) COMPREPLY=($(compgen -W 'fine rough' -- \"$2\")) && return ;;\n");
  has(script, "cut) options='-h --help --kind --depth' ;;\n");
  has(script, "'') options='-h --help --version cut' ;;\n");
}

}  // namespace kerf::manual_test
