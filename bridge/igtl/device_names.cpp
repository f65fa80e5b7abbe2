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
  const auto taken = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (std::size_t v = 0; v < segment.volumes.size(); ++v) {
    const std::string number = std::to_string(v + 1);
    std::string name = first_bytes(name_in(scene, v), kNameBytes);
    if (name.empty()) name = "volume " + number;
    if (taken(name)) name = first_bytes(name, kNameBytes - number.size() - 1) + " " + number;
    names.push_back(name);
  }
  return names;
}

}  // namespace kerf::bridge
