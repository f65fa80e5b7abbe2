// SPDX-License-Identifier: Apache-2.0
#include "standin/claim.hpp"

#include <csignal>
#include <filesystem>
#include <string>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace kerf::claim_test {

using kerf::standin::Claim;

namespace {

/// What `ask` returns in another process.
template <class Ask>
bool elsewhere(const Ask& ask) {
  const pid_t child = fork();
  if (child == 0) _exit(ask() ? 1 : 0);
  int status = 0;
  waitpid(child, &status, 0);
  return WEXITSTATUS(status) == 1;
}

}  // namespace

TEST_CASE(
    "a device that one process has is none of another, until the first gives it back or ends") {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("claim-" + std::to_string(getpid()))).string();
  Claim mine(path), other(path);
  const auto takes = [&] { return Claim(path).take(); };
  const auto sees = [&] { return Claim(path).is_with_another(); };
  CHECK_FALSE(elsewhere(sees));
  CHECK(elsewhere(takes));  // ended with it
  CHECK(mine.take());
  CHECK(mine.take());
  CHECK_FALSE(mine.is_with_another());
  CHECK(elsewhere(sees));
  CHECK_FALSE(elsewhere(takes));
  CHECK(other.is_with_another());
  CHECK_FALSE(other.take());
  mine.give_back();
  CHECK_FALSE(elsewhere(sees));
  CHECK(other.take());
  CHECK(mine.is_with_another());
  std::filesystem::remove(path);
}

TEST_CASE("where no file can be made, every process may use the device") {
  Claim claim("/nowhere/at/all");
  CHECK(claim.take());
  CHECK_FALSE(claim.is_with_another());
}

TEST_CASE("a child keeps nothing that its parent gave back, and gives back nothing of its parent") {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("forked-" + std::to_string(getpid()))).string();
  Claim mine(path), other(path);
  CHECK(mine.take());
  CHECK_FALSE(elsewhere([&] {
    mine.give_back();
    return !other.is_with_another();
  }));
  CHECK_FALSE(other.take());
  const pid_t child = fork();
  if (child == 0) {
    for (;;) pause();
  }
  mine.give_back();
  CHECK(other.take());
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  std::filesystem::remove(path);
}

}  // namespace kerf::claim_test
