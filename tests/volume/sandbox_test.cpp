// SPDX-License-Identifier: Apache-2.0
#include "controller/input/sandbox.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::sandbox_test {

using namespace kerf::test;

namespace {

using Reader = std::function<void(SandboxReader&)>;

/// More seconds than a reader needs that ends by itself, even under sanitizers on a slow machine.
SandboxJob job(int seconds = 60) {
  return {"a.vol", "VOL", 0, seconds};
}

std::size_t any(std::span<const std::byte>) {
  return 4096;
}

/// What the sandbox makes of such a reader.
std::string answer(const Reader& read, const SandboxJob& to_do = job()) {
  try {
    static_cast<void>(read_in_sandbox(to_do, read, any));
  } catch (const LoadError& error) {
    CHECK(waitpid(-1, nullptr, WNOHANG) == -1);  // no child is left, not even a dead one
    return error.what();
  }
  return "no error";
}

void check_ends(const Reader& read, const std::string& how, const SandboxJob& to_do = job()) {
  const std::string message = answer(read, to_do);
  CAPTURE(message);
  CHECK(has(message, how));
  CHECK(is_one_line(message));
}

/// What a system call gives in the sandbox: 0, or the system's error number.
int error_of_call(const std::function<long()>& call) {
  int error = -1;
  const SharedBytes result = read_in_sandbox(
      job(),
      [&](SandboxReader& sandbox) {
        errno = 0;
        const int found = call() < 0 ? errno : 0;
        std::memcpy(sandbox.offer({}).data(), &found, sizeof found);
      },
      any);
  std::memcpy(&error, result.bytes().data(), sizeof error);
  return error;
}

[[noreturn]] void spin() {
  for (;;) static_cast<void>(::getpid());
}

int open_files() {
  int count = 0;
  for (int file = 0; file < 256; ++file) count += fcntl(file, F_GETFD) >= 0 ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("a reader hands over a header and memory; both sides see the same bytes") {
  std::string header;
  const SharedBytes memory = read_in_sandbox(
      job(),
      [](SandboxReader& sandbox) {
        const std::string told = "three words here";
        const std::span<std::byte> given = sandbox.offer(std::as_bytes(std::span(told)));
        if (given.size() != 5000 || given[4999] != std::byte{0}) throw LoadError("not 5000 zeros");
        for (std::size_t i = 0; i < given.size(); ++i) given[i] = static_cast<std::byte>(i);
      },
      [&](std::span<const std::byte> bytes) {
        header.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        return std::size_t{5000};
      });
  CHECK(header == "three words here");
  REQUIRE(memory.bytes().size() == 5000);
  for (std::size_t i = 0; i < 5000; ++i) CHECK(memory.bytes()[i] == static_cast<std::byte>(i));
  const SharedBytes none = read_in_sandbox(
      job(), [](SandboxReader& sandbox) { static_cast<void>(sandbox.offer({})); },
      [](std::span<const std::byte>) { return std::size_t{0}; });
  CHECK(none.bytes().empty());
}

TEST_CASE("however a reader ends, it is one line, and nothing of it stays") {
  const int files = open_files();
  check_ends([](SandboxReader&) { throw LoadError("a.vol: bad; mend it"); }, "a.vol: bad; mend it");
  check_ends([](SandboxReader&) { throw LoadError("two\nlines: \x1b[31m; x"); },
             R"(two\nlines: \x1b[31m)");
  check_ends([](SandboxReader&) { ::_exit(0); }, "the reader of VOL ended without a word");
  check_ends([](SandboxReader&) { ::_exit(7); }, "the reader of VOL ended without a word");
  check_ends([](SandboxReader&) { throw 5; }, "a.vol: cannot be read");
  check_ends([](SandboxReader&) {}, "the reader of VOL gave nothing");
  check_ends([](SandboxReader& s) { s.say(SandboxWord::done); }, "gave nothing");
  check_ends([](SandboxReader& s) { s.say(static_cast<SandboxWord>(77), "x"); },
             "says what none says");
  check_ends(
      [](SandboxReader& s) {
        static_cast<void>(s.offer({}));
        static_cast<void>(s.offer({}));
      },
      "says what none says");
  CHECK(answer([](SandboxReader&) { throw std::runtime_error("odd"); }) == "a.vol: odd");
  CHECK(open_files() == files);
}

TEST_CASE("a reader that crashes is told with its signal and the file that it was at") {
  for (const auto& [signal, name] : {std::pair{SIGSEGV, "SIGSEGV"},
                                     {SIGBUS, "SIGBUS"},
                                     {SIGILL, "SIGILL"},
                                     {SIGFPE, "SIGFPE"},
                                     {SIGKILL, "SIGKILL"}}) {
    check_ends(
        [&, signal = signal](SandboxReader& sandbox) {
          sandbox.at("folder/b.vol");
          if (::syscall(SYS_tgkill, ::getpid(), ::gettid(), signal) != 0) ::_exit(1);
          spin();
        },
        std::string("folder/b.vol: the reader of VOL ended with ") + name +
            " (the file is broken?)");
  }
  check_ends([](SandboxReader&) { std::abort(); }, "ended with SIGABRT");
  check_ends(
      [](SandboxReader&) {
        volatile int* nowhere = nullptr;
        *nowhere = 1;
      },
      "ended with SIG");
}

TEST_CASE("a signal that a terminal sends to all does not end a reader") {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    CHECK(error_of_call(
              [signal] { return ::syscall(SYS_tgkill, ::getpid(), ::gettid(), signal); }) == 0);
  }
}

TEST_CASE("a reader can write no file, reach nobody, start nothing and signal no other") {
  const TemporaryFolder folder;
  const std::string file = folder.write("there", "as it was").string();
  const std::string other = (folder / "new").string();
  const pid_t parent = ::getpid();
  const auto denied = [](const std::function<long()>& call) {
    CHECK(error_of_call(call) == EPERM);
  };
  denied([&] { return ::open(file.c_str(), O_WRONLY); });
  denied([&] { return ::open(file.c_str(), O_RDWR); });
  denied([&] { return ::open(file.c_str(), O_RDONLY | O_TRUNC); });
  denied([&] { return ::open(other.c_str(), O_RDONLY | O_CREAT, 0600); });
  denied([&] { return ::creat(other.c_str(), 0600); });
  denied([&] { return ::open(folder.path().c_str(), O_WRONLY | O_TMPFILE, 0600); });
  denied([&] { return ::unlink(file.c_str()); });
  denied([&] { return ::rename(file.c_str(), other.c_str()); });
  denied([&] { return ::truncate(file.c_str(), 0); });
  denied([&] { return ::chmod(file.c_str(), 0777); });
  denied([&] { return ::mkdir(other.c_str(), 0700); });
  denied([&] { return ::symlink(file.c_str(), other.c_str()); });
  denied([&] { return ::socket(AF_INET, SOCK_STREAM, 0); });
  denied([&] { return ::socket(AF_UNIX, SOCK_STREAM, 0); });
  denied([&] { return ::connect(kSandboxChannel, nullptr, 0); });
  denied([&] { return ::sendmsg(kSandboxChannel, nullptr, 0); });
  denied([&] { return ::syscall(SYS_fork); });
  denied([&] { return ::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); });
  denied([&] { return ::syscall(SYS_clone3, nullptr, 0); });
  denied([&] { return ::execl("/bin/true", "true", nullptr); });
  denied([&] { return ::kill(parent, SIGUSR1); });
  denied([&] { return ::syscall(SYS_tgkill, parent, parent, SIGUSR1); });
  denied([&] { return ::syscall(SYS_ptrace, 16 /* PTRACE_ATTACH */, parent, 0, 0); });
  denied([&] { return ::syscall(SYS_process_vm_writev, parent, nullptr, 0, nullptr, 0, 0); });
  denied([&] { return ::syscall(SYS_prctl, 22 /* PR_SET_SECCOMP */, 0, 0, 0, 0); });
  denied([&] {
    const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
    return ::setrlimit(RLIMIT_AS, &all);
  });
  denied([&] {
    void* at = ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return at == MAP_FAILED ? -1L : 0L;
  });
  denied([&] { return ::ftruncate(kSandboxMemory, 1 << 30); });
  denied([&] { return ::write(kSandboxMemory, "x", 1); });
  CHECK(text_of(file) == "as it was");
  CHECK_FALSE(std::filesystem::exists(other));
  // What it is for.
  CHECK(error_of_call([&] { return ::open(file.c_str(), O_RDONLY); }) == 0);
}

