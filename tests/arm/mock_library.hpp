// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <dlfcn.h>

#include "arm/exchange.hpp"
#include "shared/arm/arm_page.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

inline const std::string kLibraries = KERF_TEST_LIBRARIES;

/// A vendor library of the tests in this process: a copy of its own, so that each test begins with
/// fresh state. `behaviour`: KERF_MOCK.
class MockLibrary {
 public:
  MockLibrary(std::string_view kind, std::string_view file, const std::string& behaviour)
      : path_(folder_ / file) {
    std::filesystem::copy_file(kLibraries + '/' + std::string(kind) + '/' + std::string(file),
                               path_);
    setenv("KERF_MOCK", behaviour.c_str(), 1);
    handle_ = dlopen(path_.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_ == nullptr) throw std::runtime_error(dlerror());
  }

  [[nodiscard]] std::string path() const { return path_.string(); }

  void tick(int ticks = 1) const { find<void(int)>("kerf_mock_tick")(ticks); }
  void pose(const std::array<double, 3>& position, const std::array<double, 9>& rotation,
            int buttons = 0, bool is_docked = false) const {
    find<void(const double*, const double*, int, int)>("kerf_mock_pose")(
        position.data(), rotation.data(), buttons, is_docked ? 1 : 0);
  }
  /// What was called so far.
  [[nodiscard]] std::vector<std::string> lines() const {
    std::vector<const char*> texts(4096);
    const int count = find<int(const char**, int)>("kerf_mock_lines")(
        texts.data(), static_cast<int>(texts.size()));
    return {texts.begin(), texts.begin() + std::min<int>(count, 4096)};
  }
  /// The same without the frames.
  [[nodiscard]] std::vector<std::string> calls() const {
    auto all = lines();
    std::erase_if(all, [](const std::string& line) {
      return line.starts_with("frame ") || line.starts_with("force ");
    });
    return all;
  }
  /// The force of the last frame, in the library's axes.
  [[nodiscard]] std::array<double, 3> force() const {
    std::array<double, 3> force{};
    long tick = 0;
    for (const std::string& line : lines()) {
      if (!line.starts_with("frame ") && !line.starts_with("force ")) continue;
      if (std::sscanf(line.c_str() + 6, "%ld %lf %lf %lf", &tick, &force[0], &force[1],
                      &force[2]) != 4) {
        throw std::runtime_error(line);
      }
    }
    return force;
  }

 private:
  template <class Function>
  [[nodiscard]] Function* find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(handle_, name));
  }

  TemporaryFolder folder_;
  std::filesystem::path path_;
  void* handle_ = nullptr;
};

/// The time of a test: it passes when the test says so.
inline std::int64_t test_ns = 1'000'000'000;
inline std::int64_t test_clock() noexcept {
  return test_ns;
}

inline constexpr std::array<double, 9> kUpright{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// The same for a thread that runs by itself: each look takes half a millisecond.
inline std::int64_t ticking_clock() noexcept {
  return test_ns += 500'000;
}

/// A page with both its ends, and an exchange in the time of the test.
struct Link {
  explicit Link(Personality personality, int rate_hz = 1000, ArmExchange::Clock* clock = test_clock)
      : device(personality),
        page("test", personality, rate_hz),
        exchange(page, force_figures(personality).peak_n, rate_hz, clock) {}

  /// The controller's end, opened once there is an adapter that runs.
  ArmPageController& controller() {
    if (!end) {
      page.set_state(ArmState::running, "");
      ArmPageController::Absence absence{};
      std::string text;
      end = ArmPageController::open("test", device, absence, text);
      if (!end) throw std::runtime_error("no page: " + text);
    }
    return *end;
  }
  void command(const std::array<std::int16_t, 3>& force_mn, bool is_on = true) {
    const CartesianCommand command{.force_mn = force_mn,
                                   .force_on = is_on,
                                   .light = CartesianCommand::Light::ready,
                                   .answers = 0};
    if (!controller().send(encode(command), test_ns)) throw std::runtime_error("not sent");
  }
  /// The newest report that was not taken yet.
  std::optional<CartesianReport> report() {
    std::optional<CartesianReport> newest;
    cartesian::ReportBytes packet;
    while (controller().take(packet)) newest = decode_cartesian_report(packet);
    return newest;
  }

  RuntimeFolder folder;
  Personality device;
  ArmPageAdapter page;
  ArmExchange exchange;
  std::unique_ptr<ArmPageController> end;
};

}  // namespace kerf::test
