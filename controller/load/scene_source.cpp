// SPDX-License-Identifier: Apache-2.0
#include "controller/load/scene_source.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <system_error>

#include "controller/scene/scene_file.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr std::string_view kSource = "source";

std::filesystem::path absolute_path(const std::filesystem::path& path) {
  std::error_code fault;
  const std::filesystem::path whole = std::filesystem::absolute(path, fault).lexically_normal();
  return fault ? path : whole;
}

template <class T>
void put(Json& object, std::string_view key, const std::optional<T>& value) {
  if (value) object[key] = *value;
}

template <class T>
void take(const Json& object, std::string_view key, std::optional<T>& value) {
  if (object.contains(key)) value = object.at(key).get<T>();
}

template <class Kind, std::size_t N>
void put_word(Json& object, std::string_view key, const std::optional<Kind>& kind,
              const std::array<std::string_view, N>& words) {
  if (kind) object[key] = words[static_cast<std::size_t>(*kind)];
}

template <class Kind, std::size_t N>
void take_word(const Json& object, std::string_view key, std::optional<Kind>& kind,
               const std::array<std::string_view, N>& words) {
  if (!object.contains(key)) return;
  const auto word = std::ranges::find(words, object.at(key).get<std::string>());
  if (word == words.end()) throw JsonError(std::string(key) + ": no such word");
  kind = static_cast<Kind>(word - words.begin());
}

Json json_of(const SceneSource& source) {
  const SceneOverrides& given = source.overrides;
  Json out = {{"scene", source.path.string()}, {"text", source.text}};
  for (const KeyOverride& setting : given.settings) {
    out["settings"].push_back(setting.key + "=" + setting.value);
  }
  if (given.volume_file) {
    VolumeSpec volume;
    volume.file = given.volume_file->string();
    out["volume"] = is_phantom(volume) ? volume.file : absolute_path(*given.volume_file).string();
  }
  put(out, "spacing_mm", given.spacing_mm);
  put(out, "override_spacing_mm", given.override_spacing_mm);
  put(out, "window", given.window);
  put(out, "rate_hz", given.rate_hz);
  put_word(out, "numeric", given.numeric, kNumericWords);
  put_word(out, "device", given.personality, kPersonalityWords);
  put(out, "torque_scale", given.torque_scale);
  out["unchecked_gain"] = given.unchecked_gain;
  out["pedal"] = given.pedal;
  out["read_seconds"] = given.read_cpu_s;
  return out;
}

}  // namespace

SceneSource read_source(const std::filesystem::path& scene, const SceneOverrides& overrides) {
  return {absolute_path(scene), read_scene_text(scene), overrides};
}

LoadedScene load_scene(const SceneSource& source) {
  return load_scene(source.path, source.text, source.overrides);
}

std::string json_with_source(const std::string& canonical, const SceneSource& source) {
  Json scene = Json::parse(canonical);
  scene[kSource] = json_of(source);
  return scene.canonical();
}

SceneSource source_in(std::string_view json) {
  const Json scene = Json::parse(json);
  const Json& source = scene.at(kSource);
  SceneSource out{source.at("scene").get<std::string>(), source.at("text").get<std::string>(), {}};
  SceneOverrides& given = out.overrides;
  if (source.contains("settings")) {
    for (const Json& text : source.at("settings")) {
      given.settings.push_back(parse_setting(text.get<std::string>()));
    }
  }
  if (source.contains("volume")) given.volume_file = source.at("volume").get<std::string>();
  take(source, "spacing_mm", given.spacing_mm);
  take(source, "override_spacing_mm", given.override_spacing_mm);
  take(source, "window", given.window);
  take(source, "rate_hz", given.rate_hz);
  take_word(source, "numeric", given.numeric, kNumericWords);
  take_word(source, "device", given.personality, kPersonalityWords);
  take(source, "torque_scale", given.torque_scale);
  given.unchecked_gain = source.at("unchecked_gain").get<bool>();
  given.pedal = source.at("pedal").get<bool>();
  given.read_cpu_s = source.at("read_seconds").get<int>();
  return out;
}

std::string json_without_source(std::string_view json) {
  const Json scene = Json::parse(json);
  Json::Members rest;
  for (const Json::Member& member : scene.members()) {
    if (member.key != kSource) rest.push_back(member);
  }
  return Json(std::move(rest)).canonical();
}

}  // namespace kerf
