// SPDX-License-Identifier: Apache-2.0

#include "visualizer/sound/spindle_sound.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace kerf {

namespace {

constexpr double kDt = 1.0 / SpindleVoice::kSamplesPerS;
constexpr double kMostTurnsPerS = 1e4;  // twice what a scene may ask of a spindle

/// 1 for a tone that is heard in full, 0 for one that is too high.
double audible(double hz) {
  return std::clamp((SpindleVoice::kSilentFromHz - hz) /
                        (SpindleVoice::kSilentFromHz - SpindleVoice::kFadesFromHz),
                    0.0, 1.0);
}

/// A slow spindle hums as much less as its unbalance pulls less, up to a certain speed.
double hum_of(double turns_per_s) {
  constexpr double kFullTurnsPerS = 1000;  // chosen: of a fast handpiece with a motor
  return std::min(turns_per_s / kFullTurnsPerS, 1.0);
}

double tone(double turns) {
  return std::sin(2.0 * std::numbers::pi * turns);
}

/// Of -1 to 1; xorshift (Marsaglia 2003).
double next_random(std::uint32_t& dice) {
  dice ^= dice << 13;
  dice ^= dice >> 17;
  dice ^= dice << 5;
  return dice / 2147483648.0 - 1.0;
}

}  // namespace

void SpindleVoice::render(const ToolSound& now, std::span<float> samples) noexcept {
  const double turns_per_s = std::clamp(static_cast<double>(now.turns_per_s), 0.0, kMostTurnsPerS);
  const double load = std::clamp(static_cast<double>(now.load), 0.0, 1.0);
  const double contact = std::clamp(static_cast<double>(now.contact), 0.0, 1.0);
  constexpr double kStep = kDt / kGlideS;
  constexpr double kHissHz = 3000;  // chosen: above it the noise falls off
  constexpr double kHissStep = 2.0 * std::numbers::pi * kHissHz * kDt;
  for (float& sample : samples) {
    turns_per_s_ += (turns_per_s - turns_per_s_) * kStep;
    load_ += (load - load_) * kStep;
    contact_ += (contact - contact_) * kStep;
    turn_ += turns_per_s_ * kDt;
    turn_ -= std::floor(turn_);
    hiss_ += (next_random(dice_) - hiss_) * kHissStep;
    const double turning = hum_of(turns_per_s_);
    const double hum = (kHum + kHumOfLoad * load_) * turning * audible(turns_per_s_);
    const double blades = kBladesOfLoad * load_ * turning * audible(kBlades * turns_per_s_);
    sample = static_cast<float>(hum * tone(turn_) + blades * tone(kBlades * turn_) +
                                kHiss * contact_ * hiss_);
  }
}

namespace {

double length(const float (&v)[3]) {
  const double all = std::hypot(double{v[0]}, double{v[1]}, double{v[2]});
  return std::isfinite(all) ? all : 0.0;
}

}  // namespace

ToolSound tool_sound(const TickRecord& record) {
  constexpr double kReferenceTurnsPerS = 5000;  // of spindle_ratio 1: 300,000 in a minute
  // Chosen: from here on it hisses no louder.
  constexpr double kFullForceN = 3.3, kFullTurnsPerS = 100, kFullSpeedMmPerS = 50;
  const double ratio = std::isfinite(record.spindle_ratio) ? double{record.spindle_ratio} : 0.0;
  const double turns_per_s = ratio * kReferenceTurnsPerS;
  const double rubs =
      std::max(turns_per_s / kFullTurnsPerS, length(record.velocity_mm_per_s) / kFullSpeedMmPerS);
  const double pressed = length(record.contact_force_n) / kFullForceN;
  return {.turns_per_s = static_cast<float>(turns_per_s),
          .load = std::isfinite(record.spindle_load) ? record.spindle_load : 0.0F,
          .contact = static_cast<float>(std::min(pressed, 1.0) * std::min(rubs, 1.0))};
}

