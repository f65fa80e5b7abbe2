// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/transfer_file.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "shared/posix/new_file.hpp"
#include "shared/posix/unreachable.hpp"
#include "shared/text/json.hpp"
#include "shared/text/toml.hpp"
#include "shared/text/words.hpp"
#include "visualizer/error.hpp"

namespace kerf {

namespace {

[[noreturn]] void refuse(const std::string& name, std::size_t line, const std::string& problem) {
  throw VisualizerError(name + ":" + std::to_string(line) + ": " + one_line(problem));
}

TomlNode parse_file(std::string_view text, const std::string& name) {
  try {
    return parse_toml(text);
  } catch (const TomlError& error) {
    refuse(name, error.line, error.what());
  }
}

}  // namespace

Opacities parse_transfer(std::string_view text, const std::string& name) {
  const TomlNode file = parse_file(text, name);
  for (const TomlNode& entry : file.entries) {
    if (entry.key == "opacity" && entry.form == TomlNode::Form::table) continue;
    refuse(name, entry.key_line, entry.key + " is not known here; known is the table [opacity]");
  }
  Opacities opacities;
  const TomlNode* table = file.find("opacity");
  if (table == nullptr) throw VisualizerError(name + ": there is no table [opacity]; write one");
  for (const TomlNode& entry : table->entries) {
    const double opacity = entry.number().value_or(-1.0);
    if (!(opacity >= 0.0 && opacity <= 1.0)) {
      refuse(name, entry.line,
             "opacity." + entry.key + " = " + entry.shown +
                 " is no opacity; give a number from 0 to 1");
    }
    opacities[entry.key] = opacity;
  }
  return opacities;
}

Opacities read_transfer(const std::filesystem::path& file) {
  constexpr std::uintmax_t kLargest = 1 << 16;
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) {
    throw VisualizerError(file.string() + ": is a folder; name a file in it");
  }
  if (const std::string why = why_unreachable(file); !why.empty()) {
    throw VisualizerError(file.string() + why);
  }
  if (!std::filesystem::is_regular_file(file, fault)) {
    const bool there = std::filesystem::exists(file, fault);
    throw VisualizerError(file.string() + (there ? ": is no regular file" : ": no such file") +
                          "; name a transfer function, as w in the window writes it");
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
  std::vector<std::string> known;
  for (std::size_t m = 1; m < scene.materials.size(); ++m) known.push_back(scene.materials[m].name);
  for (const auto& [material, opacity] : opacities) {
    if (std::ranges::find(known, material) != known.end()) continue;
    throw VisualizerError(name + ": opacity." + one_line(material) +
                          " is no material of this scene; it has " +
                          (known.empty() ? "none" : listed(known)));
  }
}

}  // namespace kerf
