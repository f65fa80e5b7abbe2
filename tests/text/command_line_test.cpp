// SPDX-License-Identifier: Apache-2.0
#include "shared/text/command_line.hpp"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::command_line_test {
namespace {

/// What was parsed: "go on", what --help or --version printed, or the refusal.
std::string parse(CommandLine& line, std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "program");
  std::ostringstream out;
  try {
    return line.parse(static_cast<int>(arguments.size()), arguments.data(), out) ? "go on"
                                                                                 : out.str();
  } catch (const UsageError& error) {
    return error.what();
  }
}

/// Every kind of option, as a program declares them.
struct Program {
  CommandLine line{"Does nothing.", "kerf-nothing", "kerf-nothing 1.2"};
  int whole = 3;
  std::uint64_t natural = 0;
  std::optional<double> number;
  std::optional<std::filesystem::path> path;
  std::vector<double> triple;
  std::vector<int> cores;
  std::vector<std::string> words;
  std::string place;
  bool flag = false, other = false;
  Option given = line.option("--whole", whole, "a count").within(1, 9).shows_default();
  Program() {
    line.footer("The end.");
    line.option("--natural", natural, "a natural number").within(0, 0x1p40);
    line.option("--number", number, "a number").within(-0.5, 0.5).shown_as("X");
    line.option("--path", path, "a file");
    line.option("--triple", triple, "three").values(3, 3).within(-1, 1);
    line.option("--cores", cores, "cores").split_at_commas().within(0, 1023);
    line.option("--words", words, "words").one_of({"one", "two"}).split_at_commas();
    line.option("--place", place, "a place").from_environment("KERF_TEST_PLACE");
    Option first = line.flag("--flag", flag, "a flag").needs(given);
    line.flag("--other", other, "another").excludes(first);
  }
};

std::string parse(std::vector<const char*> arguments) {
  Program program;
  return parse(program.line, std::move(arguments));
}

}  // namespace

TEST_CASE("options fill what they were declared with") {
  Program p;
  CHECK(parse(p.line,
              {"--whole", "7", "--number=-0.25", "--path", "a/b", "--triple", "1,0,-1", "--cores",
               "0,3", "--words", "two,one", "--natural", "1099511627776", "--flag"}) == "go on");
  CHECK(p.whole == 7);
  CHECK(p.given.given());
  CHECK(p.number == -0.25);
  CHECK(p.path == "a/b");
  CHECK(p.triple == std::vector{1.0, 0.0, -1.0});
  CHECK(p.cores == std::vector{0, 3});
  CHECK(p.words == std::vector<std::string>{"two", "one"});
  CHECK(p.natural == 1'099'511'627'776);
  CHECK(p.flag);
  CHECK_FALSE(p.other);
}

TEST_CASE("an option that takes all behind it ends at the next option; another takes one value") {
  CommandLine line("Does nothing.", "kerf-nothing", "kerf-nothing 1.2");
  std::vector<std::string> files, words;
  bool flag = false;
  line.option("--files", files, "files").all_behind();
  line.option("--words", words, "words");
  line.flag("--flag", flag, "a flag");
  CHECK(parse(line, {"--files", "a", "b", "--flag"}) == "go on");
  CHECK(files == std::vector<std::string>{"a", "b"});
  CHECK(flag);
  CHECK(parse(line, {"--words", "a", "b"}) != "go on");
}

TEST_CASE("what is not given keeps what it holds") {
  Program p;
  CHECK(parse(p.line, {}) == "go on");
  CHECK(p.whole == 3);
  CHECK_FALSE(p.given.given());
  CHECK_FALSE(p.number);
  CHECK_FALSE(p.path);
}

TEST_CASE("the environment speaks where the arguments do not") {
  setenv("KERF_TEST_PLACE", "there", 1);
  Program silent, told;
  CHECK(parse(silent.line, {}) == "go on");
  CHECK(parse(told.line, {"--place", "here"}) == "go on");
  unsetenv("KERF_TEST_PLACE");
  CHECK(silent.place == "there");
  CHECK(told.place == "here");
}

