// SPDX-License-Identifier: Apache-2.0
#include "lab/run/lab_run.hpp"

#include <cstdio>
#include <filesystem>
#include <ostream>
#include <utility>
#include <vector>

#include "controller/kernel/kernel_set.hpp"
#include "hil/hil_error.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

#ifdef __clang__
constexpr const char* kCompiler = "clang " __clang_version__;
#else
constexpr const char* kCompiler = "g++ " __VERSION__;
#endif

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
    throw HilError("--cpu " + std::to_string(core) +
                   ": not a core that this process may use; leave it out");
  }
  return core;
}

std::string lab_provenance() {
  return today() + ", " + processor_name() + ", " + kCompiler +
         " " KERF_FLAGS " (kernels of an instruction set always -O3), fastest kernels: " +
         (*kernel_sets())->name + ".";
}

std::string page_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value < 1000 ? "%.3g" : "%.0f", value);
  return text;
}

std::string page_plot(const char* option, const std::string& page, const char* ending) {
  if (page.empty()) return {};
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(page).parent_path() / "plots";
  std::error_code fault;
  fs::create_directory(folder, fault);
  if (fault) {
    throw HilError(std::string(option) + " " + page + ": its plots have no folder " +
                   folder.string() + " (" + fault.message() + "); make one or choose another page");
  }
  return folder / fs::path(page).filename().replace_extension(ending);
}

std::string page_link(const std::string& page, const std::string& plot) {
  const auto folder = std::filesystem::absolute(page).parent_path();
  return std::filesystem::absolute(plot).lexically_proximate(folder);
}

LabOutput::LabOutput(const char* option, std::string path, const char* ending)
    : option_(option), path_(std::move(path)) {
  if (path_.empty()) return;
  guarded(option_, [&] { check_new_file(path_); });
  check_outputs({}, {{option_, path_, ending}});
}

void LabOutput::write(const std::string& text) const {
  if (!path_.empty()) guarded(option_, [&] { write_new_file(path_, text); });
}

void LabOutput::write_report(const std::vector<std::string>& words, const std::string& json,
                             std::ostream& out) const {
  if (path_.empty()) return;
  write(make_report(words, json));
  if (!is_stream(path_)) out << path_ << ": written\n";
}

void LabOutput::write_part(const char* name, const std::string& text, std::ostream& out) const {
  if (path_.empty()) return;
  guarded(option_, [&] { write_page_part(path_, name, text); });
  if (!is_stream(path_)) out << path_ << ": written\n";
}

void LabOutput::check_distinct(std::initializer_list<const LabOutput*> outputs) {
  std::vector<OutputFile> files;
  for (const LabOutput* output : outputs) files.push_back({output->option_, output->path_, {}});
  kerf::check_distinct(files);
}

}  // namespace kerf