namespace {

/// What a window sends to its player, as one packet.
struct SoundMessage {
  ToolSound sound;
  bool mute = false;
};

constexpr std::size_t kBlock = 480;  // 10 ms: what is heard is that new, and what waits before it,
constexpr std::size_t kBlocks = 4;   // 40 ms: a busy machine may wake this process that late

/// Blocks of samples, one after the other.
class AudioOut {
 public:
  /// None if there is no device. OpenAL's own "No Output" is none.
  static std::unique_ptr<AudioOut> open() {
    auto out = std::unique_ptr<AudioOut>(new AudioOut);
    if (out->device_ == nullptr) return nullptr;
    const std::string_view name = alcGetString(out->device_, ALC_DEVICE_SPECIFIER);
    if (name.find("No Output") != std::string_view::npos) return nullptr;
    out->context_ = alcCreateContext(out->device_, nullptr);
    if (out->context_ == nullptr || alcMakeContextCurrent(out->context_) == ALC_FALSE) {
      return nullptr;
    }
    alGenSources(1, &out->source_);
    alGenBuffers(kBlocks, out->buffers_.data());
    return alGetError() == AL_NO_ERROR ? std::move(out) : nullptr;
  }
  AudioOut(const AudioOut&) = delete;
  AudioOut& operator=(const AudioOut&) = delete;
  ~AudioOut() {
    alcMakeContextCurrent(nullptr);
    if (context_ != nullptr) alcDestroyContext(context_);
    if (device_ != nullptr) alcCloseDevice(device_);
  }

  /// Renders what has room. False once the device is gone.
  bool fill(SpindleVoice& voice, const ToolSound& now) {
    ALint played = 0;
    alGetSourcei(source_, AL_BUFFERS_PROCESSED, &played);
    for (; played > 0; --played) {
      ALuint buffer = 0;
      alSourceUnqueueBuffers(source_, 1, &buffer);
      queue(buffer, voice, now);
    }
    for (; queued_ < kBlocks; ++queued_) queue(buffers_[queued_], voice, now);
    ALint state = 0;
    alGetSourcei(source_, AL_SOURCE_STATE, &state);
    if (state != AL_PLAYING) alSourcePlay(source_);  // it begins, or ran out of blocks
    ALCint connected = ALC_TRUE;
    if (alcIsExtensionPresent(device_, "ALC_EXT_disconnect") == ALC_TRUE) {
      alcGetIntegerv(device_, ALC_CONNECTED, 1, &connected);
    }
    return connected == ALC_TRUE && alGetError() == AL_NO_ERROR;
  }

 private:
  AudioOut() : device_(alcOpenDevice(nullptr)) {}

  void queue(ALuint buffer, SpindleVoice& voice, const ToolSound& now) {
    constexpr float kLoudest = 32767;
    std::array<float, kBlock> samples{};
    std::array<std::int16_t, kBlock> words{};
    voice.render(now, samples);
    std::transform(samples.begin(), samples.end(), words.begin(),
                   [](float sample) { return static_cast<std::int16_t>(sample * kLoudest); });
    alBufferData(buffer, AL_FORMAT_MONO16, words.data(), sizeof words,
                 static_cast<ALsizei>(SpindleVoice::kSamplesPerS));
    alSourceQueueBuffers(source_, 1, &buffer);
  }

  ALCdevice* device_;
  ALCcontext* context_ = nullptr;
  ALuint source_ = 0;
  std::array<ALuint, kBlocks> buffers_{};
  std::size_t queued_ = 0;
};

/// The newest message that came within `wait_ms`; the one before if none did. None once the
/// other end is closed.
std::optional<SoundMessage> newest(int socket, int wait_ms, SoundMessage last) {
  pollfd waits{socket, POLLIN, 0};
  poll(&waits, 1, wait_ms);
  for (;;) {
    SoundMessage message;
    const ssize_t size = recv(socket, &message, sizeof message, MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return last;
    if (size <= 0) return std::nullopt;
    if (size == sizeof message) last = message;
  }
}

void tell(int socket, std::string_view text) {
  send(socket, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

/// A process of its own plays what comes through `socket`, until the other end is closed: it
/// returns no earlier, and is to end then. The device is opened at the first message that is not
/// mute. If there is none, or it goes, one packet of text reports it, and nothing is played.
void play_sound(int socket) {
  constexpr int kHalfBlockMs = 5, kForEver = -1;
  std::unique_ptr<AudioOut> out;
  SpindleVoice voice;
  bool silent = false;  // for good
  std::optional<SoundMessage> message = SoundMessage{.sound = {}, .mute = true};
  while ((message = newest(socket, out ? kHalfBlockMs : kForEver, *message))) {
    if (silent) continue;
    if (!out && !message->mute) {
      out = AudioOut::open();
      silent = out == nullptr;
      if (silent) tell(socket, "sound: no audio device; the window is silent");
    }
    if (out && !out->fill(voice, message->mute ? ToolSound{} : message->sound)) {
      tell(socket, "sound: the audio device is gone; the window is silent");
      out.reset();
      silent = true;
    }
  }
}

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
