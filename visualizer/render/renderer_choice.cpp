// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/renderer_choice.hpp"

#include <algorithm>
#include <string_view>

#include "visualizer/error.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf {

namespace {

std::vector<std::string> kinds_in(const std::string& choice) {
  std::vector<std::string> kinds;
  for (std::size_t from = 0; from <= choice.size();) {
    const std::size_t comma = std::min(choice.find(',', from), choice.size());
    kinds.push_back(choice.substr(from, comma - from));
    from = comma + 1;
  }
  return kinds;
}

std::string kind_after(const std::string& kind) {
  const std::vector<std::string_view> known = renderer_kinds();
  const auto found = std::find(known.begin(), known.end(), kind);
  return std::string(known[static_cast<std::size_t>(found - known.begin() + 1) % known.size()]);
}

}  // namespace

void check_renderers(const std::string& choice) {
  const std::vector<std::string> kinds = kinds_in(choice);
  const std::string* translucent = nullptr;
  for (const std::string& kind : kinds) {
    if (!is_translucent(kind)) continue;
    if (translucent == nullptr) translucent = &kind;
    if (kind == *translucent) continue;
    throw VisualizerError("--renderer: " + choice + ": " + *translucent + " and " + kind +
                          " do not mix where volumes intersect; take one of them for both");
  }
}

std::vector<std::string> renderer_of_each(const std::string& choice, std::size_t volumes) {
  check_renderers(choice);
  std::vector<std::string> kinds = kinds_in(choice);
  if (kinds.size() == 1) kinds.resize(volumes, kinds.front());
  if (kinds.size() == volumes) return kinds;
  throw VisualizerError("--renderer: " + choice + " is for " + std::to_string(kinds.size()) +
                        " volumes, and the scene has " + std::to_string(volumes) +
                        "; name one for all or one for each");
}

std::string with_renderer(const std::string& choice, std::size_t volumes, std::size_t volume,
                          const std::string& kind) {
  std::vector<std::string> kinds = renderer_of_each(choice, volumes);
  kinds[volume] = kind;
  std::string text;
  bool alike = true;
  for (std::string& one : kinds) {
    if (is_translucent(kind) && is_translucent(one)) one = kind;
    alike = alike && one == kinds.front();
    text += (text.empty() ? "" : ",") + one;
  }
  return alike ? kinds.front() : text;
}

std::string next_renderer(const std::string& choice) {
  return kind_after(kinds_in(choice).front());
}

std::string next_renderer(const std::string& choice, std::size_t volumes, std::size_t volume) {
  return with_renderer(choice, volumes, volume,
                       kind_after(renderer_of_each(choice, volumes)[volume]));
}

}  // namespace kerf
