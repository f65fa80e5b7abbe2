// SPDX-License-Identifier: Apache-2.0
#include "visualizer/sound/sound_player.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <poll.h>
#include <sys/socket.h>

namespace kerf {

namespace {

constexpr std::size_t kBlock = 480;  // 10 ms: what is heard is that new, and what waits before it,
constexpr std::size_t kBlocks = 4;   // 40 ms: a busy machine may wake this process that late

/// Blocks of samples, one after the other.
class AudioOut {
 public:
  /// None where there is no device. OpenAL's own "No Output" is none.
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

/// The newest message that came within `wait_ms`; the one before where none did. None once the
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

}  // namespace

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

}  // namespace kerf
