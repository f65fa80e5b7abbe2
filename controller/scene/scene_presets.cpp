// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_presets.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "controller/input/load_error.hpp"
#include "shared/volume/material.hpp"

namespace kerf {
namespace {

constexpr std::size_t kDefaultMaterials = 4;

/// Density at half-way to the next softer tissue; the default ones first.
const std::vector<Material>& all_known() {
  static const std::vector<Material> kMaterials = {
      {.name = "none", .iso = 0.0, .machinability = 0.0, .colour = {0.0, 0.0, 0.0}},
      {.name = "enamel", .iso = 0.81, .machinability = 1.0, .colour = {0.91, 0.88, 0.80}},
      {.name = "dentin", .iso = 0.45, .machinability = 3.0, .colour = {0.80, 0.66, 0.42}},
      {.name = "pulp", .iso = 0.14, .machinability = 10.0, .colour = {0.70, 0.25, 0.22}},
      {.name = "bone", .iso = 0.40, .machinability = 4.0, .colour = {0.89, 0.83, 0.68}},
      {.name = "caries", .iso = 0.25, .machinability = 6.0, .colour = {0.42, 0.28, 0.14}},
      {.name = "amalgam", .iso = 0.90, .machinability = 2.5, .colour = {0.55, 0.56, 0.58}},
      {.name = "glass_ceramic", .iso = 0.90, .machinability = 53.0, .colour = {0.88, 0.87, 0.85}}};
  return kMaterials;
}

}  // namespace

std::vector<Material> default_materials() {
  return {all_known().begin(), all_known().begin() + kDefaultMaterials};
}

Material known_material(std::string_view name) {
  const auto known = std::find_if(all_known().begin(), all_known().end(),
                                  [&](const Material& m) { return m.name == name; });
  return known == all_known().end() ? Material{.name = std::string(name)} : *known;
}

BurLaw grit_law(Grit grit) {
  constexpr BurLaw kMedium{.speed_exponent = 0, .saturation_n = 0.98, .wear_half_n_s = 110};
  constexpr BurLaw kCoarse{.speed_exponent = 0, .wear_half_n_s = 170};
  constexpr BurLaw kSuperCoarse{.speed_exponent = 0, .wear_half_n_s = 260};
  constexpr std::array<BurLaw, kGritWords.size()> kLaws = {BurLaw{}, kMedium, kCoarse,
                                                           kSuperCoarse};
  return kLaws.at(static_cast<std::size_t>(grit));
}

Material label_material(std::size_t label, double iso) {
  return {.name = "label " + std::to_string(label), .iso = iso, .colour = label_colour(label)};
}

namespace {

struct Bur {
  BurHead head;
  double radius_mm;
};

/// "001 round 005 to 050, ..."
std::string known_heads() {
  std::string all;
  for (const BurHead& head : kBurHeads) {
    all += (all.empty() ? "" : ", ") + std::string(head.number) + " " + std::string(head.name) +
           " 005 to 0" + std::to_string(head.largest);
  }
  return all;
}

/// "001 014": three digits of the head, three of the diameter.
std::optional<Bur> parse_bur(std::string_view text) {
  if (text.size() != 7 || text[3] != ' ') return {};
  const auto head = std::ranges::find(kBurHeads, text.substr(0, 3), &BurHead::number);
  int tenths = 0;
  const auto [end, error] = std::from_chars(text.data() + 4, text.data() + 7, tenths);
  if (head == kBurHeads.end() || error != std::errc{} || end != text.data() + 7) return {};
  if (tenths < kSmallestBur || tenths > head->largest) return {};
  return Bur{*head, tenths / 20.0};
}

void spell_out(TomlNode& tool, const TomlNode& bur, const std::string& file) {
  const std::string* text = std::get_if<std::string>(&bur.value);
  if (text == nullptr || !is_usable_text(*text)) return;  // which the row of the key refuses
  const std::string where = bur.line == 0 ? ": --set" : ":" + std::to_string(bur.line) + ":";
  const std::string location = file + where + " tool.bur = " + bur.shown;
  const std::optional<Bur> known = parse_bur(*text);
  if (!known) {
    refuse(location,
           " is no bur; write its head and its diameter in tenths of a mm, such as "
           "\"001 014\"; known are " +
               known_heads());
  }
  for (const char* key : {"shape", "file", "size_vox", "radius_mm"}) {
    if (tool.find(key) != nullptr)
      refuse(location, std::string(" contradicts ") + key + "; leave one of the two out");
  }
  const auto give = [&tool, line = bur.line](const char* key, TomlValue value) {
    if (tool.find(key) != nullptr) return;
    TomlNode node;
    node.key = key;
    node.key_line = node.line = line;
    node.form = TomlNode::Form::value;
    node.shown = written(value);
    node.value = std::move(value);
    tool.entries.push_back(std::move(node));
  };
  give("name", std::string(known->head.name) + " " + text->substr(4));
  give("shape", std::string(known->head.shape));
  give("radius_mm", known->radius_mm);
  give("shaft_radius_mm", std::min(kShankRadiusMm, kNeckOfHead * known->radius_mm));
  give("shaft_length_mm", kShankOutMm);
}

}  // namespace

void spell_out_burs(TomlNode& root, const std::string& file) {
  const auto tools = std::ranges::find(root.entries, "tool", &TomlNode::key);
  if (tools == root.entries.end()) return;
  for (TomlNode& tool : tools->entries) {
    const TomlNode* bur = tool.find("bur");
    if (bur != nullptr) spell_out(tool, TomlNode(*bur), file);
  }
}

}  // namespace kerf