TEST_CASE("a reader has the files of its two numbers and the standard three, nothing else") {
  const int kept = ::open("/dev/null", O_RDONLY);  // not close-on-exec: nothing is executed
  REQUIRE(kept >= 0);
  CHECK(error_of_call([] {
          for (int file = kSandboxMemory + 1; file < 256; ++file) {
            if (::lseek(file, 0, SEEK_CUR) >= 0 || errno != EBADF) return 0L;
          }
          return -1L;
        }) == EBADF);
  ::close(kept);
}

TEST_CASE("memory beyond the limit is refused in one line, before and after the offer") {
  const auto take = [](std::size_t bytes) {
    std::vector<char> much(bytes, 1);
    volatile char last = much.back();
    static_cast<void>(last);
  };
  CHECK(answer([&](SandboxReader& s) {
          take(kSandboxBytes / 2);
          static_cast<void>(s.offer({}));
        }) == "no error");
#ifndef KERF_SANITIZED  // whose allocator ends the process
  check_ends([&](SandboxReader&) { take(2 * kSandboxBytes); },
             "a.vol: reading it takes more than 64 MiB of memory (the file is broken?)");
  check_ends(
      [&](SandboxReader& s) {
        static_cast<void>(s.offer({}));
        take(2 * kSandboxBytes);
      },
      "more than 64 MiB");
#endif
  // What is accepted may be taken twice: once as the memory, once beside it.
  const std::size_t size = 2 * kSandboxBytes;
  const SharedBytes memory = read_in_sandbox(
      job(),
      [&](SandboxReader& s) {
        const std::span<std::byte> given = s.offer({});
        take(size);
        given.back() = std::byte{9};
      },
      [&](std::span<const std::byte>) { return size; });
  CHECK(memory.bytes().back() == std::byte{9});
}

