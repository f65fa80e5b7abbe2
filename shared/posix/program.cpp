// SPDX-License-Identifier: Apache-2.0

#include "shared/posix/program.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/numeric/hidden_set.hpp"
#include "shared/posix/error_text.hpp"

namespace kerf {
namespace {

/// A program started without a standard descriptor would give its number to the next file, socket
/// or segment, and its messages would go there. Reading these gives nothing; writing is an error.
void keep_standard_numbers() noexcept {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // The lowest free number is this one.
    if (fcntl(number, F_GETFD) < 0) static_cast<void>(open("/dev/null", O_RDONLY));
  }
}

void check_stack() {
  rlimit stack{};
  if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kLeastStackBytes) return;
  throw std::runtime_error("stack: " + std::to_string(stack.rlim_cur >> 10) +
                           " KiB are too few; raise ulimit -s to " +
                           std::to_string(kLeastStackBytes >> 10));
}

void check_hidden_sets() {
  const std::string_view name = unknown_hidden_set();
  if (name.empty()) return;
  std::string known;
  for (const std::string_view one : kHideableSets)
    known += (known.empty() ? "" : ", ") + std::string(one);
  throw std::runtime_error("KERF_HIDE_SETS: no instruction set has the name " + std::string(name) +
                           "; there are " + known);
}

}  // namespace

int run_program(const char* program, const std::function<int()>& work) {
  keep_standard_numbers();
  umask(umask(S_IRWXG | S_IRWXO) & (S_IRWXG | S_IRWXO));  // the user keeps all rights of his own
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    check_stack();
    check_hidden_sets();
    const int code = work();
    const std::string why = stdout_error(std::cout);
    if (why.empty()) return code;
    std::cerr << program << ": " << why << '\n';
    return code == 0 ? 2 : code;
  } catch (const AlreadySaid&) {
    return 2;
  } catch (...) {
    std::cerr << program << ": " << failure_text() << '\n';
    return 2;
  }
}

std::string processor_name() {
  std::ifstream table("/proc/cpuinfo");
  for (std::string line; std::getline(table, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "a processor that does not tell its name";
}

std::string today() {
  using namespace std::chrono;
  const year_month_day day{floor<days>(system_clock::now())};
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02u-%02u", static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
  return text;
}

std::string find_beside_program(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  constexpr int kMostUp = 6;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up <= kMostUp && !folder.empty(); ++up) {
    for (const fs::path& place : {folder / name, folder / "share/kerf" / name}) {
      if (fs::exists(place, error)) return place.string();
    }
    if (folder == folder.root_path()) break;
    folder = folder.parent_path();
  }
  return {};
}

std::string find_data_file(const std::string& name) {
  std::error_code error;
  if (name.empty() || std::filesystem::exists(name, error)) return name;
  const std::string found = find_beside_program(name);
  return found.empty() ? name : found;
}

std::string find_scene_file(const std::string& name) {
  std::error_code error;
  const std::string as_named = find_data_file(name);
  if (name.empty() || std::filesystem::exists(as_named, error)) return as_named;
  for (const std::string& shipped : {"scenes/" + name, "scenes/" + name + ".toml"}) {
    const std::string found = find_beside_program(shipped);
    if (!found.empty()) return found;
  }
  return name;
}

std::string user_data_folder() {
  const char* own = std::getenv("XDG_DATA_HOME");
  if (own != nullptr && own[0] == '/') return std::string(own) + "/kerf";  // relative: not valid
  const char* home = std::getenv("HOME");
  return home != nullptr && home[0] == '/' ? std::string(home) + "/.local/share/kerf" : "";
}

}  // namespace kerf
