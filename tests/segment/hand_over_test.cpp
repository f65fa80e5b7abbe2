// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <limits>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/posix/sockets.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/server.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::hand_over_test {

using namespace kerf::test;

namespace {

/// Runs `body` in a forked process; its result is the exit status.
template <class Body>
pid_t in_child(Body body) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    int status = 99;
    try {
      status = body();
    } catch (...) {
      status = 98;
    }
    _exit(status);
  }
  return child;
}

int status_of(pid_t child) {
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

SegmentCommand select(std::uint32_t tool) {
  SegmentCommand command;
  command.kind = CommandKind::select_tool;
  command.argument = tool;
  return command;
}

}  // namespace

TEST_CASE("another process gets the whole volume through the socket, and cannot write it") {
  const RuntimeFolder folder;
  NoiseVolume volume({40, 33, 17});
  const std::uint64_t expected = density_hash(volume.density);
  std::array<int, 2> ready{};
  REQUIRE(pipe(ready.data()) == 0);
  const pid_t child = in_child([&] {
    char go = 0;
    if (read(ready[0], &go, 1) != 1) return 1;
    const SegmentConnection connection = connect_segment("demo");
    VolumeSnapshot snapshot;
    connection.reader().update(0, snapshot);
    if (density_hash(snapshot.density) != expected) return 2;
    return connection.alive() ? 0 : 3;
  });
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  REQUIRE(write(ready[1], "g", 1) == 1);
  CHECK(status_of(child) == 0);
  close(ready[0]);
  close(ready[1]);
}

TEST_CASE("the descriptor that a reader gets is read-only") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  const int link = socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::ranges::copy(segment_socket("demo"), address.sun_path);
  REQUIRE(connect(link, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  char message[64];
  iovec part{message, sizeof message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  REQUIRE(recvmsg(link, &header, 0) == 32);
  REQUIRE(CMSG_FIRSTHDR(&header) != nullptr);
  int fd = -1;
  std::memcpy(&fd, CMSG_DATA(CMSG_FIRSTHDR(&header)), sizeof fd);
  CHECK((fcntl(fd, F_GETFL) & O_ACCMODE) == O_RDONLY);
  close(fd);
  close(link);
}

TEST_CASE("a second controller of the same name is refused in one line, another name is not") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  {
    const SegmentServer first("demo", writer);
    std::string error;
    try {
      const SegmentServer second("demo", writer);
    } catch (const SegmentError& refusal) {
      error = refusal.what();
    }
    CHECK(error == "--name demo: in use by process " + std::to_string(getpid()) +
                       "; stop it or choose another name");
    CHECK_NOTHROW(SegmentServer("other", writer));
    CHECK_NOTHROW(static_cast<void>(connect_segment("demo")));
  }
  CHECK_NOTHROW(SegmentServer("demo", writer));
  CHECK(std::filesystem::is_empty(segment_folder()));
}

TEST_CASE("the socket that a killed controller left is replaced") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  std::array<int, 2> ready{};
  REQUIRE(pipe(ready.data()) == 0);
  const pid_t child = in_child([&] {
    const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer server("demo", writer);
    if (write(ready[1], "g", 1) != 1) return 1;
    for (;;) pause();
  });
  char go = 0;
  REQUIRE(read(ready[0], &go, 1) == 1);
  const SegmentConnection connection = connect_segment("demo");
  CHECK(connection.alive());
  kill(child, SIGKILL);
  status_of(child);
  CHECK(!connection.alive());
  CHECK_THROWS_AS(static_cast<void>(connect_segment("demo")), SegmentError);
  VolumeSnapshot snapshot;
  connection.reader().update(0, snapshot);
  CHECK(snapshot.density == volume.density);  // the segment outlives its writer

  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  CHECK(connect_segment("demo").reader().info().session_id == writer.session_id());
  CHECK(writer.session_id() != connection.reader().info().session_id);
  close(ready[0]);
  close(ready[1]);
}

