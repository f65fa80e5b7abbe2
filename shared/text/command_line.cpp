// SPDX-License-Identifier: Apache-2.0

#include "shared/text/command_line.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <system_error>

#include <CLI/CLI.hpp>

#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// Writes a default as `=3` with every CLI11; from 2.4 on it writes ` [3] `.
class HelpText : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text = CLI::Formatter::make_option_opts(option);
    const std::string bracketed = " [" + option->get_default_str() + "] ";
    if (const auto at = text.find(bracketed); at != std::string::npos) {
      text.replace(at, bracketed.size(), "=" + option->get_default_str());
    }
    return text;
  }
};

/// In place of CLI::Range, which accepts "nan" in any range and repeats the type.
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

/// In place of CLI::IsMember, a template that costs seconds to compile.
CLI::Validator member(std::vector<std::string> words) {
  std::string known;
  for (const std::string& word : words) known += (known.empty() ? "" : ",") + word;
  const auto check = [words = std::move(words)](const std::string& text) {
    const bool found = std::ranges::find(words, text) != words.end();
    const std::vector<std::string_view> views(words.begin(), words.end());
    return found ? std::string() : text + unknown_word(text, views);
  };
  return {check, "{" + known + "}"};
}

// Conversions of arguments to variables. Those of the library are templates that cost a second of
// compile time for each type.
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
/// Message for an empty text, which no option accepts.
constexpr const char* kEmpty = " is empty; give a value, or leave it out";
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

/// Message for a text that `take` refuses.
template <class T>
std::string not_taken() {
  if constexpr (std::unsigned_integral<T>) {
    return " is not a whole number from 0 to " + std::to_string(std::numeric_limits<T>::max());
  } else {
    return std::integral<T> ? " is not a whole number" : " is not a number";
  }
}

template <class T>
constexpr const char* type_word() {
  if (std::unsigned_integral<T>) return "UINT";
  if (std::integral<T>) return "INT";
  return std::floating_point<T> ? "FLOAT" : "TEXT";
}

/// Message for undeclared arguments: about the first option among them, else the first word.
/// `chosen`: the command, if one was given.
std::string unexpected(const CLI::App& program, const CLI::App* chosen) {
  const std::vector<std::string> extra = program.remaining(true);
  const auto option = std::ranges::find_if(extra, [](const auto& e) { return e.starts_with('-'); });
  std::string word = option != extra.end() ? *option : extra.front();
  word.resize(std::min(word.size(), word.find('=')));
  std::vector<std::string> names;
  const auto add_options = [&](const CLI::App& app) {
    for (const CLI::Option* known : app.get_options()) names.push_back(known->get_name());
  };
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    if (command != chosen && command->get_option_no_throw(word) != nullptr) {
      return word + " is an option of " + command->get_name() +
             (chosen == nullptr ? "; write it after that word" : ", not of " + chosen->get_name());
    }
    if (command == chosen) add_options(*command);
    if (chosen == nullptr) names.push_back(command->get_name());
  }
  if (option == extra.end() && (chosen != nullptr || names.empty()))
    return word + " is not expected";
  add_options(program);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string_view near = nearest(word, known);
  return word + " is not known" + (near.empty() ? "" : "; did you mean " + std::string(near) + "?");
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

/// Message for an error of the library, reworded if its own gives no remedy. A misspelt command
/// does not count as a missing one.
std::string what_is_wrong(const CLI::App& program, const CLI::ParseError& error) {
  const std::vector<CLI::App*> chosen = program.get_subcommands();
  const CLI::App& app = chosen.empty() ? program : *chosen.front();
  if (program.remaining_size(true) > 0) return unexpected(program, chosen.empty() ? nullptr : &app);
  if (chosen.empty() && program.get_require_subcommand_min() > 0) return "no command is given";
  const std::string said = error.what(), first = said.substr(0, said.find(' '));
  const std::string last = said.substr(said.rfind(' ') + 1);
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) return first + " is missing";
  if (dynamic_cast<const CLI::RequiresError*>(&error) != nullptr)
    return first + " needs " + last + "; give both";
  if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr)
    return first + " and " + last + " exclude each other; leave one out";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) == nullptr) return said;
  const std::string name = said.substr(0, said.find_first_of(": "));
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option == nullptr) return "--" + name + " takes no value; leave out what follows the =";
  const std::size_t count = option->count();
  return name + " has " + (count == 0 ? "no" : std::to_string(count)) +
         (count > 1 ? " values" : " value") + "; give " +
         std::to_string(option->get_expected_min()) +
         (option->get_expected_max() > option->get_expected_min() ? " or more" : "");
}

