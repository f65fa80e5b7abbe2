// SPDX-License-Identifier: Apache-2.0
// Runs all cases, with signals as a terminal's shell gives them; without those of the suite
// "network" if this process cannot reach its own machine, which it then prints.
#define DOCTEST_CONFIG_IMPLEMENT
#ifdef KERF_SANITIZED
#define DOCTEST_CONFIG_NO_POSIX_SIGNALS  // the sanitizer tells more of a crash: the line
#endif
#include <doctest/doctest.h>

#ifdef __linux__
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "shared/numeric/hidden_set.hpp"

namespace {

constexpr int kSkipped = 77;

/// Not in a network namespace whose only device, lo, is down.
bool reaches_itself() {
  const int file = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(9);  // nothing is sent
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool reached =
      connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(file);
  return reached;
}

/// Under nohup SIGHUP is ignored, in a background job of a script SIGINT and SIGQUIT, and children
/// inherit that: what is said of signals here would then be said of the caller.
void take_signals_by_default() {
  for (int number = 1; number <= SIGRTMAX; ++number) std::signal(number, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  take_signals_by_default();
  if (const std::string_view name = kerf::unknown_hidden_set(); !name.empty()) {
    std::printf("KERF_HIDE_SETS: no instruction set has the name %.*s\n",
                static_cast<int>(name.size()), name.data());
    return 2;
  }
  doctest::Context context(argc, argv);
  const auto& all = doctest::detail::getRegisteredTests();
  const auto networked = std::ranges::count_if(all, [](const doctest::detail::TestCase& one) {
    return std::string_view(one.m_test_suite) == "network";
  });
  if (networked > 0 && !reaches_itself()) {
    std::puts("skipped: no network: 127.0.0.1 cannot be reached");
    if (networked == std::ssize(all)) return kSkipped;
    context.addFilter("test-suite-exclude", "network");
  }
  return context.run();
}
#else
int main(int argc, char** argv) {
  return doctest::Context(argc, argv).run();
}
#endif
