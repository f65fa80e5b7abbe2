// SPDX-License-Identifier: Apache-2.0
// The page of a force of one's own, from both sides.
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <kerf/device.hpp>
#include <kerf/external.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/external/external_page.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::device_test {
namespace {

/// A runtime folder for these pages alone.
class Folder {
 public:
  Folder() {
    const char* old = std::getenv("XDG_RUNTIME_DIR");
    if (old != nullptr) old_ = old;
    std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_all);
    setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
  }
  ~Folder() {
    if (old_) {
      setenv("XDG_RUNTIME_DIR", old_->c_str(), 1);
    } else {
      unsetenv("XDG_RUNTIME_DIR");
    }
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::filesystem::path page(const std::string& name) const {
    return folder_.path() / "kerf" / ("external-" + name + ".page");
  }

 private:
  kerf::test::TemporaryFolder folder_;
  std::optional<std::string> old_;
};

kerf::TickRecord record_of(std::uint64_t tick) {
  kerf::TickRecord record{};
  record.tick = tick;
  const auto t = static_cast<double>(tick);
  std::ranges::fill(record.position_mm, t);
  std::ranges::fill(record.orientation, static_cast<float>(t));
  std::ranges::fill(record.velocity_mm_per_s, static_cast<float>(t));
  std::ranges::fill(record.commanded_force_n, static_cast<float>(t));
  record.phase = 4;
  record.flags = static_cast<std::uint32_t>(tick);
  return record;
}

/// One number in all places: a torn one has two.
kerf::ProgramForce all_of(double i) {
  return {
      .force_n = {i, i, i}, .goal_mm = {i, i, i}, .stiffness_n_per_mm = i, .damping_ns_per_mm = i};
}

bool is_whole(const kerf::ProgramForce& force) {
  const double i = force.force_n[0];
  return force.force_n == std::array{i, i, i} && force.goal_mm == std::array{i, i, i} &&
         force.stiffness_n_per_mm == i && force.damping_ns_per_mm == i;
}

std::string problem_of(const std::string& name) {
  try {
    static_cast<void>(kerf::Device::open(name));
  } catch (const kerf::Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a program reads ticks and gives forces") {
  const Folder folder;
  kerf::ExternalPage page("kerf", {.arms = 2, .workspace_scale = 0.5, .stale_ticks = 3});
  auto device = kerf::Device::open();
  CHECK(device.arms() == 2);
  CHECK(device.period_s() == doctest::Approx(0.001));
  CHECK(device.workspace_scale() == 0.5);
  CHECK(device.state().tick == 0);
  CHECK(std::isnan(device.state().position_mm[0]));
  CHECK_FALSE(device.poll());
  CHECK(device.alive());
  kerf::ProgramForce force;
  CHECK_FALSE(page.take(0, force));
  page.publish(1, record_of(7));
  page.publish(0, record_of(7));
  REQUIRE(device.wait());
  CHECK(device.state().tick == 7);
  CHECK(device.state(1).tick == 7);
  CHECK(device.state(2).tick == 0);
  CHECK(device.state().position_mm == std::array{7.0, 7.0, 7.0});
  CHECK(device.state().phase == kerf::Phase::active);
  CHECK(device.state().answers == 0);

  CHECK(device.give({.force_n = {1, 2, 3}, .goal_mm = {4, 5, 6}, .stiffness_n_per_mm = 0.1}) == 1);
  CHECK(device.give({.force_n = {9, 2, 3}, .damping_ns_per_mm = 0.2}) == 2);
  CHECK(device.give({.force_n = {8, 0, 0}}, 1) == 1);
  CHECK(device.give({}, 2) == 0);
  REQUIRE(page.take(0, force));
  CHECK(force.force_n == std::array{9.0, 2.0, 3.0});
  CHECK(force.stiffness_n_per_mm == 0);
  CHECK(force.damping_ns_per_mm == 0.2);
  page.refuse(0);
  CHECK_FALSE(page.take(0, force));
  REQUIRE(page.take(1, force));
  CHECK(force.force_n[0] == 8);
  page.publish(1, record_of(8));
  page.publish(0, record_of(8));
  REQUIRE(device.wait());
  CHECK(device.state().answers == 2);
  CHECK(device.state(1).answers == 1);
  CHECK(device.refused() == 1);
  CHECK(page.taken() == 2);
  CHECK(page.refused() == 1);

  // Without a new one for three ticks there is a gap, once.
  CHECK(page.gaps() == 0);
  for (int i = 0; i < 3; ++i) CHECK_FALSE(page.take(1, force));
  CHECK(page.gaps() == 1);
  for (int i = 0; i < 9; ++i) CHECK_FALSE(page.take(1, force));
  CHECK(page.gaps() == 1);
  device.give({}, 1);
  CHECK(page.take(1, force));
  for (int i = 0; i < 3; ++i) CHECK_FALSE(page.take(1, force));
  CHECK(page.gaps() == 2);
}

TEST_CASE("one program at a time, and the next one goes on") {
  const Folder folder;
  kerf::ExternalPage page("a", {.rate_hz = 4000});
  std::optional<kerf::Device> first(kerf::Device::open("a"));
  CHECK(first->give({}) == 1);
  CHECK(problem_of("a") ==
        folder.page("a").string() +
            ": a program has it: another one, this one, or a fork of either; end that first");
  first.reset();
  auto second = kerf::Device::open("a");
  CHECK(second.give({}) == 2);
}

TEST_CASE("no controller, one that has ended, one that was killed, a page of another kind") {
  const Folder folder;
  CHECK(problem_of("none").starts_with(folder.page("none").string() + ": No such file"));
  CHECK(problem_of("none").find("with your user and XDG_RUNTIME_DIR") != std::string::npos);
  CHECK(problem_of("../../etc/x") == "name: not that of a controller; use its --name");
  std::optional<kerf::Device> device;
  {
    kerf::ExternalPage page("b", {});
    page.publish(0, record_of(1));
    device = kerf::Device::open("b");
    CHECK(device->state().tick == 1);
    page.publish(0, record_of(2));
    CHECK(device->wait());
  }
  CHECK_FALSE(device->wait());
  CHECK_FALSE(device->alive());
  CHECK(device->state().tick == 2);
  device.reset();
  CHECK_FALSE(std::filesystem::exists(folder.page("b")));

  const pid_t child = fork();
  if (child == 0) {
    kerf::ExternalPage page("c", {});
    page.publish(0, record_of(5));
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(problem_of("c") ==
        folder.page("c").string() + ": its controller has ended; start it again");
  {
    const kerf::ExternalPage page("c", {});
    CHECK(problem_of("c").empty());
    const auto at = [&](std::size_t offset, std::uint32_t value) {
      std::fstream file(folder.page("c"), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(offset));
      file.write(reinterpret_cast<const char*>(&value), sizeof value);
    };
    at(offsetof(kerf_external_page, arms), 3);
    CHECK(problem_of("c").find("no page of layout 1") != std::string::npos);
    at(offsetof(kerf_external_page, arms), 1);
    at(offsetof(kerf_external_page, layout), 2);
    CHECK(problem_of("c").find("no page of layout 1") != std::string::npos);
  }
  std::ofstream(folder.page("short")) << "x";
  CHECK(problem_of("short").find("too short for a page") != std::string::npos);
}

TEST_CASE("a program that opens while controllers come and go finds a whole page or none") {
  const Folder folder;
  std::atomic<bool> done = false;
  std::atomic<int> tries = 0;
  std::thread controllers([&] {
    for (int run = 0; run < 200; ++run) {
      const kerf::ExternalPage page("kerf", {});
      const int before = tries;
      while (tries < before + 2) std::this_thread::yield();  // one try at least while it is there
    }
    done = true;
  });
  std::string other;
  int opened = 0;
  for (; !done; ++tries) {
    kerf_external external;
    const char* const why = kerf_external_open(&external, "kerf");
    const std::string problem = why == nullptr ? "" : why;
    opened += why == nullptr ? 1 : 0;
    kerf_external_close(&external);
    const bool expected = problem.empty() || problem.find("no controller") != std::string::npos ||
                          problem.find("has ended") != std::string::npos;
    if (!expected) other = problem;
  }
  controllers.join();
  CHECK(other == "");
  CHECK(opened >= 200);
}

TEST_CASE("a force of a program that writes without a pause is whole") {
  const Folder folder;
  kerf::ExternalPage page("d", {});
  std::atomic<bool> stop{false};
  std::jthread program([&] {
    auto device = kerf::Device::open("d");
    for (double i = 1; !stop; ++i) device.give(all_of(i));
  });
  int torn = 0;
  for (int taken = 0; taken < 100'000;) {
    kerf::ProgramForce force;
    if (!page.take(0, force)) continue;
    ++taken;
    torn += is_whole(force) ? 0 : 1;
  }
  stop = true;
  CHECK(torn == 0);
}

TEST_CASE("neither side sees half of what the other one writes") {
  const Folder folder;
  kerf::ExternalPage page("d", {});
  std::atomic<bool> stop{false};
  std::jthread program([&] {
    auto device = kerf::Device::open("d");
    std::uint64_t last = 0;
    for (double i = 1; !stop; ++i) {
      device.give(all_of(i));
      if (!device.wait()) break;
      const kerf::DeviceState& now = device.state();
      const auto t = static_cast<double>(now.tick);
      const bool whole = now.position_mm == std::array{t, t, t} &&
                         now.force_n == std::array{t, t, t} && now.flags == now.tick;
      if (!whole || now.tick <= last) std::abort();
      last = now.tick;
    }
  });
  std::uint64_t taken = 0;
  for (std::uint64_t tick = 1; taken < 300; ++tick) {
    kerf::ProgramForce force;
    if (page.take(0, force)) {
      ++taken;
      CHECK(is_whole(force));
    }
    page.publish(0, record_of(tick));
    std::this_thread::yield();
  }
  stop = true;
  page.publish(0, record_of(1U << 24));
}

}  // namespace kerf::device_test
