// SPDX-License-Identifier: Apache-2.0
#define TOML_IMPLEMENTATION
#include "shared/text/toml.hpp"

namespace kerf {

std::string toml_problem(const toml::parse_error& error) {
  std::string problem(error.description());
  if (problem.starts_with("Error while parsing ")) problem.erase(0, problem.find(": ") + 2);
  const auto says = [&](const char* what) { return problem.find(what) != problem.npos; };
  if (says("redefine existing")) return problem + "; leave one of the two out";
  const char* quotes = says("could not determine value type") ? ": text stands in quotes" : "";
  return problem + "; correct the TOML syntax here" + quotes;
}

}  // namespace kerf
