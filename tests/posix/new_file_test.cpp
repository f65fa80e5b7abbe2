// SPDX-License-Identifier: Apache-2.0
// In a folder that others may write to: what they have put there is neither followed nor cut.
#include <array>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::new_file_test {

namespace fs = std::filesystem;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;

namespace {

/// The one line with which `call` is refused; empty: it is not.
template <class Call>
std::string refusal_of(const Call& call) {
  try {
    call();
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

void add_new(kerf::AtomicFiles& files, const fs::path& path) {
  AtomicFile& file = files.add(path);
  file.write("new", 3);
  file.close();
}

}  // namespace

TEST_CASE("a link or a file that waits under a temporary name is left alone") {
  const TemporaryFolder folder;
  write_new_file(folder / "victim", "precious");
  const std::string temporary =
      (folder / "report.json").string() + ".new-" + std::to_string(getpid());
  for (const char* end : {"", "-0", "-1"}) fs::create_symlink(folder / "victim", temporary + end);
  fs::create_symlink(folder / "unborn", temporary + "-2");
  write_new_file(temporary + "-3", "another's");
  write_new_file(folder / "report.json", "{}");
  CHECK(text_of(folder / "report.json") == "{}");
  CHECK(text_of(folder / "victim") == "precious");
  CHECK_FALSE(fs::exists(folder / "unborn"));
  CHECK(text_of(temporary + "-3") == "another's");
  CHECK(folder.count() == 7);
}

TEST_CASE("a link in the place of the file is refused, wherever it leads") {
  const TemporaryFolder folder;
  write_new_file(folder / "victim", "precious");
  fs::create_symlink(folder / "victim", folder / "link");
  fs::create_symlink(folder / "unborn", folder / "dangling");
  fs::create_symlink(folder / "round", folder / "round");
  for (const char* name : {"link", "dangling", "round"}) {
    CAPTURE(name);
    const fs::path file = folder / name;
    const std::string line = refusal_of([&] { write_new_file(file, "{}"); });
    CHECK(line == file.string() + ": is a link; name a file itself");
    CHECK(refusal_of([&] { kerf::check_new_file(file); }) == line);
    CHECK(fs::is_symlink(file));
  }
  CHECK(text_of(folder / "victim") == "precious");
  CHECK(folder.count() == 4);
}

TEST_CASE("a folder in the place of the file is refused, and a new file has the user's rights") {
  const TemporaryFolder folder;
  CHECK(refusal_of([&] { kerf::check_new_file(folder.path()); }).find("cannot be written") !=
        std::string::npos);
  const mode_t before = umask(027);
  write_new_file(folder / "a", "x");
  umask(before);
  struct stat a {};
  REQUIRE(stat((folder / "a").c_str(), &a) == 0);
  CHECK((a.st_mode & 0777) == 0640);
  const std::string longest(255, 'x');
  CHECK_NOTHROW(write_new_file(folder / longest.c_str(), "x"));
  CHECK(refusal_of([&] {
          write_new_file(folder / (longest + "x").c_str(), "x");
        }).find("cannot be written") != std::string::npos);
  CHECK(folder.count() == 2);
}

TEST_CASE("a name that is too long, or below a file, is refused before anything is written") {
  const TemporaryFolder folder;
  write_new_file(folder / "file", "x");
  for (const std::string& name :
       {std::string(256, 'x'), std::string("file/below"), std::string("no/where")}) {
    CAPTURE(name);
    CHECK(refusal_of([&] {
            kerf::check_new_file(folder / name.c_str());
          }).find("cannot be written") != std::string::npos);
  }
  CHECK(folder.count() == 1);
}

TEST_CASE("nothing is left of a file whose writer is killed half-way") {
  const TemporaryFolder folder;
  const int nameless = open(folder.path().c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (nameless < 0) {
    MESSAGE("skipped: the file system of " << folder.path() << " has no nameless files");
    return;
  }
  close(nameless);
  write_new_file(folder / "a", "before");
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    kerf::AtomicFile file(folder / "a");
    file.write("half", 4);
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  CHECK(WIFSIGNALED(status));
  CHECK(text_of(folder / "a") == "before");
  CHECK(folder.count() == 1);
}

TEST_CASE("what holds no bytes is written to as it stands, by a link too") {
  const TemporaryFolder folder;
  fs::create_symlink("/dev/null", folder / "nothing");
  CHECK_NOTHROW(kerf::check_new_file(folder / "nothing"));
  CHECK_NOTHROW(write_new_file(folder / "nothing", "{}"));
  CHECK(fs::is_symlink(folder / "nothing"));

  const fs::path pipe = folder / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(refusal_of([&] { write_new_file(pipe, "{}"); }) ==
        pipe.string() + ": no program reads this pipe; start the reader first");
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  REQUIRE(reader >= 0);
  kerf::check_new_file(pipe);
  pollfd ended{reader, POLLIN, 0};
  CHECK(poll(&ended, 1, 0) == 0);  // no writer has come and gone
  write_new_file(pipe, "{}");
  std::array<char, 8> heard{};
  CHECK(read(reader, heard.data(), heard.size()) == 2);
  close(reader);
  CHECK(folder.count() == 2);
}

TEST_CASE("files that belong together appear together or not at all") {
  const TemporaryFolder folder;
  {
    kerf::AtomicFiles files;
    add_new(files, folder / "a");
    CHECK_THROWS_AS(add_new(files, folder / "none/b"), FileError);
  }
  CHECK(folder.count() == 0);
  write_new_file(folder / "b", "old");
  {
    kerf::AtomicFiles files;
    add_new(files, folder / "a");
    add_new(files, folder / "b");
    const auto there = files.commit_if_new();
    REQUIRE(there);
    CHECK(*there == folder / "b");
  }
  CHECK(folder.count() == 1);
  CHECK(text_of(folder / "b") == "old");
  {
    kerf::AtomicFiles files;
    add_new(files, folder / "a");
    add_new(files, folder / "b");
    files.commit();
  }
  CHECK(text_of(folder / "a") == "new");
  CHECK(text_of(folder / "b") == "new");
  CHECK(folder.count() == 2);
}

namespace {

/// The exit status of a child process that makes `call`; -1: it was killed when its system call
/// number `last` had returned. Each one stops twice, after the first stop of all; the child stands
/// still while it is killed, so nothing depends on who is faster.
template <class Call>
int child_until(int last, const Call& call) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    raise(SIGSTOP);
    call();
    _exit(0);
  }
  int status = 0;
  for (int stops = 0;; ++stops) {
    waitpid(child, &status, 0);
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    if (stops == 2 * last) break;
    ptrace(PTRACE_SYSCALL, child, nullptr, nullptr);
  }
  kill(child, SIGKILL);
  while (waitpid(child, &status, 0) == child && !WIFEXITED(status) && !WIFSIGNALED(status)) {
  }
  return -1;
}

}  // namespace

TEST_CASE("a commit that is killed at any system call leaves each file old or new") {
  int kept = 0, half = 0;
  for (int last = 1;; ++last) {
    CAPTURE(last);
    REQUIRE(last < 1000);
    const TemporaryFolder folder;
    write_new_file(folder / "a", "old");
    write_new_file(folder / "b", "old");
    const int end = child_until(last, [&] {
      kerf::AtomicFiles files;
      add_new(files, folder / "a");
      add_new(files, folder / "b");
      files.commit();
    });
    const std::string a = text_of(folder / "a"), b = text_of(folder / "b");
    CHECK((a == "old" || a == "new"));
    CHECK((b == "old" || b == "new"));
    kept += b == "old" ? 1 : 0;
    half += a == b ? 0 : 1;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      const std::string name = entry.path().filename();
      CHECK((name == "a" || name == "b" || name.substr(1).starts_with(".new-")));
    }
    if (end < 0) continue;
    CHECK(end == 0);
    CHECK(a == "new");
    CHECK(b == "new");
    CHECK(folder.count() == 2);
    break;
  }
  CHECK(kept > 0);
  CHECK(half > 0);  // it was killed between the two
}

