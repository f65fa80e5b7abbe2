// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cerrno>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "record/force_plot.hpp"
#include "record/recording.hpp"
#include "record/tick_log.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace kerf {
namespace {

/// A file in memory, which ends with the process at the latest.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("kerf-plot", MFD_CLOEXEC)) {
    if (fd_ < 0) fail();
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  void write(const std::string& text) const {
    std::size_t done = 0;
    while (done < text.size()) {
      const ssize_t bytes =
          pwrite(fd_, text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (bytes <= 0) fail();
      done += static_cast<std::size_t>(bytes);
    }
  }
  [[nodiscard]] std::string text() const {
    std::string text;
    std::array<char, 65536> part;
    for (ssize_t bytes = 0;
         (bytes = pread(fd_, part.data(), part.size(), static_cast<off_t>(text.size()))) > 0;) {
      text.append(part.data(), static_cast<std::size_t>(bytes));
    }
    return text;
  }

 private:
  [[noreturn]] static void fail() {
    throw RecordError("gnuplot: no file in memory (" + std::generic_category().message(errno) +
                      "); make room");
  }
  int fd_;
};

/// Exit code of gnuplot with `script`, its picture in `drawn` and its messages in `log`; throws
/// without gnuplot.
[[nodiscard]] int run_gnuplot(const MemoryFile& script, const MemoryFile& drawn,
                              const MemoryFile& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, script.fd(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, drawn.fd(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, log.fd(), STDERR_FILENO);
  std::string program = "gnuplot";
  std::string argument = "/dev/stdin";
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

}  // namespace

std::string gnuplot_svg(const std::string& script) {
  const MemoryFile commands;
  const MemoryFile drawn;
  const MemoryFile log;
  commands.write(script);
  const int code = run_gnuplot(commands, drawn, log);
  std::string picture = drawn.text();
  if (code != 0 || picture.find("</svg>") == std::string::npos) {
    std::string message = log.text();
    for (char& c : message) c = c == '\n' ? ' ' : c;
    throw RecordError("gnuplot: exit " + std::to_string(code) + " " + message +
                      "; try another version");
  }
  return picture;
}

}  // namespace kerf
