// SPDX-License-Identifier: Apache-2.0
#include "shared/text/command_line.hpp"

#include <algorithm>
#include <charconv>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <sstream>
#include <system_error>

#include <CLI/CLI.hpp>

#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

/// CLI::Range takes "nan" for a number in any range, and names the type once more.
CLI::Validator range(double lowest, double highest) {
  const auto limits = [=](const char* between) {
    std::ostringstream text;
    text.precision(15);
    text << lowest << between << highest;
    return text.str();
  };
  const auto check = [=, limits = limits(" to ")](const std::string& text) {
    const auto value = number_in(text);
    if (value && *value >= lowest && *value <= highest) return std::string();
    return text + " is not a number in the range " + limits;
  };
  return {check, "[" + limits(" - ") + "]"};
}

/// CLI::IsMember for words; as a template of the library it costs seconds to compile.
CLI::Validator member(std::vector<std::string> words) {
  std::string known;
  for (const std::string& word : words) known += (known.empty() ? "" : ",") + word;
  known = "{" + known + "}";
  const auto check = [words = std::move(words), known](const std::string& text) {
    const bool found = std::ranges::find(words, text) != words.end();
    return found ? std::string() : text + " not in " + known;
  };
  return {check, known};
}

// What an option takes from its arguments and shows of its variable. The library's own conversions
// are templates that cost a second for each type.
bool take(const std::string& text, std::string& value) {
  value = text;
  return true;
}
bool take(const std::string& text, std::filesystem::path& value) {
  value = text;
  return true;
}
bool take(const std::string& text, double& value) {
  const auto number = number_in(text);
  if (number) value = *number;
  return number.has_value();
}
template <std::integral T>
bool take(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

template <class T>
struct Taken {  // a single value
  using Value = T;
  static constexpr bool kList = false;
  static bool take_all(const CLI::results_t& given, T& value) { return take(given.front(), value); }
};
template <class T>
struct Taken<std::optional<T>> : Taken<T> {
  static bool take_all(const CLI::results_t& given, std::optional<T>& value) {
    return take(given.front(), value.emplace());
  }
};
template <class T>
struct Taken<std::vector<T>> : Taken<T> {
  static constexpr bool kList = true;
  static bool take_all(const CLI::results_t& given, std::vector<T>& values) {
    values.assign(given.size(), T());
    std::size_t next = 0;
    return std::ranges::all_of(given, [&](const auto& text) { return take(text, values[next++]); });
  }
};

template <class T>
constexpr const char* type_word() {
  if (std::unsigned_integral<T>) return "UINT";
  if (std::integral<T>) return "INT";
  return std::floating_point<T> ? "FLOAT" : "TEXT";
}

/// As --help shows a default.
std::string shown(const auto& value) {
  if constexpr (std::convertible_to<decltype(value), std::string>) {
    return value;
  } else if constexpr (requires(std::ostringstream & out) { out << value; }) {
    std::ostringstream text;
    text << value;
    return text.str();
  } else {
    return "";
  }
}

}  // namespace

Option& Option::shown_as(const char* word) {
  option_->type_name(word);
  return *this;
}
Option& Option::shows_default() {
  option_->capture_default_str();
  return *this;
}
Option& Option::required() {
  option_->required();
  return *this;
}
Option& Option::within(double lowest, double highest) {
  option_->check(range(lowest, highest));
  return *this;
}
Option& Option::one_of(std::vector<std::string> words) {
  option_->check(member(std::move(words)));
  return *this;
}
Option& Option::values(int fewest, int most) {
  option_->delimiter(',')->expected(fewest, most);
  return *this;
}
Option& Option::split_at_commas() {
  option_->delimiter(',');
  return *this;
}
Option& Option::needs(Option other) {
  option_->needs(other.option_);
  return *this;
}
Option& Option::excludes(Option other) {
  option_->excludes(other.option_);
  return *this;
}
Option& Option::from_environment(const char* name) {
  option_->envname(name);
  return *this;
}
bool Option::given() const {
  return option_->count() > 0;
}

template <class T>
Option Arguments::option(const char* name, T& value, const std::string& meaning) {
  auto* option = app_->add_option(
      name, [&value](const CLI::results_t& given) { return Taken<T>::take_all(given, value); },
      meaning, false, [&value] { return shown(value); });
  option->type_name(type_word<typename Taken<T>::Value>());
  if (Taken<T>::kList) option->expected(1, CLI::detail::expected_max_vector_size);
  return Option(option);
}
template Option Arguments::option(const char*, int&, const std::string&);
template Option Arguments::option(const char*, std::int64_t&, const std::string&);
template Option Arguments::option(const char*, std::uint32_t&, const std::string&);
template Option Arguments::option(const char*, std::uint64_t&, const std::string&);
template Option Arguments::option(const char*, double&, const std::string&);
template Option Arguments::option(const char*, std::string&, const std::string&);
template Option Arguments::option(const char*, std::filesystem::path&, const std::string&);
template Option Arguments::option(const char*, std::optional<std::uint64_t>&, const std::string&);
template Option Arguments::option(const char*, std::optional<double>&, const std::string&);
template Option Arguments::option(const char*, std::optional<std::string>&, const std::string&);
template Option Arguments::option(const char*, std::optional<std::filesystem::path>&,
                                  const std::string&);
template Option Arguments::option(const char*, std::vector<int>&, const std::string&);
template Option Arguments::option(const char*, std::vector<double>&, const std::string&);
template Option Arguments::option(const char*, std::vector<std::string>&, const std::string&);

Option Arguments::flag(const char* name, bool& value, const std::string& meaning) {
  auto* flag = app_->add_flag_callback(
      name, [&value] { value = true; }, meaning);
  return Option(flag->disable_flag_override());
}

Arguments Arguments::command(const char* name, const char* about) {
  app_->require_subcommand(1);
  return Arguments(app_->add_subcommand(name, about));
}

void Arguments::footer(const std::string& text) {
  app_->footer(text);
}

bool Arguments::chosen() const {
  return app_->parsed();
}

CommandLine::CommandLine(const std::string& about, const std::string& program,
                         const std::string& version)
    : Arguments(nullptr), owned_(std::make_unique<CLI::App>(about, program)) {
  app_ = owned_.get();
  app_->set_version_flag("--version", version);
}

CommandLine::~CommandLine() = default;

bool CommandLine::parse(int argc, const char* const* argv, std::ostream& out) {
  try {
    app_->parse(argc, argv);
    return true;
  } catch (const CLI::Success& asked) {  // --help, --version
    app_->exit(asked, out, out);
    return false;
  } catch (const CLI::RequiredError& error) {  // a misspelt command is no missing one
    const std::vector<std::string> surplus = app_->remaining();
    const CLI::ExtrasError unexpected(surplus);
    throw UsageError(one_line(surplus.empty() ? error.what() : unexpected.what()) + "; see --help");
  } catch (const CLI::ParseError& error) {
    throw UsageError(one_line(error.what()) + "; see --help");
  }
}

}  // namespace kerf