TEST_CASE("a reader cannot grow the memory that it was given") {
  check_ends(
      [](SandboxReader& s) {
        std::byte* end = s.offer({}).data() + 4096;
        void* more = ::mmap(end, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, kSandboxMemory, 4096);
        if (more == MAP_FAILED) throw LoadError("not mapped: x; y");
        *static_cast<volatile char*>(more) = 1;  // beyond the end of the file
      },
      "ended with SIG");
}

TEST_CASE("a reader that never ends is ended: by its CPU time, or where it stands still") {
  check_ends(
      [](SandboxReader&) { spin(); },
      "a.vol: reading it takes more than 1 s of CPU time (the file is broken?); allow more with "
      "--read-seconds",
      job(1));
  check_ends(
      [](SandboxReader&) {
        char never = 0;
        static_cast<void>(::read(kSandboxChannel, &never, 1));
      },
      "a.vol: its reader waits for more than 1 s", job(1));
}

TEST_CASE("a refusal of this side ends the reader") {
  const Reader offers = [](SandboxReader& s) {
    static_cast<void>(s.offer({}));
    spin();
  };
  CHECK_THROWS_WITH_AS(
      static_cast<void>(read_in_sandbox(job(), offers,
                                        [](std::span<const std::byte>) -> std::size_t {
                                          throw LoadError("too large; crop it");
                                        })),
      "too large; crop it", LoadError);
  CHECK(waitpid(-1, nullptr, WNOHANG) == -1);
}

#ifndef KERF_SANITIZED  // whose checks need a file for themselves
TEST_CASE("where no process or file is left, reading says so") {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = static_cast<rlim_t>(open_files());
  setrlimit(RLIMIT_NOFILE, &few);
  const std::string message = answer([](SandboxReader&) {});
  setrlimit(RLIMIT_NOFILE, &before);
  CAPTURE(message);
  CHECK(message.find("a.vol: no process to read it in (Too many open files); end other programs") ==
        0);
  few.rlim_cur = static_cast<rlim_t>(open_files()) + 4;  // enough here, too few there
  setrlimit(RLIMIT_NOFILE, &few);
  const std::string there = answer([](SandboxReader&) {});
  setrlimit(RLIMIT_NOFILE, &before);
  CHECK(there == "a.vol: too few files may be open to read it; raise `ulimit -n` to 64");
}
#endif

TEST_CASE("several threads read at once, each what is its own") {
#ifdef KERF_SANITIZED  // its allocator's locks stay as they are in a fork's child
  constexpr int kThreads = 1;
#else
  constexpr int kThreads = 4;
#endif
  constexpr int kReads = 8;
  std::array<std::atomic<int>, kThreads> right{};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < kReads; ++i) {
        const auto mine = static_cast<std::byte>(16 * static_cast<int>(t) + i);
        const SharedBytes memory = read_in_sandbox(
            job(), [&](SandboxReader& s) { s.offer({})[7] = mine; }, any);
        if (memory.bytes()[7] == mine) ++right[t];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& count : right) CHECK(count == kReads);
}

TEST_CASE("a program that ignores the end of its children reads all the same") {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  CHECK(answer([](SandboxReader& s) { static_cast<void>(s.offer({})); }) == "no error");
  CHECK(answer([](SandboxReader&) { std::abort(); }).find("the reader of VOL ended") !=
        std::string::npos);
  std::signal(SIGCHLD, before);
}

TEST_CASE("a limit of file sizes, which is one of shared memory too, is told as that") {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit few = before;
  few.rlim_cur = 1024;
  const auto kept = std::signal(SIGXFSZ, SIG_IGN);  // as in every program
  setrlimit(RLIMIT_FSIZE, &few);
  const std::string told = answer([](SandboxReader& sandbox) {
    static_cast<void>(sandbox.offer(std::as_bytes(std::span("header"))));
  });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, kept);
  CHECK(told == "a.vol: no 1 MiB of memory for it (File too large); raise ulimit -f");
}

}  // namespace kerf::sandbox_test
