// SPDX-License-Identifier: Apache-2.0
// This program's heap is the monkey's: what is wrong with a block ends the process that did it.
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace kerf::guarded_heap_test {
namespace {

using Sizes = std::initializer_list<std::size_t>;

/// The signal that ends a process that does `work`, 0 where it ends by itself.
int signal_of(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    constexpr rlimit kNoCores{0, 0};
    setrlimit(RLIMIT_CORE, &kNoCores);
    for (const int signal : {SIGSEGV, SIGABRT}) std::signal(signal, SIG_DFL);
    work();
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

/// As a library would write: nobody looks.
void write_at(volatile char* block, std::ptrdiff_t place) {
  block[place] = 1;
}

void* volatile g_block;  // the compiler knows nothing of where it points

char* block() {
  return static_cast<char*>(g_block);
}

char* new_block(std::size_t size) {
  g_block = std::malloc(size);
  return block();
}

}  // namespace

TEST_CASE("a write right behind a block, or before it, is noticed: of any size") {
  for (const std::size_t size : Sizes{1, 16, 100, 511, 512, 1000, 4096, 10'000, 3'344'000}) {
    CAPTURE(size);
    const auto end = static_cast<std::ptrdiff_t>(size);
    for (const std::ptrdiff_t place : {end, end + 15, std::ptrdiff_t{-1}}) {
      CAPTURE(place);
      CHECK(signal_of([&] {
              write_at(new_block(size), place);
              std::free(block());
            }) != 0);
    }
    CHECK(signal_of([&] {
            write_at(new_block(size), 0);
            write_at(block(), end - 1);
            std::free(block());
          }) == 0);
  }
}

TEST_CASE("a write far behind a large block is stopped before anybody frees it") {
  CHECK(signal_of([] { write_at(new_block(4096), 4096); }) == SIGSEGV);
  CHECK(signal_of([] { write_at(new_block(3'344'000), 3'344'064); }) == SIGSEGV);
}

TEST_CASE("a write into what was freed is noticed, and so is what is freed twice") {
  for (const std::size_t size : Sizes{100, 5000}) {
    CAPTURE(size);
    CHECK(signal_of([&] {
            std::free(new_block(size));
            write_at(block(), 8);  // where the C library keeps its list
            for (int i = 0; i < 200'000; ++i) std::free(new_block(100));
          }) != 0);
    CHECK(signal_of([&] {
            std::free(new_block(size));
            std::free(block());
          }) != 0);
  }
}

TEST_CASE("it is a heap: contents move along, alignment holds, and many blocks may be large") {
  std::vector<char*> blocks;
  for (std::size_t i = 0; i < 40'000; ++i) {
    blocks.push_back(static_cast<char*>(std::malloc(600)));
    REQUIRE(blocks.back() != nullptr);
    *blocks.back() = static_cast<char>(i);
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    REQUIRE(*blocks[i] == static_cast<char>(i));
    std::free(blocks[i]);
  }
  std::string text = "kerf";
  for (int i = 0; i < 12; ++i) text += text;
  CHECK(text.substr(4 * 4095) == "kerf");
  for (std::size_t alignment = 16; alignment <= 65'536; alignment *= 2) {
    CAPTURE(alignment);
    for (const std::size_t size : Sizes{1, 700, 70'000}) {
      void* block = nullptr;
      REQUIRE(posix_memalign(&block, alignment, size) == 0);
      CHECK(reinterpret_cast<std::size_t>(block) % alignment == 0);
      std::free(block);
    }
  }
  CHECK(std::malloc(std::size_t(-1) / 2) == nullptr);
  const auto* const zeroes = static_cast<const char*>(std::calloc(100, 100));
  CHECK(std::string(zeroes, 10'000) == std::string(10'000, '\0'));
}

}  // namespace kerf::guarded_heap_test
