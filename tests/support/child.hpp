// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>
#include <exception>
#include <stdexcept>
#include <type_traits>

#include <sys/wait.h>
#include <unistd.h>

namespace kerf::test {

inline constexpr int kThrown = 98;           ///< exit code of a child whose body throws
inline constexpr int kKilledBySignal = 128;  ///< plus the signal's number, as a shell reports it

/// Runs `body` in a forked process, which ends without destructors of the parent's objects. The
/// exit code is the result of `body` (0 if it returns void). Returns the process id.
template <class Body>
[[nodiscard]] pid_t start_child(const Body& body) {
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child > 0) return child;
  int code = 0;
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<const Body&>>) {
      body();
    } else {
      code = body();
    }
  } catch (const std::exception&) {
    code = kThrown;
  }
  _exit(code);
}

/// Waits for the end of a child. Returns its exit code, or kKilledBySignal plus the signal.
inline int end_of(pid_t child) {
  int status = 0;
  if (waitpid(child, &status, 0) != child) throw std::runtime_error("waitpid failed");
  return WIFEXITED(status) ? WEXITSTATUS(status) : kKilledBySignal + WTERMSIG(status);
}

/// Runs `body` in a child and waits for its end.
template <class Body>
int end_in_child(const Body& body) {
  return end_of(start_child(body));
}

}  // namespace kerf::test
