// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/lab_run.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>

#include "hil/hil_error.hpp"
#include "shared/posix/cores.hpp"

namespace kerf {
namespace {

std::string processor() {
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

template <class Work>
void guarded(const char* option, const Work& work) {
  try {
    work();
  } catch (const FileError& error) {
    throw HilError(std::string(option) + " " + error.what());
  }
}

}  // namespace

int pin_lab(int core) {
  if (core < 0) core = allowed_cores().back();
  if (pin_to_core(core) != 0) {
    throw HilError("--cpu " + std::to_string(core) + ": not a core that this process may use");
  }
  return core;
}

std::string lab_provenance() {
  return today() + ", " + processor() + ", " + "compiler " + __VERSION__ + ".";
}

LabOutput::LabOutput(const char* option, const std::string& path) : option_(option) {
  if (path.empty()) return;
  guarded(option_, [&] { file_.emplace(path); });
}

void LabOutput::write(const std::string& text) {
  if (!file_) return;
  guarded(option_, [&] {
    file_->write(text.data(), text.size());
    file_->close();
    file_->commit();
  });
}

}  // namespace kerf
