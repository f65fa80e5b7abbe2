// SPDX-License-Identifier: Apache-2.0
#include "record/run/run_start.hpp"

#include <string>
#include <system_error>

#include "record/recording.hpp"
#include "shared/posix/atomic_file.hpp"

namespace kerf {
namespace {

std::filesystem::path new_run_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);  // of one that was killed
  make_recording_folder(folder);
  return folder;
}

}  // namespace

RunStart::RunStart(const std::string& name, const std::filesystem::path& folder, std::size_t arms)
    : folder_(new_run_folder(folder)), volumes_(name, folder_), inputs_(folder_) {
  if (arms > 1) second_inputs_.emplace(folder_, 1);
}

RunStart::~RunStart() {
  static_cast<void>(volumes_.finish());
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string RunStart::keep_inputs(const std::filesystem::path& folder, Tick last) {
  std::string problem = inputs_.keep(folder, last);
  if (problem.empty() && second_inputs_) problem = second_inputs_->keep(folder, last);
  return problem.empty() ? "" : "cannot be replayed: " + problem;
}

std::string RunStart::keep_volumes(const std::filesystem::path& folder) {
  std::error_code fault;
  const std::filesystem::path from = folder_ / kVolumesName;
  for (std::filesystem::directory_iterator file(from, fault), end; !fault && file != end;
       file.increment(fault)) {
    std::filesystem::create_directory(folder / kVolumesName, fault);
    link_file(file->path(), folder / kVolumesName / file->path().filename());
  }
  std::string lacks;
  for (const std::string& problem : volumes_.finish()) lacks += "; " + problem;
  return lacks.empty() ? "" : lacks.substr(2);
}

}  // namespace kerf
