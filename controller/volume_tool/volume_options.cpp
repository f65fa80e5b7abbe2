// SPDX-License-Identifier: Apache-2.0
#include "controller/volume_tool/volume_options.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "shared/text/number.hpp"

namespace kerf {
namespace {

std::vector<double> numbers(const std::string& option, const std::string& text, char separator) {
  std::vector<double> values;
  std::istringstream parts(text + separator);
  for (std::string part; std::getline(parts, part, separator);) {
    const auto value = number_in(part);
    if (!value) throw SceneError(option + ": '" + part + "' is not a number; see --help");
    values.push_back(*value);
  }
  return values;
}

}  // namespace

std::array<double, 3> spacing_from(const std::string& text) {
  const std::vector<double> s = numbers("--spacing", text, ',');
  if (s.size() == 1) return {s[0], s[0], s[0]};
  if (s.size() == 3) return {s[0], s[1], s[2]};
  throw SceneError("--spacing: " + text + " has " + std::to_string(s.size()) +
                   " numbers; give one, or three as x,y,z (mm)");
}

Window window_from(const std::string& text) {
  const std::vector<double> w = numbers("--window", text, ',');
  if (w.size() != 2) {
    throw SceneError("--window: " + text + " is not a range; give lo,hi in values of the file");
  }
  if (!(w[0] < w[1])) {
    throw SceneError("--window: " + text + " is empty; give lo,hi with lo < hi");
  }
  return {w[0], w[1]};
}

VoxelGrid grid_from(const std::string& option, const std::string& text) {
  const std::vector<double> n = numbers(option, text, 'x');
  const auto whole = [](double v) { return v >= 1.0 && v <= 1e6 && v == std::floor(v); };
  if (n.size() != 3 || !std::all_of(n.begin(), n.end(), whole)) {
    throw SceneError(option + ": " + text +
                     " is not a size; give three counts such as 256x256x161");
  }
  return {static_cast<std::int32_t>(n[0]), static_cast<std::int32_t>(n[1]),
          static_cast<std::int32_t>(n[2])};
}

std::vector<std::filesystem::path> files_read(const std::filesystem::path& volume) {
  std::vector<std::filesystem::path> files{volume};
  const std::filesystem::path labels = labels_path(volume);
  std::error_code fault;
  if (exists(symlink_status(labels, fault))) files.push_back(labels);
  return files;
}

namespace {

[[noreturn]] void refuse_there(const std::filesystem::path& path) {
  throw SceneError(path.string() +
                   ": is there already; take another name, or --force to replace it");
}

}  // namespace

void refuse_replacing(const std::filesystem::path& path, bool force) {
  std::error_code fault;
  if (!force && exists(symlink_status(path, fault))) refuse_there(path);
}

void commit(NewFiles& files, bool force) {
  if (force) return files.commit();
  if (const auto there = files.commit_if_new()) refuse_there(*there);
}

}  // namespace kerf