TEST_CASE("a reader that finds the socket is never refused, however early it comes") {
  const RuntimeFolder folder;
  NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const sockaddr_un address = unix_address(segment_socket("demo"));
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::atomic<bool> looks{false};
    auto early = std::async(std::launch::async, [&] {
      for (;;) {
        const OwnedFd fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
        const int failed =
            connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
        looks = true;
        if (failed == 0) return 0;
        if (errno != ENOENT) return errno;
      }
    });
    while (!looks) std::this_thread::yield();
    const SegmentServer server("demo", writer);
    refused += early.get() == 0 ? 0 : 1;
  }
  CHECK(refused == 0);
  CHECK_FALSE(std::filesystem::exists(
      std::filesystem::path(segment_socket("demo")).replace_extension(".new")));
}

TEST_CASE("a client that is stopped and continued while it waits for the greeting gets it") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  std::array<int, 2> ready{};
  REQUIRE(pipe(ready.data()) == 0);
  const pid_t server = in_child([&] {
    const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer serving("demo", writer);
    if (write(ready[1], "g", 1) != 1) return 1;
    for (;;) pause();
  });
  char go = 0;
  REQUIRE(read(ready[0], &go, 1) == 1);
  const auto stop = [](pid_t process) {
    kill(process, SIGSTOP);
    int status = 0;
    return waitpid(process, &status, WUNTRACED) == process && WIFSTOPPED(status);
  };
  REQUIRE(stop(server));  // its socket takes clients, but nobody greets them
  const pid_t client = in_child([] { return connect_segment("demo").alive() ? 0 : 1; });
  bool waits = true;
  for (int i = 0; i < 40 && waits; ++i) {
    usleep(5000);
    waits = stop(client);
    if (waits) kill(client, SIGCONT);
  }
  CHECK(waits);
  kill(server, SIGCONT);
  if (waits) CHECK(status_of(client) == 0);
  kill(server, SIGKILL);
  status_of(server);
  close(ready[0]);
  close(ready[1]);
}

TEST_CASE("commands arrive in order; the 65th that nobody takes gets BUSY, later ones do not") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  SegmentServer server("demo", writer, CommandLimits{.tools = 100});
  SegmentConnection connection = connect_segment("demo");
  CHECK(!server.take_command());
  for (std::uint32_t i = 0; i < kCommandSlots; ++i) {
    const Reply reply = connection.send(select(i));
    CHECK(reply.status == ReplyStatus::accepted);
    CHECK(reply.index == i + 1);
  }
  CHECK(connection.send(select(99)).status == ReplyStatus::busy);
  const auto first = server.take_command();
  REQUIRE(first);
  CHECK(first->argument == 0);
  CHECK(first->index == 1);
  CHECK(connection.send(select(98)).index == kCommandSlots + 1);
  for (std::uint32_t i = 1; i < kCommandSlots; ++i) {
    const auto command = server.take_command();
    REQUIRE(command);
    CHECK(command->argument == i);
  }
  REQUIRE(server.take_command());
  CHECK(!server.take_command());
}

TEST_CASE("a reply that comes too late is not taken for that of the next command") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  std::promise<void> go_on;
  // Of a server that hangs at the first command: it refuses the first and accepts all others.
  const SegmentServer server("demo", writer.fd(), 1, [&](const SegmentCommand& command) -> Reply {
    if (command.argument != 0) return {ReplyStatus::accepted, command.argument};
    go_on.get_future().wait();
    return {ReplyStatus::refused, 0};
  });
  SegmentConnection connection = connect_segment("demo");
  CHECK_THROWS_AS(connection.send(select(0)), SegmentError);
  SegmentConnection moved = std::move(connection);
  go_on.set_value();
  const Reply second = moved.send(select(7));
  CHECK(second.status == ReplyStatus::accepted);
  CHECK(second.index == 7);
  CHECK(moved.send(select(8)).index == 8);
}

