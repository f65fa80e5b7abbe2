// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/report_tool.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <system_error>

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/posix/program.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace kerf {
namespace {

/// A file in memory, which ends with the process at the latest.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("kerf-report", MFD_CLOEXEC)) {
    if (fd_ < 0) fail();
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  void write(std::string_view text) const {
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
    throw ReportError("lab/report: no file in memory (" + std::generic_category().message(errno) +
                      "); make room");
  }
  int fd_;
};

/// Exit code of Python with these arguments and standard streams; -1: ended by a signal.
[[nodiscard]] int run_python(std::vector<std::string> words, int in, int out, int err) {
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  posix_spawn_file_actions_adddup2(&streams, in, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&streams, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&streams, err, STDERR_FILENO);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &streams, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&streams);
  if (error != 0) {
    throw ReportError("python3: " + std::generic_category().message(error) +
                      "; apt-get install python3-matplotlib");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

[[nodiscard]] std::string last_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);  // none: from the start
}

}  // namespace

std::string make_report(const std::vector<std::string>& words, std::string_view json,
                        ReportErrors errors) {
  const std::string tool = find_beside_program("lab/report/__main__.py");
  if (tool.empty()) {
    throw ReportError("lab/report: not found beside this program; install kerf again");
  }
  // -B: leaves no compiled files beside the sources.
  std::vector<std::string> arguments{"python3", "-B",
                                     std::filesystem::path(tool).parent_path().string()};
  arguments.insert(arguments.end(), words.begin(), words.end());
  const MemoryFile in;
  const MemoryFile out;
  const MemoryFile err;
  in.write(json);
  const int code = run_python(std::move(arguments), in.fd(), out.fd(),
                              errors == ReportErrors::shown ? STDERR_FILENO : err.fd());
  constexpr int kRefused = 2;  // the last line is for the user
  if (code != 0 && errors == ReportErrors::shown) {
    throw ReportError("lab/report: " + words[0] + " " + words[1] + " failed (above)");
  }
  if (code == kRefused) throw ReportError(last_line(err.text()));
  if (code != 0) {
    throw ReportError("lab/report: exit " + std::to_string(code) + " (" + last_line(err.text()) +
                      "); try another version of python3-matplotlib");
  }
  return out.text();
}

void check_can_plot() {
  static_cast<void>(make_report({"check"}, {}));
}

}  // namespace kerf
