// SPDX-License-Identifier: Apache-2.0
#include "bridge/igtl/device_names.hpp"

#include <algorithm>
#include <cstddef>

#include "shared/text/json.hpp"

namespace kerf::bridge {
namespace {

constexpr std::size_t kNameBytes = 20;

/// The first bytes of a name that are whole characters of UTF-8.
std::string first_bytes(const std::string& name, std::size_t most) {
  if (name.size() <= most) return name;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
  return name.substr(0, end);
}

/// `name` with `ending`, cut so that it fits; with its number too where another has it.
std::string not_taken(const std::string& name, std::size_t volume, const std::string& ending,
                      const std::vector<std::string>& taken) {
  const std::string out = first_bytes(name, kNameBytes - ending.size()) + ending;
  if (std::find(taken.begin(), taken.end(), out) == taken.end()) return out;
  const std::string numbered = " " + std::to_string(volume + 1) + ending;
  return first_bytes(name, kNameBytes - numbered.size()) + numbered;
}

std::string name_in(const Json& scene, std::size_t volume) {
  try {
    return scene.at("volumes").at(volume).at("name").get<std::string>();
  } catch (const JsonError&) {
    return {};
  }
}

Json scene_of(const SegmentInfo& segment) {
  try {
    return Json::parse(segment.scene_json);
  } catch (const JsonError&) {
    return {};
  }
}

}  // namespace

std::vector<std::string> device_names(const SegmentInfo& segment) {
  const Json scene = scene_of(segment);
  std::vector<std::string> names;
  for (std::size_t v = 0; v < segment.volumes.size(); ++v) {
    std::string name = name_in(scene, v);
    if (name.empty()) name = "volume " + std::to_string(v + 1);
    names.push_back(not_taken(name, v, "", names));
  }
  return names;
}

std::vector<std::string> label_names(const std::vector<std::string>& volumes) {
  std::vector<std::string> taken = volumes, names;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    names.push_back(not_taken(volumes[v], v, " labels", taken));
    taken.push_back(names.back());
  }
  return names;
}

}  // namespace kerf::bridge