TEST_CASE("commands outside the limits are refused before they reach the servo") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  SegmentServer server("demo", writer, CommandLimits{.tools = 2});
  SegmentConnection connection = connect_segment("demo");
  CHECK(connection.send(select(2)).status == ReplyStatus::refused);
  SegmentCommand hold;
  hold.argument = 2;
  CHECK(connection.send(hold).status == ReplyStatus::refused);
  hold.argument = 1;
  hold.reserved[2] = 1;
  CHECK(connection.send(hold).status == ReplyStatus::refused);
  SegmentCommand reset;
  reset.kind = CommandKind::reset;
  reset.argument = 1;
  CHECK(connection.send(reset).status == ReplyStatus::refused);
  SegmentCommand unknown;
  unknown.kind = static_cast<CommandKind>(77);
  CHECK(connection.send(unknown).status == ReplyStatus::refused);
  CHECK(!server.take_command());
  hold.reserved[2] = 0;
  CHECK(connection.send(hold).status == ReplyStatus::accepted);
  CHECK(server.take_command()->kind == CommandKind::hold);
}

TEST_CASE("a tool is chosen for one arm; every other command is for all, and says no arm") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const auto statuses = [&writer](std::uint32_t arms) {
    SegmentServer server("demo", writer, CommandLimits{.tools = 3, .arms = arms});
    SegmentConnection connection = connect_segment("demo");
    std::vector<ReplyStatus> out;
    for (const CommandKind kind :
         {CommandKind::select_tool, CommandKind::hold, CommandKind::mark}) {
      for (const std::uint32_t arm : {0U, 1U, 2U}) {
        out.push_back(connection.send({.kind = kind, .arm = arm}).status);
        if (const auto taken = server.take_command()) CHECK(taken->arm == arm);
      }
    }
    return out;
  };
  constexpr auto kYes = ReplyStatus::accepted, kNo = ReplyStatus::refused;
  CHECK(statuses(1) == std::vector{kYes, kNo, kNo, kYes, kNo, kNo, kYes, kNo, kNo});
  CHECK(statuses(2) == std::vector{kYes, kYes, kNo, kYes, kNo, kNo, kYes, kNo, kNo});
}

TEST_CASE("one reader too many is refused and the others stay") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  std::vector<SegmentConnection> readers;
  for (std::size_t i = 0; i < SegmentServer::kMaxPeers; ++i) {
    readers.push_back(connect_segment("demo"));
  }
  CHECK_THROWS_WITH_AS(static_cast<void>(connect_segment("demo")), doctest::Contains("refused"),
                       SegmentError);
  for (const SegmentConnection& reader : readers) CHECK(reader.alive());
}

TEST_CASE("names that would leave the folder and folders open to others are refused") {
  const RuntimeFolder folder;
  for (const char* const name : {"", "..", ".x", "a/b", "a b", "x\n"}) {
    CAPTURE(name);
    CHECK_THROWS_AS(static_cast<void>(segment_socket(name)), SegmentError);
  }
  CHECK_THROWS_AS(static_cast<void>(segment_socket(std::string(65, 'a'))), SegmentError);
  CHECK(segment_socket("demo-2.a_b") == folder.path().string() + "/kerf/demo-2.a_b.sock");
  REQUIRE(chmod(segment_folder().c_str(), 0777) == 0);
  CHECK_THROWS_WITH_AS(static_cast<void>(segment_folder()),
                       doctest::Contains("not a folder of yours alone"), SegmentError);
}

TEST_CASE("connecting where nobody listens says what to start, and names what runs") {
  const RuntimeFolder folder;
  const auto said = [] {
    try {
      static_cast<void>(connect_segment("demo"));
    } catch (const SegmentAbsent& absent) {
      return std::string(absent.what());
    }
    return std::string();
  };
  CHECK(said().ends_with("; start kerf-controller with this name first"));
  {
    const NoiseVolume volume({8, 8, 8});
    const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer one("demo-17", writer), another("atlas", writer);
    std::ofstream(folder.path() / "kerf" / "nobody.sock");
    CHECK(said().ends_with("first, or take a name that runs: atlas, demo-17"));
  }
  CHECK(said().ends_with("first"));
  CHECK_THROWS_WITH_AS(static_cast<void>(connect_segment("demo")),
                       doctest::Contains("start kerf-controller"), SegmentError);
}

}  // namespace kerf::hand_over_test
