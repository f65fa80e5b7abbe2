// SPDX-License-Identifier: Apache-2.0
#include "arm/guard.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "arm/arm_error.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {
namespace {

/// In memory that both processes share; null outside run_guarded.
std::atomic<std::atomic<bool>*> told{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free);

constexpr int kFailed = 2;

/// What the child leaves lies in this pair of sockets: written at one end, and taken back by the
/// child or taken by the guard at the other. A socket that lies there stays open, whoever ends.
struct LastWords {
  int write = -1, read = -1;
};
LastWords last_words;

void make_last_words() noexcept {
  std::array<int, 2> ends{-1, -1};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()) == 0) {
    last_words = {ends[0], ends[1]};
  }
}

/// A message of bytes and one socket, as sendmsg and recvmsg take it.
struct SocketMessage {
  SocketMessage(char* bytes, std::size_t size) noexcept : part{bytes, size} {
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
  }
  SocketMessage(const SocketMessage&) = delete;
  SocketMessage& operator=(const SocketMessage&) = delete;

  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  iovec part;
  msghdr header{};
};

/// Takes what lies there, oldest first; false if nothing does. The socket is the caller's.
bool take_last_word(int& socket, std::array<char, 512>& bytes, std::size_t& size) noexcept {
  SocketMessage message(bytes.data(), bytes.size());
  const ssize_t got = recvmsg(last_words.read, &message.header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  const cmsghdr* const head = CMSG_FIRSTHDR(&message.header);
  if (got <= 0 || head == nullptr || head->cmsg_type != SCM_RIGHTS) return false;
  std::memcpy(&socket, CMSG_DATA(head), sizeof socket);
  size = static_cast<std::size_t>(got);
  return true;
}

/// The child has ended. True if a last message has left.
bool say_last_words() noexcept {
  int socket = -1;
  std::array<char, 512> bytes;
  std::size_t size = 0;
  bool is_said = false;
  while (take_last_word(socket, bytes, size)) {
    is_said =
        send(socket, bytes.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(size);
    close(socket);
  }
  return is_said;
}

void share_the_mark() {
  void* const page = mmap(nullptr, sizeof(std::atomic<bool>), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) throw std::runtime_error("no memory to guard the vendor's library");
  told.store(new (page) std::atomic<bool>(false));
}

/// Prints the line of an end that the child could not report; its exit code.
int code_of_end(const char* program, int status) {
  const bool is_said = say_last_words();
  if (WIFEXITED(status) && *told.load()) return WEXITSTATUS(status);
  std::string line;
  const char* cure = kUnplug;
  if (WIFEXITED(status)) {
    line = "the vendor's library has ended the program by _exit(" +
           std::to_string(WEXITSTATUS(status)) + ")";
  } else if (WTERMSIG(status) == SIGKILL && is_said) {
    line = "killed; the device's service was given zero force";
    cure = "; start kerf-arm again";
  } else if (WTERMSIG(status) == SIGKILL) {
    line = "killed, so the device was not closed and may keep its last force";
  } else {
    const char* const name = sigabbrev_np(WTERMSIG(status));
    line = "the vendor's library, or kerf-arm in it, has crashed (SIG" +
           std::string(name != nullptr ? name : "?") + ")";
  }
  std::fprintf(stderr, "%s: %s%s\n", program, line.c_str(), cure);
  return kFailed;
}

/// Passes signals on until the child has ended.
int watch(const char* program, pid_t child, const sigset_t& watched) {
  for (;;) {
    siginfo_t info{};
    const int number = sigwaitinfo(&watched, &info);
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) return code_of_end(program, status);
    // A terminal has sent its signal to the child, too.
    if (number > 0 && number != SIGCHLD && info.si_code <= 0) kill(child, number);
  }
}

[[noreturn]] void be_the_child(const std::function<int()>& work, const sigset_t& before,
                               pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) static_cast<void>(raise(SIGTERM));  // it has ended before that
  // Those that ask for the end wait until there is a handler.
  const sigset_t ends = ends_of_user();
  sigset_t waiting;
  sigorset(&waiting, &before, &ends);
  pthread_sigmask(SIG_SETMASK, &waiting, nullptr);
  const int code = work();
  std::cout.flush();
  end_is_told();
  // The vendor's library is loaded and may have running threads, so its exit handlers could crash.
  _exit(code);
}

}  // namespace

int run_guarded(const char* program, const std::function<int()>& work) {
  share_the_mark();
  make_last_words();
  static_cast<void>(
      std::signal(SIGCHLD, SIG_DFL));  // if it is ignored, nothing is left to wait for
  const sigset_t asking = asking_signals(), ends = ends_of_user();
  sigset_t watched;
  sigorset(&watched, &asking, &ends);
  if (sigismember(&ends, SIGHUP) == 0) sigdelset(&watched, SIGHUP);  // nohup
  sigaddset(&watched, SIGCHLD);
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, &watched, &before);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    const int error = errno;
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    throw std::runtime_error("no second process to guard the vendor's library (" +
                             std::generic_category().message(error) +
                             "); end other programs, or raise ulimit -u");
  }
  if (child == 0) be_the_child(work, before, parent);
  const int code = watch(program, child, watched);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return code;
}

void leave_last_word(int socket, std::string_view bytes) noexcept {
  if (told.load() == nullptr) return;
  int former = -1;
  std::array<char, 512> ignored;
  std::size_t size = 0;
  while (take_last_word(former, ignored, size)) close(former);
  if (socket < 0 || bytes.empty() || bytes.size() > ignored.size()) return;
  std::copy(bytes.begin(), bytes.end(), ignored.begin());
  SocketMessage message(ignored.data(), bytes.size());
  cmsghdr* const head = CMSG_FIRSTHDR(&message.header);
  head->cmsg_level = SOL_SOCKET;
  head->cmsg_type = SCM_RIGHTS;
  head->cmsg_len = CMSG_LEN(sizeof socket);
  std::memcpy(CMSG_DATA(head), &socket, sizeof socket);
  static_cast<void>(sendmsg(last_words.write, &message.header, MSG_DONTWAIT | MSG_NOSIGNAL));
}

void end_is_told() noexcept {
  if (std::atomic<bool>* const mark = told.load()) mark->store(true);
}

}  // namespace kerf
