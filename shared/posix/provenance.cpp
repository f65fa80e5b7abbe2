// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/provenance.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>

namespace kerf {

std::string processor_name() {
  std::ifstream table("/proc/cpuinfo");
  for (std::string line; std::getline(table, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "a processor that does not tell its name";
}

std::string today() {
  using namespace std::chrono;
  const year_month_day day{floor<days>(system_clock::now())};
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02u-%02u", static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
  return text;
}

}  // namespace kerf