/// The words of `{a,b,c}`, which `member` wrote, in the type name of an option.
std::vector<std::string> choices_in(const std::string& type) {
  const std::size_t from = type.find('{'), to = type.find('}');
  std::vector<std::string> words;
  if (to == type.npos) return words;
  std::istringstream list(type.substr(from + 1, to - from - 1));
  for (std::string word; std::getline(list, word, ',');) words.push_back(word);
  return words;
}

ManualOption manual_of(const CLI::Option& option) {
  ManualOption out;
  out.meaning = option.get_description();
  out.choices = choices_in(option.get_type_name());
  if (option.get_expected_max() > 0) {
    const std::string type = option.get_type_name();
    out.value = type.substr(0, std::min(type.find(":{"), type.find(":[")));
    const std::size_t range = type.find('['), end = type.rfind(']');
    if (out.value.size() < range && end != type.npos) {  // not A[,B,C]
      out.meaning += "; in " + type.substr(range, end + 1 - range);
    }
    const std::string usual = option.get_default_str();
    if (!usual.empty()) out.meaning += " (default: " + usual + ")";
  }
  if (option.get_positional()) {
    out.names = {option.get_name()};
    return out;
  }
  for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  if (option.get_required()) out.meaning += "; needed";
  for (const CLI::Option* other : option.get_needs()) out.meaning += "; needs " + other->get_name();
  for (const CLI::Option* other : option.get_excludes())
    out.meaning += "; not with " + other->get_name();
  if (!option.get_envname().empty()) out.meaning += "; else $" + option.get_envname();
  return out;
}

ManualPart manual_of(const CLI::App& app) {
  ManualPart part{app.get_name(), app.get_description(), app.get_footer(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? part.places : part.options).push_back(manual_of(*option));
  }
  return part;
}

/// The manual of everything declared so far.
Manual manual_of(const CLI::App& program, const std::string& version) {
  Manual manual{manual_of(program), {}, version};
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    manual.commands.push_back(manual_of(*command));
  }
  return manual;
}

/// Escapes text for roff: dashes stay dashes, and no line starts a request.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '-' || c == '\\') out += '\\';
    if (c == '\\') {
      out += 'e';
      continue;
    }
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    out += c;
  }
  return out;
}

void put_options(std::ostream& out, const std::vector<ManualOption>& options) {
  for (const ManualOption& option : options) {
    out << ".TP\n";
    for (std::size_t i = 0; i < option.names.size(); ++i) {
      out << (i == 0 ? "\\fB" : ", \\fB") << roff(option.names[i]) << "\\fR";
    }
    if (!option.value.empty()) out << " \\fI" << roff(option.value) << "\\fR";
    out << '\n' << roff(option.meaning);
    for (std::size_t i = 0; i < option.choices.size(); ++i) {
      out << (i == 0 ? "; one of " : ", ") << roff(option.choices[i]);
    }
    out << '\n';
  }
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : between) + word;
  return line;
}

