// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/library_messages.hpp"

#include <cstddef>
#include <iostream>

#include "controller/scene/scene_error.hpp"

namespace kerf::volume {

Quiet::Quiet() : cerr_(std::cerr.rdbuf(kept_.rdbuf())), cout_(std::cout.rdbuf(kept_.rdbuf())) {}

Quiet::~Quiet() {
  std::cerr.rdbuf(cerr_);
  std::cout.rdbuf(cout_);
}

void Quiet::refuse_if_missing(const std::filesystem::path& path) const {
  const std::string text = kept_.str();
  if (text.find("not read completely") != std::string::npos ||
      text.find("Incomplete Pixel Data") != std::string::npos ||
      text.find("Uncompress failed") != std::string::npos) {
    throw SceneError(path.string() + ": voxels are missing or broken; copy the file again");
  }
}

std::string last_line(const std::string& message) {
  std::istringstream lines(message);
  std::string line;
  std::string last = "no reason given";
  while (std::getline(lines, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  const std::size_t object = last.find("): ");  // "ITK ERROR: Class(0x1234): text"
  if (object != std::string::npos) last.erase(0, object + 3);
  const std::size_t biff = last.find("] ");  // "[nrrd] function: text"
  if (last.starts_with('[') && biff != std::string::npos) last.erase(0, biff + 2);
  if (last.starts_with("_nrrd") || last.starts_with("nrrd")) {  // "_nrrdReadNrrdParse_type: text"
    const std::size_t step = last.find(": ");
    if (step != std::string::npos) last.erase(0, step + 2);
  }
  return last;
}

}  // namespace kerf::volume
