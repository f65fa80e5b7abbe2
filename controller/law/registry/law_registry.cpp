// SPDX-License-Identifier: Apache-2.0
#include "controller/law/registry/law_registry.hpp"

#include <algorithm>

#include "controller/law/stabilisers.hpp"
#include "controller/law/velocity_estimators.hpp"
#include "controller/law/virtual_coupling.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

// The laws that kerf brings. A new one is a header in controller/law and a row here.
constexpr ForceLawRow kCoupling = law_row<CouplingLaw, ForceInput>(LawKind::force);
constexpr VelocityEstimatorRow kFoaw = law_row<Foaw, VelocityInput>(LawKind::velocity);
constexpr VelocityEstimatorRow kDifference = law_row<Difference, VelocityInput>(LawKind::velocity);
constexpr StabiliserRow kPassivity =
    law_row<PassivityController, StabiliserInput>(LawKind::stabiliser);
constexpr StabiliserRow kEnergyBounding =
    law_row<EnergyBounding, StabiliserInput>(LawKind::stabiliser);
// Those that a scene can name.
constexpr const LawRow* kOurs[] = {&kFoaw, &kDifference, &kPassivity, &kEnergyBounding};

std::vector<std::string_view> names_of(const std::vector<const LawRow*>& rows) {
  std::vector<std::string_view> names;
  for (const LawRow* row : rows) names.push_back(row->name);
  return names;
}

/// What a scene writes for no law of this kind; empty: such a kind has always one by name.
std::string_view default_word(LawKind kind) noexcept {
  if (const LawRow* row = default_law(kind)) return row->name;
  return kind == LawKind::stabiliser ? "none" : "";
}

}  // namespace

std::string_view kind_name(LawKind kind) noexcept {
  switch (kind) {
    case LawKind::force:
      return "force law";
    case LawKind::velocity:
      return "velocity estimator";
    case LawKind::stabiliser:
      break;
  }
  return "stabiliser";
}

std::vector<const LawRow*> known_laws(LawKind kind) {
  std::vector<const LawRow*> rows(std::begin(kOurs), std::end(kOurs));
  for (const LawRow* row = first_own_law; row != nullptr; row = row->next) rows.push_back(row);
  std::erase_if(rows, [&](const LawRow* row) { return row->kind != kind; });
  std::ranges::sort(rows, {}, &LawRow::name);
  const auto twice = std::ranges::adjacent_find(rows, {}, &LawRow::name);
  if (twice != rows.end()) {
    throw std::runtime_error("two laws of this program are the " + std::string(kind_name(kind)) +
                             " \"" + std::string((*twice)->name) + "\"; give one another kName");
  }
  return rows;
}

const LawRow* default_law(LawKind kind) noexcept {
  return kind == LawKind::force ? &kCoupling : nullptr;
}

const LawRow& find_law(LawKind kind, std::string_view name) {
  const std::vector<const LawRow*> rows = known_laws(kind);
  const auto found = std::ranges::find(rows, name, &LawRow::name);
  if (found != rows.end()) return **found;
  const char* elsewhere =
      first_own_law != nullptr ? "" : "; yours is in the programs built with it (docs/own-law.md)";
  if (rows.empty()) {
    throw LawError(" is unknown: this program has no " + std::string(kind_name(kind)) + elsewhere);
  }
  throw LawError(unknown_word(name, names_of(rows), "\"") + elsewhere);
}

const LawRow* law_by_word(LawKind kind, std::string_view word) {
  const std::string_view by_default = default_word(kind);
  if (word == by_default) return nullptr;
  try {
    return &find_law(kind, word);
  } catch (const LawError& error) {
    if (by_default.empty()) throw;
    throw LawError(error.what() + ("; none: \"" + std::string(by_default) + '"'));
  }
}

std::string setting_problem(const LawRow& row, std::string_view setting, double value) {
  const auto found = std::ranges::find(row.settings, setting, &LawSetting::name);
  if (found == row.settings.end()) {
    std::vector<std::string_view> known;
    for (const LawSetting& one : row.settings) known.push_back(one.name);
    if (!known.empty()) return unknown_word(setting, known);
    return " is unknown; " + std::string(row.name) + " has no settings, leave it out";
  }
  if (value >= found->lo && value <= found->hi) return "";  // no nan is
  return " is out of range; use " + number_text(found->lo) + " to " + number_text(found->hi);
}

std::vector<double> law_values(const LawRow& row, const LawChoice& choice) {
  std::vector<double> values;
  for (const LawSetting& setting : row.settings) values.push_back(setting.by_default);
  for (const auto& [name, value] : choice.settings) {
    const std::string problem = setting_problem(row, name, value);
    if (!problem.empty()) throw LawError("." + name + " = " + number_text(value) + problem);
    const auto found = std::ranges::find(row.settings, name, &LawSetting::name);
    values[static_cast<std::size_t>(found - row.settings.begin())] = value;
  }
  return values;
}

}  // namespace kerf
