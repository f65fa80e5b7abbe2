// SPDX-License-Identifier: Apache-2.0
#include "visualizer/sound/sound_link.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "visualizer/sound/sound_player.hpp"

namespace kerf {

namespace {

/// The copy of this process: it plays, and never comes back.
[[noreturn]] void play(int socket) noexcept {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Audio libraries write lines of their own.
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
  try {
    play_sound(socket);
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

}  // namespace

SoundLink::SoundLink() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return;
  player_ = fork();
  if (player_ == 0) {
    close(ends[0]);
    play(ends[1]);
  }
  close(ends[1]);
  socket_ = ends[0];
  if (player_ < 0) end();
}

SoundLink::~SoundLink() {
  end();
}

void SoundLink::end() noexcept {
  constexpr int kTries = 20;
  constexpr auto kPause = std::chrono::milliseconds(10);
  if (socket_ >= 0) close(std::exchange(socket_, -1));
  const pid_t player = std::exchange(player_, -1);
  if (player <= 0) return;
  for (int i = 0; i < kTries; ++i) {
    if (waitpid(player, nullptr, WNOHANG) != 0) return;
    std::this_thread::sleep_for(kPause);
  }
  kill(player, SIGKILL);  // its library hangs
  waitpid(player, nullptr, 0);
}

void SoundLink::send(const ToolSound& sound, bool mute) noexcept {
  if (socket_ < 0) return;
  const SoundMessage message{sound, mute};
  ::send(socket_, &message, sizeof message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::optional<std::string> SoundLink::heard() {
  if (told_) return std::nullopt;
  std::array<char, 200> text{};
  const ssize_t size = socket_ < 0 ? 0 : recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  told_ = true;
  if (size > 0) return std::string(text.data(), static_cast<std::size_t>(size));
  end();
  return "sound: its process has ended; the window is silent";
}

}  // namespace kerf
