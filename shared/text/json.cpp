// SPDX-License-Identifier: Apache-2.0
#include "shared/text/json.hpp"

#include <algorithm>
#include <set>

#include <nlohmann/json.hpp>

namespace kerf {
namespace {

using nlohmann::ordered_json;

constexpr int kMostLevels = 64;

ordered_json to_library(const Json& from, bool sorted) {
  return from.visit([sorted](const auto& held) -> ordered_json {
    using T = std::decay_t<decltype(held)>;
    if constexpr (std::same_as<T, std::monostate>) {
      return nullptr;
    } else if constexpr (std::same_as<T, Json::List>) {
      ordered_json list = ordered_json::array();
      for (const Json& value : held) list.push_back(to_library(value, sorted));
      return list;
    } else if constexpr (std::same_as<T, Json::Members>) {
      std::vector<const Json::Member*> members;
      for (const Json::Member& member : held) members.push_back(&member);
      const auto key = [](const Json::Member* member) -> auto& {
        return member->key;
      };
      if (sorted) std::ranges::sort(members, {}, key);
      ordered_json object = ordered_json::object();
      for (const auto* member : members) object[member->key] = to_library(member->value, sorted);
      return object;
    } else {
      return held;
    }
  });
}

std::string written(const ordered_json& value, int indent) {
  // A build id or a path of another encoding must not stop a report.
  return value.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

Json from_library(const ordered_json& from, int levels_left) {
  if (levels_left == 0) throw JsonError("nested too deep");
  if (from.is_boolean()) return from.get<bool>();
  if (from.is_number_unsigned()) return from.get<std::uint64_t>();
  if (from.is_number_integer()) return from.get<std::int64_t>();
  if (from.is_number()) return from.get<double>();
  if (from.is_string()) return from.get_ref<const std::string&>();
  if (from.is_null()) return nullptr;
  if (from.is_array()) {
    Json::List list;
    for (const ordered_json& value : from) list.push_back(from_library(value, levels_left - 1));
    return list;
  }
  Json::Members members;
  for (const auto& [key, value] : from.items()) {
    members.push_back({key, from_library(value, levels_left - 1)});
  }
  return members;
}

/// What `value` holds of that type, or JsonError.
template <class T>
const T& held(const auto& value, const char* what) {
  if (const T* found = std::get_if<T>(&value)) return *found;
  throw JsonError(std::string("not ") + what);
}

template <class Members>
auto find(Members& members, std::string_view key) {
  return std::ranges::find(members, key, &Json::Member::key);
}

}  // namespace

Json::Json() noexcept = default;
Json::Json(std::nullptr_t) noexcept {}
Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(const Json& other) = default;
Json& Json::operator=(Json&& other) noexcept = default;
Json::~Json() = default;

Json::Json(std::initializer_list<Member> members) : value_(Members{}) {
  auto& own = std::get<Members>(value_);
  own.reserve(members.size());
  for (const Member& member : members) own.push_back({member.key, std::move(member.value)});
}

Json::Json(List values) : value_(std::move(values)) {}
Json::Json(Members members) : value_(std::move(members)) {}

void Json::push_back(Json value) {
  if (is_null()) value_ = List{};
  if (List* list = std::get_if<List>(&value_)) return list->push_back(std::move(value));
  throw JsonError("not a list");
}

Json& Json::operator[](std::string_view key) {
  if (is_null()) value_ = Members{};
  if (auto* members = std::get_if<Members>(&value_)) {
    const auto found = find(*members, key);
    return found != members->end() ? found->value
                                   : members->emplace_back(std::string(key), Json()).value;
  }
  throw JsonError("not an object");
}

bool Json::contains(std::string_view key) const {
  return find(members(), key) != members().end();
}

const Json& Json::at(std::string_view key) const {
  const auto found = find(members(), key);
  if (found == members().end()) throw JsonError('"' + std::string(key) + "\" is missing");
  return found->value;
}

const Json& Json::at(std::size_t index) const {
  if (index >= size()) throw JsonError("no value " + std::to_string(index) + " in the list");
  return begin()[index];
}

std::size_t Json::size() const {
  return values().size();
}
const Json* Json::begin() const {
  return values().data();
}
const Json* Json::end() const {
  return begin() + size();
}

const Json::Members& Json::members() const {
  return held<Members>(value_, "an object");
}

Json Json::without(std::string_view key) const {
  Members rest;
  for (const Member& member : members()) {
    if (member.key != key) rest.push_back(member);
  }
  return rest;
}

const Json::List& Json::values(std::size_t size) const {
  const List& list = held<List>(value_, "a list");
  if (size == 0 || list.size() == size) return list;
  throw JsonError("not a list of " + std::to_string(size));
}

bool Json::truth() const {
  return held<bool>(value_, "true or false");
}

const std::string& Json::text() const {
  return held<std::string>(value_, "a text");
}

double Json::number() const {
  if (const auto* whole = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*whole);
  if (const auto* natural = std::get_if<std::uint64_t>(&value_)) {
    return static_cast<double>(*natural);
  }
  return held<double>(value_, "a number");
}

std::uint64_t Json::natural(std::uint64_t highest) const {
  const auto* negative = std::get_if<std::int64_t>(&value_);
  const bool positive = negative != nullptr && *negative >= 0;
  const std::uint64_t value = positive ? static_cast<std::uint64_t>(*negative)
                                       : held<std::uint64_t>(value_, "a whole number from 0");
  if (value > highest) throw JsonError("above " + std::to_string(highest));
  return value;
}

std::int64_t Json::whole(std::int64_t lowest, std::int64_t highest) const {
  if (std::holds_alternative<std::uint64_t>(value_)) {
    return static_cast<std::int64_t>(natural(static_cast<std::uint64_t>(highest)));
  }
  const auto value = held<std::int64_t>(value_, "a whole number");
  if (value >= lowest && value <= highest) return value;
  throw JsonError("not from " + std::to_string(lowest) + " to " + std::to_string(highest));
}

bool Json::is_null() const noexcept {
  return std::holds_alternative<std::monostate>(value_);
}
bool Json::is_text() const noexcept {
  return std::holds_alternative<std::string>(value_);
}
bool Json::is_fraction() const noexcept {
  return std::holds_alternative<double>(value_);
}

std::string Json::document() const {
  return written(to_library(*this, false), 2) + "\n";
}

std::string Json::canonical() const {
  return written(to_library(*this, true), -1);
}

Json Json::parse(std::string_view text) {
  try {
    return from_library(ordered_json::parse(text), kMostLevels);
  } catch (const ordered_json::parse_error& error) {
    throw JsonError("no JSON at character " + std::to_string(error.byte));
  } catch (const ordered_json::exception&) {
    throw JsonError("a number out of range");
  }
}

std::optional<std::string> doubled_key(std::string_view text) {
  std::optional<std::string> found;
  std::vector<std::set<std::string>> open;  // the names of each object that has not ended
  using Event = ordered_json::parse_event_t;
  const auto follow = [&](int, Event event, const ordered_json& value) {
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key && !open.back().insert(value.get<std::string>()).second && !found) {
      found = value.get<std::string>();
    }
    return true;
  };
  const ordered_json parsed = ordered_json::parse(text, follow, false);
  return parsed.is_discarded() ? std::nullopt : found;
}

}  // namespace kerf
