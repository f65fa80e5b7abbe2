// SPDX-License-Identifier: Apache-2.0
#include "lab/run/child_process.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hil/hil_error.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace kerf::sweep {

Child::Child(const std::vector<std::string>& arguments, std::filesystem::path output)
    : output_(std::move(output)) {
  const bool is_path = arguments[0].find('/') != std::string::npos;  // else found by $PATH
  if (is_path && access(arguments[0].c_str(), X_OK) != 0) {
    throw HilError(arguments[0] + ": cannot be started (" + std::generic_category().message(errno) +
                   "); build it, or install all of kerf");
  }
  // Whatever ends this program, SIGKILL too, ends the child. The signal of the kernel comes only
  // from when setpriv has asked for it, so what is started then looks whether this program still
  // runs.
  std::string tied[] = {"setpriv",
                        "--pdeathsig",
                        "TERM",
                        "--",
                        "sh",
                        "-c",
                        R"([ "$PPID" = "$0" ] && exec "$@")",
                        std::to_string(getpid())};
  std::vector<char*> argv;
  for (std::string& word : tied) argv.push_back(word.data());
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  // A group of its own: Ctrl-C reaches the sweep alone, which ends its runs. It starts without the
  // signals that this thread leaves to others.
  posix_spawnattr_t own;
  posix_spawnattr_init(&own);
  posix_spawnattr_setflags(&own, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&own, &none);
  const int error = posix_spawnp(&pid_, argv[0], &files, &own, argv.data(), environ);
  posix_spawnattr_destroy(&own);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) {
    throw HilError("setpriv: cannot be started (" + std::generic_category().message(error) +
                   "); install util-linux");
  }
}

Child::~Child() {
  signal(SIGTERM);
  constexpr int kLooks = 400;  // of 5 ms
  for (int i = 0; i < kLooks && !ended(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (ended()) return;
  signal(SIGKILL);
  waitpid(pid_, nullptr, 0);
}

std::optional<int> Child::ended() {
  int status = 0;
  if (!code_ && waitpid(pid_, &status, WNOHANG) == pid_) {
    code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return code_;
}

void Child::signal(int number) {
  if (!code_) kill(pid_, number);
}

std::string Child::last_line() const {
  std::ifstream file(output_);
  std::string line, last;
  while (std::getline(file, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

PrivateFolder::PrivateFolder(const char* name) {
  std::error_code error;
  std::string pattern =
      std::filesystem::temp_directory_path(error) / (name + std::string("-XXXXXX"));
  if (error || mkdtemp(pattern.data()) == nullptr) {
    throw HilError("TMPDIR: no folder can be made there; set it to one that can be written");
  }
  path_ = pattern;
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string program_beside(const char* name) {
  namespace fs = std::filesystem;
  const fs::path own = fs::read_symlink("/proc/self/exe");
  const std::string stem = own.filename().string();
  const std::size_t dash = stem.rfind('-');
  const std::string prefix = dash == stem.npos ? "kerf" : stem.substr(0, dash);
  const fs::path beside = own.parent_path() / (prefix + "-" + name);
  const fs::path below = own.parent_path() / prefix / (std::string("kerf-") + name);
  std::error_code ignored;
  return !fs::exists(beside, ignored) && fs::exists(below, ignored) ? below : beside;
}

}  // namespace kerf::sweep