TEST_CASE("files that cannot all be replaced stay as they were") {
  const TemporaryFolder folder;
  write_new_file(folder / "a", "old");
  {
    fs::create_directory(folder / "gone");
    kerf::AtomicFiles files;
    add_new(files, folder / "a");
    add_new(files, folder / "gone/b");
    if (!fs::remove(folder / "gone")) return;  // the file system gave it a name at once
    CHECK_THROWS_AS(files.commit(), FileError);
  }
  CHECK(text_of(folder / "a") == "old");
  CHECK(folder.count() == 1);
  if (geteuid() != 0) {
    MESSAGE("skipped: only root can make a file of somebody else");
    return;
  }
  write_new_file(folder / "b", "root's");
  const uid_t nobody = 65534;
  REQUIRE(chown((folder / "a").c_str(), nobody, nobody) == 0);
  fs::permissions(folder.path(), fs::perms::all | fs::perms::sticky_bit);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    if (setuid(nobody) != 0) _exit(2);
    const std::string line = refusal_of([&] {
      kerf::AtomicFiles files;
      add_new(files, folder / "a");
      add_new(files, folder / "new");
      add_new(files, folder / "b");
      files.commit();
    });
    _exit(line.find("b: cannot be written (Operation not permitted)") == std::string::npos ? 1 : 0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  CHECK(status == 0);
  CHECK(text_of(folder / "a") == "old");
  CHECK(text_of(folder / "b") == "root's");
  CHECK(folder.count() == 2);
}

TEST_CASE("of two that make a new file at once one gets it, a link counts as there") {
  const TemporaryFolder folder;
  AtomicFile one(folder / "a"), two(folder / "a"), three(folder / "link");
  for (AtomicFile* file : {&one, &two, &three}) {
    file->write("own", 3);
    file->close();
  }
  CHECK(two.commit_if_new());
  CHECK_FALSE(one.commit_if_new());
  fs::create_symlink("nowhere", folder / "link");
  CHECK_FALSE(three.commit_if_new());
  CHECK(text_of(folder / "a") == "own");
}

TEST_CASE("standard output is written to as it stands, also where it is a file that is added to") {
  const TemporaryFolder folder;
  std::ofstream(folder / "out") << "before ";
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const int out = open((folder / "out").c_str(), O_WRONLY | O_APPEND);
    dup2(out, STDOUT_FILENO);
    write_new_file("/dev/stdout", "now");
    write_new_file("/dev/stdout", " later");
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  CHECK(status == 0);
  CHECK(text_of(folder / "out") == "before now later");
}

}  // namespace kerf::new_file_test
