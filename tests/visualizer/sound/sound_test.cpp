// SPDX-License-Identifier: Apache-2.0
// The samples of the spindle, and the process that plays them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <unistd.h>

#include "visualizer/sound/spindle_sound.hpp"

namespace kerf::sound_test {

namespace fs = std::filesystem;

namespace {

constexpr double kRate = SpindleVoice::kSamplesPerS;
constexpr ToolSound kFree{.turns_per_s = 1000};
constexpr ToolSound kLoaded{.turns_per_s = 1000, .load = 0.8F};

std::vector<float> rendered(SpindleVoice& voice, const ToolSound& now, double seconds) {
  std::vector<float> samples(static_cast<std::size_t>(seconds * kRate));
  voice.render(now, samples);
  return samples;
}

/// A second of a voice that has had a second to come there.
std::vector<float> steady(const ToolSound& now) {
  SpindleVoice voice;
  rendered(voice, now, 1.0);
  return rendered(voice, now, 1.0);
}

double level(const std::vector<float>& samples) {
  double sum = 0;
  for (const float x : samples) sum += double{x} * x;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

/// Amplitude of one frequency in a second of samples: a bin of the discrete Fourier transform.
double amplitude(const std::vector<float>& samples, double hz) {
  double re = 0, im = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double angle = 2 * std::numbers::pi * hz * static_cast<double>(i) / kRate;
    re += samples[i] * std::cos(angle);
    im += samples[i] * std::sin(angle);
  }
  return 2 * std::hypot(re, im) / static_cast<double>(samples.size());
}

/// The loudest of all whole multiples of 100 Hz.
double loudest_hz(const std::vector<float>& samples) {
  double best_hz = 0, best = 0;
  for (double hz = 100; hz < kRate / 2; hz += 100) {
    const double now = amplitude(samples, hz);
    if (now > best) best = now, best_hz = hz;
  }
  return best_hz;
}

double steepest(const std::vector<float>& samples) {
  double most = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    most = std::max(most, std::abs(double{samples[i]} - samples[i - 1]));
  }
  return most;
}

}  // namespace

TEST_CASE("a free spindle hums once a turn; under load its blades are the loudest") {
  CHECK(loudest_hz(steady(kFree)) == 1000);
  CHECK(loudest_hz(steady({.turns_per_s = 5000})) == 5000);
  CHECK(loudest_hz(steady(kLoaded)) == 1000 * SpindleVoice::kBlades);
}

TEST_CASE("blades that strike too fast to be heard are silent, and are not heard as a lower tone") {
  const auto samples = steady({.turns_per_s = 5000, .load = 0.8F});
  CHECK(loudest_hz(samples) == 5000);
  // 40 kHz would be mirrored to 8 kHz.
  CHECK(amplitude(samples, kRate - SpindleVoice::kBlades * 5000) < 1e-4);
}

TEST_CASE("the level rises with load, and the noise with contact") {
  double last = 0;
  for (const float load : {0.0F, 0.2F, 0.5F, 1.0F}) {
    const double now = level(steady({.turns_per_s = 1000, .load = load}));
    CHECK(now > last);
    last = now;
  }
  last = 0;
  for (const float contact : {0.1F, 0.3F, 1.0F}) {
    const double now = level(steady({.contact = contact}));
    CHECK(now > last);
    last = now;
  }
}

TEST_CASE("at rest nothing is heard, at once or after a cut") {
  SpindleVoice voice;
  CHECK(level(rendered(voice, {}, 0.1)) == 0.0);
  CHECK(level(rendered(voice, {1000, 1, 1}, 0.5)) > 0.01);
  rendered(voice, {}, 0.5);
  constexpr double kStepOf16Bits = 1.0 / 32768;
  CHECK(level(rendered(voice, {}, 0.1)) < kStepOf16Bits);
}

TEST_CASE("a step of what the tool does is no click: no sample jumps further than the tones do") {
  constexpr double kGlideS = 0.01;  // as promised
  // So low that a wave moves by little from sample to sample, and a click by ten times as much.
  const ToolSound loud{.turns_per_s = 100, .load = 1};
  const auto samples = steady(loud);
  double most = 0;
  for (const double hz : {100.0, 100.0 * SpindleVoice::kBlades}) {
    const double loudest = amplitude(samples, hz);
    REQUIRE(loudest > 0.001);
    most += loudest * (2 * std::sin(std::numbers::pi * hz / kRate) + 1 / (kRate * kGlideS));
  }
  SpindleVoice voice;
  std::vector<float> stepped;
  for (int i = 0; i < 20; ++i) {  // each step at another place of the wave
    const auto more = rendered(voice, i % 2 == 0 ? loud : ToolSound{}, 0.1 + 0.0007 * i);
    stepped.insert(stepped.end(), more.begin(), more.end());
  }
  CHECK(steepest(stepped) <= most * 1.0001);  // floats
}