TEST_CASE("help tells each option with its word, range and default; version is one line") {
  CHECK(parse({"--help"}) ==
        "Does nothing.\nUsage: kerf-nothing [OPTIONS]\n\nOptions:\n"
        "  -h,--help                   Print this help message and exit\n"
        "  --version                   Display program version information and exit\n"
        "  --whole INT:[1 - 9]=3       a count\n"
        "  --natural UINT:[0 - 1099511627776]\n"
        "                              a natural number\n"
        "  --number X:[-0.5 - 0.5]     a number\n"
        "  --path TEXT                 a file\n"
        "  --triple FLOAT:[-1 - 1] x 3 three\n"
        "  --cores INT:[0 - 1023] ...  cores\n"
        "  --words TEXT:{one,two} ...  words\n"
        "  --place TEXT (Env:KERF_TEST_PLACE)\n"
        "                              a place\n"
        "  --flag Needs: --whole Excludes: --other\n"
        "                              a flag\n"
        "  --other Excludes: --flag    another\n\n"
        "The end.\n");
  CHECK(parse({"--version"}) == "kerf-nothing 1.2\n");
}

TEST_CASE("bad input is refused in one line that names the option") {
  struct Refusal {
    std::vector<const char*> arguments;
    const char* why;
  };
  for (const auto& [arguments, why] :
       {Refusal{{"--wole", "3"}, "--wole is not known; did you mean --whole? see --help"},
        Refusal{{"surplus"}, "surplus is not expected; see --help"},
        Refusal{{"--whole", "0"}, "--whole: 0 is not a number in the range 1 to 9"},
        Refusal{{"--whole", "x"}, "--whole: x is not a number in the range 1 to 9"},
        Refusal{{"--whole", "1.5"}, "--whole: 1.5 is not a whole number"},
        Refusal{{"--whole"}, "--whole has no value; give 1; see --help"},
        Refusal{{"--whole", "1", "--whole", "2"}, "--whole has 2 values; give 1"},
        Refusal{{"--number", "nan"}, "--number: nan is not a number in the range -0.5 to 0.5"},
        Refusal{{"--triple", "1,0"}, "--triple has 2 values; give 3"},
        Refusal{{"--triple", "1,0,2"}, "--triple: 2 is not a number in the range -1 to 1"},
        Refusal{{"--words", "three"}, "--words: three is unknown; known: one, two"},
        Refusal{{"--flag"}, "--flag needs --whole; give both"},
        Refusal{{"--flag", "--whole", "1", "--other"}, "exclude each other; leave one out"},
        Refusal{{"--flag=false", "--whole", "1"},
                "--flag takes no value; leave out what follows the ="}}) {
    const std::string said = parse(arguments);
    CAPTURE(said);
    CHECK(said.find(why) != std::string::npos);
    CHECK(said.find('\n') == std::string::npos);
    CHECK(said.ends_with(" see --help"));
  }
}

TEST_CASE("a program with commands needs one, which has its own options and the same footer") {
  const auto run = [](std::vector<const char*> arguments) {
    CommandLine line("Has commands.", "kerf-commands", "1");
    line.footer("The end.");
    std::string file;
    Arguments show = line.command("show", "shows");
    show.option("FILE", file, "what is shown").required();
    Arguments hide = line.command("hide", "hides");
    int depth = 0;
    hide.option("--depth", depth, "how far");
    const std::string said = parse(line, std::move(arguments));
    if (said != "go on") return said;
    return (show.chosen() ? "show " : "") + file + (hide.chosen() ? "hide" : "");
  };
  CHECK(run({"show", "a"}) == "show a");
  CHECK(run({"hide"}) == "hide");
  CHECK(run({}).starts_with("no command is given; "));
  CHECK(run({"shew"}) == "shew is not known; did you mean show? see --help");
  CHECK(run({"show"}) == "FILE is missing; see --help");
  CHECK(run({"--zzz", "a"}) == "--zzz is not known; see --help");
  CHECK(run({"hide", "--dept", "2"}) == "--dept is not known; did you mean --depth? see --help");
  CHECK(run({"show", "a", "--depth=2"}) == "--depth is an option of hide, not of show; see --help");
  CHECK(run({"hide", "a"}) == "a is not expected; see --help");
  CHECK(run({"show", "--help"}).find("shows\nUsage: kerf-commands show [OPTIONS] FILE") == 0);
  CHECK(run({"show", "--help"}).ends_with("The end.\n"));
}

}  // namespace kerf::command_line_test
