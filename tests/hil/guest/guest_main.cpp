// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/hil/guest/guest_log.hpp"
#include "tests/support/process.hpp"

namespace {

constexpr int kSkipped = 77;
const std::filesystem::path kFolder = KERF_GUEST_FOLDER;

std::array<std::optional<kerf::test::GuestLog>, 2> logs;

/// One run of hil/guest/guest.sh, and what it said by itself.
struct Guest {
  explicit Guest(const std::string& name, std::vector<std::string> words)
      : output(kFolder / (name + ".txt")), process(arguments(std::move(words)), output) {}

  static std::vector<std::string> arguments(std::vector<std::string> words) {
    words.insert(words.begin(), KERF_GUEST);
    return words;
  }
  /// Its exit code; all but 0 is told.
  int wait() {
    const int code = process.wait();
    if (code != 0) std::printf("%s", process.output().c_str());
    return code;
  }

  std::filesystem::path output;
  kerf::test::Process process;
};

/// Makes the image and boots it twice, side by side.
int run_guests() {
  std::filesystem::create_directories(kFolder);
  if (const int code = Guest("image", {"image", KERF_GUEST_BIN, kFolder}).wait(); code != 0) {
    return code;
  }
  const std::array<std::filesystem::path, 2> files{kFolder / "first.log", kFolder / "second.log"};
  std::array<std::unique_ptr<Guest>, 2> guests;
  for (std::size_t i = 0; i < guests.size(); ++i) {
    guests[i] =
        std::make_unique<Guest>("boot", std::vector<std::string>{"boot", kFolder, files[i]});
  }
  for (const auto& guest : guests) {
    if (const int code = guest->wait(); code != 0) return code;
  }
  for (std::size_t i = 0; i < files.size(); ++i) logs[i].emplace(kerf::test::text_of(files[i]));
  return 0;
}

}  // namespace

const kerf::test::GuestLog& kerf::test::first_run() {
  return *logs[0];
}
const kerf::test::GuestLog& kerf::test::second_run() {
  return *logs[1];
}

/// Skips with its reason, exit code 77, where QEMU, busybox or the kernel's package cannot be had.
int main(int argc, char** argv) {
  if (const int code = run_guests(); code != 0) {
    if (code != kSkipped) std::printf("hil/guest/guest.sh: exit code %d\n", code);
    return code;
  }
  doctest::Context context(argc, argv);
  return context.run();
}
