// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/transfer_file.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>

#include "shared/posix/new_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/toml.hpp"
#include "visualizer/error.hpp"

namespace kerf {

namespace {

[[noreturn]] void refuse(const std::string& name, const toml::source_region& at,
                         const std::string& problem) {
  throw VisualizerError(name + ":" + std::to_string(at.begin.line) + ": " + problem);
}

/// A key or a value as it can stand in one line.
std::string shown(std::string text) {
  constexpr std::size_t kMost = 100;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

std::string written(const toml::node& node) {
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return shown(text.str());
}

}  // namespace

Opacities parse_transfer(std::string_view text, const std::string& name) {
  const toml::parse_result parsed = toml::parse(text, name);
  if (!parsed) refuse(name, parsed.error().source(), shown(toml_problem(parsed.error())));
  for (const auto& [key, value] : parsed.table()) {
    if (key.str() == "opacity" && value.is_table()) continue;
    refuse(name, key.source(),
           shown(std::string(key.str())) + " is not known here; known is the table [opacity]");
  }
  Opacities opacities;
  const toml::table* table = parsed.table()["opacity"].as_table();
  if (table == nullptr) throw VisualizerError(name + ": there is no table [opacity]; write one");
  for (const auto& [key, value] : *table) {
    const double opacity = value.value<double>().value_or(-1.0);
    if (!(opacity >= 0.0 && opacity <= 1.0)) {
      refuse(name, value.source(),
             "opacity." + shown(std::string(key.str())) + " = " + written(value) +
                 " is no opacity; give a number from 0 to 1");
    }
    opacities[std::string(key.str())] = opacity;
  }
  return opacities;
}

Opacities read_transfer(const std::filesystem::path& file) {
  constexpr std::uintmax_t kLargest = 1 << 16;
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) {
    throw VisualizerError(file.string() + ": is a folder; name a file in it");
  }
  if (!std::filesystem::is_regular_file(file, fault)) {
    throw VisualizerError(file.string() +
                          ": no such file; name a transfer function, as w in the window writes it");
  }
  const std::uintmax_t size = std::filesystem::file_size(file, fault);
  if (fault || size > kLargest) {
    throw VisualizerError(file.string() +
                          ": no transfer function, it is larger than 64 KiB; name another file");
  }
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw VisualizerError(file.string() + ": cannot be read; check its permissions");
  return parse_transfer(text, file.string());
}

void write_transfer(const std::filesystem::path& file, const Opacities& opacities) {
  std::ostringstream text;
  text
      << "# Opacity over one voxel edge, by material: kerf-visualizer --transfer FILE\n[opacity]\n";
  for (const auto& [material, opacity] : opacities) {
    // A quoted key of TOML is a string of JSON; toml++ itself leaves quotes in keys as they are.
    text << Json(material).canonical() << " = " << opacity << "\n";
  }
  write_new_file(file, text.str());
}

void check_materials(const Opacities& opacities, const SceneView& scene, const std::string& name) {
  std::string known;
  for (std::size_t m = 1; m < scene.materials.size(); ++m) {
    known += (known.empty() ? "" : ", ") + scene.materials[m].name;
  }
  for (const auto& [material, opacity] : opacities) {
    const auto has_name = [&](const MaterialView& one) { return one.name == material; };
    if (!scene.materials.empty() &&
        std::any_of(scene.materials.begin() + 1, scene.materials.end(), has_name)) {
      continue;
    }
    throw VisualizerError(name + ": opacity." + shown(material) +
                          " is no material of this scene; it has " +
                          (known.empty() ? "none" : known));
  }
}

}  // namespace kerf
