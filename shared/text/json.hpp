// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace kerf {

/// Text that is no JSON, or JSON of another shape than the reader asked for.
struct JsonError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Json;

template <class T>
concept JsonNumber = std::is_arithmetic_v<T>;
template <class T>
concept JsonText =
    std::convertible_to<const T&, std::string> || std::convertible_to<const T&, std::string_view>;
template <class T>
concept JsonList = !JsonText<T> && !std::same_as<T, Json> && requires(const T& list) {
  list.begin();
  list.end();
};

/// A JSON value, for reports and for messages between programs.
///
/// Made from numbers, text, truth values, `nullptr`, `std::optional` (null if it is empty),
/// lists of these, and objects as `{{"name", value}, ...}`, which keep their order. A number that
/// is not finite is written as null, bytes that are not UTF-8 as U+FFFD. Every reader throws
/// `JsonError`.
class Json {
 public:
  struct Member;
  using List = std::vector<Json>;
  using Members = std::vector<Member>;

  // NOLINTBEGIN(google-explicit-constructor): a value of JSON is what it is made from
  Json() noexcept;
  Json(std::nullptr_t) noexcept;
  Json(std::initializer_list<Member> members);
  Json(List values);
  Json(Members members);
  template <JsonNumber T>
  Json(T value);
  template <JsonText T>
  Json(const T& text);
  template <JsonList T>
  Json(const T& values);
  template <class T>
  Json(const std::optional<T>& value);
  // NOLINTEND(google-explicit-constructor)
  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  /// Adds to a list; null becomes one.
  void push_back(Json value);
  /// The member of that name, added if there is none; null becomes an object.
  Json& operator[](std::string_view key);

  [[nodiscard]] bool contains(std::string_view key) const;
  [[nodiscard]] const Json& at(std::string_view key) const;
  [[nodiscard]] const Json& at(std::size_t index) const;
  /// Of a list.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] const Json* begin() const;
  [[nodiscard]] const Json* end() const;
  /// Of an object.
  [[nodiscard]] const Members& members() const;
  /// The object without the member of that name, if it has one.
  [[nodiscard]] Json without(std::string_view key) const;

  /// bool, a number, std::string, or std::array or std::vector of these. A whole number must be
  /// written as one, and fit.
  template <class T>
  [[nodiscard]] T get() const;
  [[nodiscard]] bool is_null() const noexcept;
  [[nodiscard]] bool is_text() const noexcept;
  /// Written with a point or an exponent.
  [[nodiscard]] bool is_fraction() const noexcept;

  /// Calls `use` with what is held: monostate, bool, a number, std::string, List or Members.
  template <class Use>
  decltype(auto) visit(const Use& use) const {
    return std::visit(use, value_);
  }

  /// Over many lines, two blanks for each level, as a file.
  [[nodiscard]] std::string document() const;
  /// One line with sorted keys: the same for the same content.
  [[nodiscard]] std::string canonical() const;

  /// Of a name that stands twice in an object it takes one value: `doubled_key` finds it.
  [[nodiscard]] static Json parse(std::string_view text);

 private:
  using Value = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string,
                             List, Members>;

  [[nodiscard]] bool truth() const;
  [[nodiscard]] double number() const;
  [[nodiscard]] std::int64_t whole(std::int64_t lowest, std::int64_t highest) const;
  [[nodiscard]] std::uint64_t natural(std::uint64_t highest) const;
  [[nodiscard]] const std::string& text() const;
  /// The values of a list; `size`: how many there must be, 0: any number.
  [[nodiscard]] const List& values(std::size_t size = 0) const;

  Value value_;
};

/// The first name that stands twice in one object of `text`; none if there is no such name, or if
/// the text is no JSON.
[[nodiscard]] std::optional<std::string> doubled_key(std::string_view text);

struct Json::Member {
  std::string key;
  mutable Json value;  ///< an initialiser list is const, and a big value shall move out of it
};

template <JsonNumber T>
Json::Json(T value) {
  if constexpr (std::same_as<T, bool>) {
    value_ = value;
  } else if constexpr (std::floating_point<T>) {
    value_ = double{value};
  } else if constexpr (std::signed_integral<T>) {
    value_ = std::int64_t{value};
  } else {
    value_ = std::uint64_t{value};
  }
}

template <JsonText T>
Json::Json(const T& text) : value_(std::string(text)) {}

template <JsonList T>
Json::Json(const T& values) : value_(List{}) {
  for (const auto& value : values) push_back(value);
}

template <class T>
Json::Json(const std::optional<T>& value) {
  if (value) *this = Json(*value);
}

template <class T>
T Json::get() const {
  if constexpr (std::same_as<T, bool>) {
    return truth();
  } else if constexpr (std::floating_point<T>) {
    return static_cast<T>(number());
  } else if constexpr (std::signed_integral<T>) {
    return static_cast<T>(whole(std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
  } else if constexpr (std::unsigned_integral<T>) {
    return static_cast<T>(natural(std::numeric_limits<T>::max()));
  } else if constexpr (std::same_as<T, std::string>) {
    return text();
  } else if constexpr (requires { std::tuple_size<T>::value; }) {
    T list{};
    auto* next = list.data();
    for (const Json& one : values(list.size())) *next++ = one.get<typename T::value_type>();
    return list;
  } else {
    T list;
    for (const Json& one : values()) list.push_back(one.get<typename T::value_type>());
    return list;
  }
}

}  // namespace kerf
