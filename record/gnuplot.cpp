// SPDX-License-Identifier: Apache-2.0
#include "record/gnuplot.hpp"

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "record/record_error.hpp"
#include "shared/posix/new_file.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace kerf {
namespace {

/// Exit code of `gnuplot script`, its picture in `drawn` and its messages in `log`; throws where
/// there is no gnuplot.
[[nodiscard]] int run_gnuplot(const std::filesystem::path& script,
                              const std::filesystem::path& drawn,
                              const std::filesystem::path& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const auto redirect = [&actions](int fd, const std::filesystem::path& path) {
    posix_spawn_file_actions_addopen(&actions, fd, path.c_str(), O_WRONLY | O_CREAT, 0600);
  };
  redirect(STDOUT_FILENO, drawn);
  redirect(STDERR_FILENO, log);
  std::string program = "gnuplot";
  std::string argument = script.string();
  std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw RecordError("gnuplot: " + std::generic_category().message(error) +
                      "; apt-get install gnuplot-nox");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A private folder that goes with its owner.
class ScratchFolder {
 public:
  ScratchFolder() : path_((std::filesystem::temp_directory_path() / "kerf-plot-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) {
      throw RecordError(path_ + ": " + std::generic_category().message(errno) +
                        "; set TMPDIR to a folder that can be written");
    }
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

[[nodiscard]] std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

std::string gnuplot_svg(const std::string& script) {
  const ScratchFolder scratch;
  const std::filesystem::path drawn = scratch.path() / "plot.svg";
  const std::filesystem::path commands = scratch.path() / "plot.gp";
  const std::filesystem::path log = scratch.path() / "plot.log";
  write_new_file(commands, script);
  const int code = run_gnuplot(commands, drawn, log);
  std::string picture = text_of(drawn);
  if (code != 0 || picture.find("</svg>") == std::string::npos) {
    std::string message = text_of(log);
    for (char& c : message) c = c == '\n' ? ' ' : c;
    throw RecordError("gnuplot: exit " + std::to_string(code) + " " + message +
                      "; try another version");
  }
  return picture;
}

}  // namespace kerf