/// Names of options that begin with a dash, in one line.
std::string dashed(const std::vector<ManualOption>& options) {
  std::vector<std::string> names;
  for (const ManualOption& option : options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return joined(names, " ");
}

/// Cases of `COMMAND:OPTION BEFORE` that have choices; then those that take any value.
void put_values(std::ostream& out, const std::string& command, const ManualPart& part) {
  for (const ManualOption& option : part.options) {
    if (option.value.empty() && option.choices.empty()) continue;
    std::vector<std::string> patterns;
    for (const std::string& name : option.names) patterns.push_back(command + ":" + name);
    out << "    " << joined(patterns, "|") << ") ";
    if (option.choices.empty()) {
      out << "return ;;\n";
    } else {
      out << "COMPREPLY=($(compgen -W '" << joined(option.choices, " ")
          << "' -- \"$2\")) && return ;;\n";
    }
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
Option& Option::one_each() {
  option_->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return *this;
}
Option& Option::all_behind() {
  option_->allow_extra_args();
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
  const auto take_all = [name, &value](const CLI::results_t& given) {
    if (given.size() == 1 && given.front().empty())
      throw CLI::ValidationError(name + std::string(kEmpty));
    if (Taken<T>::take_all(given, value)) return true;
    throw CLI::ValidationError(
        name, CLI::detail::join(given, ",") + not_taken<typename Taken<T>::Value>());
  };
  auto* option =
      app_->add_option(name, take_all, meaning, false, [&value] { return shown(value); });
  option->type_name(type_word<typename Taken<T>::Value>());
  if (Taken<T>::kList) {
    option->expected(1, CLI::detail::expected_max_vector_size);
    option->allow_extra_args(option->get_positional());
  }
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
  owned_->formatter(std::make_shared<HelpText>());
  app_ = owned_.get();
  app_->set_version_flag("--version", version);
}

CommandLine::~CommandLine() = default;

bool CommandLine::parse(int argc, const char* const* argv, std::ostream& out) {
  const std::string_view only = argc == 2 ? argv[1] : "";
  if (only == "--man" || only == "--completion") {
    const Manual manual = manual_of(*app_, KERF_VERSION);
    out << (only == "--man" ? man_page(manual) : bash_completion(manual));
    return false;
  }
  try {
    app_->parse(argc, argv);
    return true;
  } catch (const CLI::Success& asked) {  // --help, --version
    app_->exit(asked, out, out);
    return false;
  } catch (const CLI::ParseError& error) {
    const std::string wrong = one_line(what_is_wrong(*app_, error));
    throw UsageError(wrong + (wrong.ends_with('?') ? " see --help" : "; see --help"));
  }
}

std::string man_page(const Manual& manual) {
  const ManualPart& program = manual.program;
  std::string title = program.name;
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return std::toupper(c); });
  std::ostringstream out;
  out << ".TH " << roff(title) << " 1 \"\" \"kerf " << manual.version << "\" \"kerf\"\n"
      << ".SH NAME\n"
      << roff(program.name) << " \\- " << roff(program.about) << '\n'
      << ".SH SYNOPSIS\n.B " << roff(program.name) << "\n[\\fIOPTION\\fR]...";
  if (!manual.commands.empty()) out << " \\fICOMMAND\\fR [\\fIOPTION\\fR]...";
  for (const ManualOption& place : program.places) out << " [" << roff(place.names.front()) << ']';
  out << "\n.SH OPTIONS\n";
  put_options(out, program.places);
  put_options(out, program.options);
  if (!manual.commands.empty()) out << ".SH COMMANDS\n";
  for (const ManualPart& command : manual.commands) {
    out << ".SS " << roff(command.name);
    for (const ManualOption& place : command.places) out << ' ' << roff(place.names.front());
    out << '\n' << roff(command.about) << '\n';
    put_options(out, command.places);
    put_options(out, command.options);
  }
  if (!program.footer.empty()) out << ".SH NOTES\n.nf\n" << roff(program.footer) << "\n.fi\n";
  return out.str();
}

std::string bash_completion(const Manual& manual) {
  std::string function = "_" + manual.program.name;
  std::ranges::replace(function, '-', '_');
  std::vector<std::string> names;
  for (const ManualPart& command : manual.commands) names.push_back(command.name);
  std::ostringstream out;
  out << "# " << manual.program.name << " --completion\n"
      << function << "() {  # PROGRAM WORD WORD-BEFORE\n  local command='' options='' given\n";
  if (!names.empty()) {
    out << "  for given in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    case $given in "
        << joined(names, "|") << ") command=$given && break ;; esac\n  done\n";
  }
  out << "  case $command:$3 in\n";
  put_values(out, "", manual.program);
  for (const ManualPart& command : manual.commands) put_values(out, command.name, command);
  out << "  esac\n  case $command in\n    '') options='" << dashed(manual.program.options)
      << (names.empty() ? "" : " ") << joined(names, " ") << "' ;;\n";
  for (const ManualPart& command : manual.commands) {
    out << "    " << command.name << ") options='" << dashed(command.options) << "' ;;\n";
  }
  out << "  esac\n  COMPREPLY=($(compgen -W \"$options\" -- \"$2\"))\n}\n"
      << "complete -o default -F " << function << ' ' << manual.program.name << '\n';
  return out.str();
}

}  // namespace kerf
