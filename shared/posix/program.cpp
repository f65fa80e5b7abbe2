// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/program.hpp"

#include <csignal>
#include <iostream>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/posix/failure.hpp"

namespace kerf {
namespace {

/// Started without a standard descriptor, a program would give its number to the next file, socket
/// or segment, and what it tells would go there. Reading gives nothing, and writing is an error.
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

}  // namespace

int run_program(const char* program, const std::function<int()>& work) {
  keep_standard_numbers();
  umask(S_IRWXG | S_IRWXO);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    check_stack();
    const int code = work();
    const std::string why = why_untold(std::cout);
    if (why.empty()) return code;
    std::cerr << program << ": " << why << '\n';
    return code == 0 ? 2 : code;
  } catch (...) {
    std::cerr << program << ": " << failure_text() << '\n';
    return 2;
  }
}

}  // namespace kerf
