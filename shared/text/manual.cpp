// SPDX-License-Identifier: Apache-2.0
#include "shared/text/manual.hpp"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace kerf {
namespace {

/// Text as roff has it: a dash that may be copied, and no request at the start of a line.
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