TEST_CASE("the samples depend on the inputs alone, and not on how they are asked for") {
  SpindleVoice one, other;
  const ToolSound now{700, 0.5F, 0.5F};
  const auto whole = rendered(one, now, 0.2);
  std::vector<float> parts;
  while (parts.size() < whole.size()) {
    const auto part = rendered(other, now, 0.01);
    parts.insert(parts.end(), part.begin(), part.end());
  }
  CHECK(parts == whole);
}

TEST_CASE("no input is louder than 1") {
  constexpr float kMost = std::numeric_limits<float>::max();
  for (const float turns : {-1.0F, 0.0F, 500.0F, 5000.0F, kMost}) {
    for (const float x : {-kMost, 0.0F, 1.0F, kMost}) {
      for (const float sample : steady({turns, x, x})) REQUIRE(std::abs(sample) <= 1.0F);
    }
  }
}

TEST_CASE(
    "a tool that rests on a surface makes no sound; one that turns or is drawn over it does") {
  TickRecord tick{};
  tick.contact_force_n[1] = 3.3F;
  CHECK(tool_sound(tick).contact == 0.0F);
  tick.velocity_mm_per_s[0] = 25;
  CHECK(tool_sound(tick).contact == doctest::Approx(0.5));
  tick.velocity_mm_per_s[0] = std::numeric_limits<float>::quiet_NaN();  // not known yet
  CHECK(tool_sound(tick).contact == 0.0F);
  tick.spindle_ratio = 0.5F;
  tick.spindle_load = 0.25F;
  CHECK(tool_sound(tick).contact == doctest::Approx(1.0));
  CHECK(tool_sound(tick).turns_per_s == doctest::Approx(2500));
  CHECK(tool_sound(tick).load == 0.25F);
  tick.spindle_ratio = tick.spindle_load = std::numeric_limits<float>::quiet_NaN();
  CHECK(tool_sound(tick).turns_per_s == 0.0F);
  CHECK(tool_sound(tick).load == 0.0F);
}

namespace {

namespace fs = std::filesystem;

/// OpenAL with one way out, a file, or with none.
class Drivers {
 public:
  explicit Drivers(const std::string& name) {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "alsoft.conf")
        << "[general]\ndrivers = " << name << "\n[wave]\nfile = " << wave().string() << "\n";
    setenv("ALSOFT_CONF", (folder_ / "alsoft.conf").c_str(), 1);
    setenv("ALSOFT_DRIVERS", name.c_str(), 1);
  }
  ~Drivers() { fs::remove_all(folder_); }
  [[nodiscard]] fs::path wave() const { return folder_ / "out.wav"; }

 private:
  fs::path folder_ = fs::temp_directory_path() / ("kerf-sound-" + std::to_string(getpid()));
};

std::string heard_within(SoundLink& link, std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    if (const auto text = link.heard()) return *text;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return "nothing";
}

std::vector<char> bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool any_sound(const std::vector<char>& wave) {
  constexpr std::size_t kHeader = 100;  // longer than any
  for (std::size_t i = kHeader; i < wave.size(); ++i) {
    if (wave[i] != 0) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("what is sent is played by a process of its own") {
  const Drivers drivers("wave");
  SoundLink link;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  // OpenAL buffers the file, so it is read until something is in it.
  while (!any_sound(bytes_of(drivers.wave())) && std::chrono::steady_clock::now() < end) {
    link.send({1000, 1, 1}, false);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(any_sound(bytes_of(drivers.wave())));
  CHECK_FALSE(link.heard());
}

TEST_CASE("a player that is mute opens no device") {
  const Drivers drivers("wave");
  {
    SoundLink link;
    for (int i = 0; i < 20; ++i) {
      link.send({1000, 1, 1}, true);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }  // it has taken all of them
  CHECK_FALSE(fs::exists(drivers.wave()));
}

TEST_CASE("no audio device is told once, and later messages go nowhere") {
  const Drivers drivers("no-such-driver");
  SoundLink link;
  link.send({1000, 1, 1}, false);
  CHECK(heard_within(link, std::chrono::seconds(20)) ==
        "sound: no audio device; the window is silent");
  for (int i = 0; i < 1000; ++i) link.send({1000, 1, 1}, false);
  CHECK_FALSE(link.heard());
}

}  // namespace kerf::sound_test
