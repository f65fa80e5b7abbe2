// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <unistd.h>

#include "visualizer/sound/sound_player.hpp"

using namespace kerf;

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
