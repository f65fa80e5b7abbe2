// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "shared/text/json.hpp"

namespace kerf::test {

/// JSON as a test asks it: `report["faults"][0]["tick"] == 2`. What is not there, or of another
/// type than it is compared with, throws JsonError. The JSON library itself takes three seconds to
/// compile in every file that sees it.
class ReadJson : public Json {
 public:
  ReadJson() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): also each value of a list
  ReadJson(Json value) : Json(std::move(value)) {}

  [[nodiscard]] ReadJson operator[](std::string_view key) const { return at(key); }
  [[nodiscard]] ReadJson operator[](std::size_t index) const { return at(index); }
  [[nodiscard]] ReadJson back() const { return at(size() - 1); }

  /// Where there is no such member, or no object, `otherwise`.
  template <class T>
  [[nodiscard]] T value(std::string_view key, T otherwise) const {
    return is_null() || !contains(key) ? otherwise : at(key).get<T>();
  }

  friend bool operator==(const ReadJson& a, const ReadJson& b) {
    return a.canonical() == b.canonical();
  }
  friend bool operator==(const ReadJson& a, std::string_view b) {
    return a.get<std::string>() == b;
  }
  template <class T>
  requires(std::integral<T> || std::floating_point<T>) friend bool operator==(const ReadJson& a,
                                                                              T b) {
    return a.get<T>() == b;
  }

  friend std::partial_ordering operator<=>(const ReadJson& a, const ReadJson& b) {
    return a.get<double>() <=> b.get<double>();
  }
  friend std::partial_ordering operator<=>(const ReadJson& a, double b) {
    return a.get<double>() <=> b;
  }

  friend std::ostream& operator<<(std::ostream& out, const ReadJson& json) {
    return out << json.canonical();
  }
};

[[nodiscard]] inline ReadJson read_json(std::string_view text) {
  return Json::parse(text);
}

[[nodiscard]] inline ReadJson read_json_file(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return read_json(text.view());
}

}  // namespace kerf::test
