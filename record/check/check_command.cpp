// SPDX-License-Identifier: Apache-2.0
#include "record/check/check_command.hpp"

#include <iostream>
#include <string>

namespace kerf {
namespace {

/// Whether the manifest is lost, unreadable or wrong.
bool has_wrong_manifest(const std::filesystem::path& folder) {
  try {
    return check_recording(folder).in_manifest;
  } catch (const RecordError&) {
    return true;
  }
}

}  // namespace

int report_problems(const CheckedRecording& checked) {
  for (const std::string& problem : checked.problems) {
    std::cerr << "kerf-record: " << problem << '\n';
  }
  return checked.problems.empty() ? 0 : 1;
}

int run_check(const std::filesystem::path& folder, bool repair) {
  static_cast<void>(TickLogReader(folder / kTickLogName));  // else there is nothing to check
  if (repair && has_wrong_manifest(folder)) {
    repair_manifest(folder);
    std::cout << (folder / kManifestName).string() << ": made anew\n";
  }
  CheckedRecording checked;
  try {
    checked = check_recording(folder, {}, CheckDepth::files);
  } catch (const RecordError& lost) {
    checked.problems.emplace_back(lost.what());
  }
  if (checked.problems.empty()) {
    std::cout << folder.string() << ": all files agree, and all checksums are right\n";
  }
  return report_problems(checked);
}

}  // namespace kerf
