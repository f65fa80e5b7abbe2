// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

// Options of a program and its commands; its man page and completion.

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
class Option;
}  // namespace CLI

namespace kerf {

/// An argument that is not declared, or a value that an option does not accept: one line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One declared option or flag. Small: a handle to what the command line owns.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  /// The word for the value in --help.
  Option& shown_as(const char* word);
  /// Shows in --help what the variable holds now.
  Option& shows_default();
  Option& required();
  /// Only numbers from `lowest` to `highest`; "nan" is none.
  Option& within(double lowest, double highest);
  Option& one_of(std::vector<std::string> words);
  /// Of a list: how many values, separated by commas in one argument.
  Option& values(int fewest, int most);
  /// Of a list: any number of values, separated by commas.
  Option& split_at_commas();
  /// Of a list: one value for each time that it is given.
  Option& one_each();
  /// Of a list: every value up to the next option, as a shell's pattern gives them.
  Option& all_behind();
  Option& needs(Option other);
  Option& excludes(Option other);
  /// Taken from the environment if the arguments do not give it.
  Option& from_environment(const char* name);

  /// After parsing.
  [[nodiscard]] bool given() const;

 private:
  CLI::Option* option_;
};

/// The arguments of a program or of one of its commands. Small: a handle to what the command line
/// owns. Variables are filled while parsing and must live until then.
class Arguments {
 public:
  /// `name` without dashes takes the argument of that place. `T`: int, std::int64_t,
  /// std::uint32_t, std::uint64_t, double, std::string, std::filesystem::path, std::optional of
  /// std::uint64_t, double, string or path, or std::vector of int, double or string.
  template <class T>
  Option option(const char* name, T& value, const std::string& meaning);
  /// Takes no value; true when given.
  Option flag(const char* name, bool& value, const std::string& meaning);
  /// Has the footer that its program has so far. A program with commands needs one of them.
  Arguments command(const char* name, const char* about);
  /// The last lines of --help.
  void footer(const std::string& text);

  /// After parsing.
  [[nodiscard]] bool chosen() const;

 protected:
  explicit Arguments(CLI::App* app) : app_(app) {}

  CLI::App* app_;
};

/// The command line of a program: declare, then parse once.
class CommandLine : public Arguments {
 public:
  /// `version` is what --version prints.
  CommandLine(const std::string& about, const std::string& program, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Returns false if the arguments ask for help or version, which are then on `out`; `--man` or
  /// `--completion` alone, for the build, write the man page or the completion. Throws
  /// `UsageError`.
  [[nodiscard]] bool parse(int argc, const char* const* argv, std::ostream& out);

 private:
  std::unique_ptr<CLI::App> owned_;
};

/// An option or an argument, as the manual lists it.
struct ManualOption {
  std::vector<std::string> names;    ///< `--scene`, `-h`; of a positional argument its name alone
  std::string value;                 ///< placeholder of the value; empty: takes none
  std::vector<std::string> choices;  ///< all allowed values; empty: any
  std::string meaning;
};

/// Options and arguments of a program or of one of its commands.
struct ManualPart {
  std::string name, about, footer;
  std::vector<ManualOption> places, options;
};

struct Manual {
  ManualPart program;
  std::vector<ManualPart> commands;
  std::string version;
};

/// A page of section 1 for man.
[[nodiscard]] std::string man_page(const Manual& manual);

/// A script for bash-completion: options, commands and choices; else files.
[[nodiscard]] std::string bash_completion(const Manual& manual);

}  // namespace kerf
