// SPDX-License-Identifier: Apache-2.0
// The page between kerf-arm and a controller: its two ends, its locks, and foreign bytes in it.
#include "shared/arm/arm_page.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/device/arm/arm_port.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::arm_page_test {

using kerf::test::error_of;
using kerf::test::RuntimeFolder;
using Absence = ArmPageController::Absence;

namespace {

std::unique_ptr<ArmPageController> open_end(const std::string& name = "touch",
                                            Personality device = Personality::touch) {
  Absence absence{};
  std::string text;
  return ArmPageController::open(name, device, absence, text);
}

Absence absence_of(const std::string& name = "touch") {
  Absence absence{};
  std::string text;
  REQUIRE_FALSE(ArmPageController::open(name, Personality::touch, absence, text));
  return absence;
}

CartesianReport report_at(std::int32_t um) {
  CartesianReport report;
  report.position_um = {um, -um, 2 * um};
  return report;
}

kerf::cartesian::CommandBytes forcing(std::int16_t mn) {
  return encode(CartesianCommand{.force_mn = {mn, 0, 0},
                                 .force_on = true,
                                 .light = CartesianCommand::Light::ready,
                                 .answers = 0});
}

/// Runs `work` in a child process, which ends by `die`: without destructors, as in a crash.
template <class Work>
void in_killed_process(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(1);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
}
void die() {
  kill(getpid(), SIGKILL);
}

}  // namespace

TEST_CASE("page: reports arrive in order, numbered, and none twice") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.publish(report_at(1), 5);  // before there is a controller
  arm.set_state(ArmState::running, "mock");
  const auto end = open_end();
  REQUIRE(end);
  kerf::cartesian::ReportBytes packet;
  CHECK_FALSE(end->take(packet));
  for (int um = 2; um < 12; ++um) arm.publish(report_at(um), um);
  for (int um = 2; um < 12; ++um) {
    CHECK(end->waits());
    REQUIRE(end->take(packet));
    const auto report = kerf::decode_cartesian_report(packet).value();
    CHECK(report.number == static_cast<std::uint32_t>(um));
    CHECK(report.position_um[2] == 2 * um);
  }
  CHECK_FALSE(end->take(packet));
  CHECK(end->overrun() == 0);
}

TEST_CASE("page: a controller that was away gets the newest reports, and the rest is counted") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  for (int um = 1; um <= 1000; ++um) arm.publish(report_at(um), um);
  kerf::cartesian::ReportBytes packet;
  std::uint32_t taken = 0, last = 0;
  while (end->take(packet)) {
    ++taken;
    last = kerf::decode_cartesian_report(packet)->number;
  }
  CHECK(taken == kerf::arm_page::kReports - 1);
  CHECK(last == 1000);
  CHECK(end->overrun() == 1000 - taken);
}

TEST_CASE("page: the newest command counts, with its time") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  CHECK_FALSE(arm.newest());
  const auto end = open_end();
  for (std::int16_t mn = 1; mn <= 100; ++mn) {
    REQUIRE(end->send(forcing(mn), 1000 + mn));
    const auto newest = arm.newest();
    REQUIRE(newest);
    CHECK(newest->command.force_mn[0] == mn);
    CHECK(newest->at_ns == 1000 + mn);
  }
}

TEST_CASE("page: a thread that was interrupted cannot put its older command over a newer one") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  for (std::int16_t mn = 1; mn <= 4; ++mn) REQUIRE(end->send(forcing(mn), mn));
  const int file = open(kerf::ArmPage::path_of("touch").c_str(), O_RDWR);
  for (int place = 0; place < 4; ++place) {  // as if other threads had written them meanwhile
    const std::uint64_t ticket = 1000 + static_cast<unsigned>(place);
    REQUIRE(pwrite(file, &ticket, sizeof ticket, 320 + 64 * place + 8) == sizeof ticket);
  }
  close(file);
  const std::int16_t newest = arm.newest()->command.force_mn[0];
  for (int i = 0; i < 8; ++i) {
    REQUIRE(end->send(forcing(500), 5));
    CHECK(arm.newest()->command.force_mn[0] == newest);
  }
}

TEST_CASE("page: a place that a killed thread has left in hand stops no other") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  const int file = open(kerf::ArmPage::path_of("touch").c_str(), O_RDWR);
  const std::uint64_t odd = 7;
  for (int place = 0; place < 3; ++place) {
    REQUIRE(pwrite(file, &odd, sizeof odd, 320 + 64 * place) == sizeof odd);
  }
  for (std::int16_t mn = 1; mn <= 9; ++mn) {
    REQUIRE(end->send(forcing(mn), mn));
    CHECK(arm.newest()->command.force_mn[0] == mn);
  }
  REQUIRE(pwrite(file, &odd, sizeof odd, 320 + 64 * 3) == sizeof odd);
  CHECK_FALSE(end->send(forcing(1), 1));
  CHECK_FALSE(arm.newest());
  close(file);
}

TEST_CASE("page: one adapter of a name, and one controller") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  const std::string second =
      error_of<kerf::ArmPageError>([] { ArmPageAdapter("touch", Personality::touch, 1000); });
  CHECK(second == "--name touch: in use by process " + std::to_string(getpid()) +
                      "; stop that kerf-arm, or choose another name");
  CHECK(absence_of() == Absence::starting);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  REQUIRE(end);
  CHECK(error_of<kerf::ArmPageError>([] { open_end(); }) ==
        "the kerf-arm named touch serves another controller; stop that one, or name another");
  const ArmPageAdapter other("left", Personality::touch, 1000);  // two arms
  CHECK(absence_of("left") == Absence::starting);
}

TEST_CASE("page: a session that ends is over for its controller, and the file goes") {
  const RuntimeFolder folder;
  std::unique_ptr<ArmPageController> end;
  {
    ArmPageAdapter arm("touch", Personality::touch, 1000);
    arm.set_state(ArmState::running, "");
    end = open_end();
    REQUIRE(end);
    CHECK_FALSE(end->over());
    arm.set_state(ArmState::failed, "cable");
    CHECK(end->over());
    CHECK(std::string(end->status().text.data()) == "cable");
    arm.set_state(ArmState::running, "");  // too late
    CHECK(end->over());
    CHECK(end->status().state == ArmState::failed);
  }
  CHECK(end->over());
  CHECK(absence_of() == Absence::no_adapter);
  CHECK_FALSE(std::filesystem::exists(kerf::ArmPage::path_of("touch")));
}

TEST_CASE("page: that of a killed adapter is no adapter, and the next one takes it") {
  const RuntimeFolder folder;
  in_killed_process([] {
    ArmPageAdapter arm("touch", Personality::touch, 1000);
    arm.set_state(ArmState::running, "");
    for (int um = 0; um < 100; ++um) arm.publish(report_at(um), um);
    die();
  });
  CHECK(std::filesystem::exists(kerf::ArmPage::path_of("touch")));
  CHECK(absence_of() == Absence::no_adapter);
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  REQUIRE(end);
  arm.publish(report_at(7), 7);
  kerf::cartesian::ReportBytes packet;
  REQUIRE(end->take(packet));
  CHECK(kerf::decode_cartesian_report(packet)->number == 1);
}

TEST_CASE("page: a controller of a killed adapter sees that its session is over") {
  const RuntimeFolder folder;
  int ready[2];
  REQUIRE(pipe(ready) == 0);
  const pid_t child = fork();
  if (child == 0) {
    ArmPageAdapter arm("touch", Personality::touch, 1000);
    arm.set_state(ArmState::running, "");
    static_cast<void>(!write(ready[1], "r", 1));
    for (;;) pause();
  }
  char byte = 0;
  REQUIRE(read(ready[0], &byte, 1) == 1);
  const auto end = open_end();
  REQUIRE(end);
  kill(child, SIGKILL);
  REQUIRE(waitpid(child, nullptr, 0) == child);
  CHECK_FALSE(end->over());  // nothing on the page says so yet
  ArmPageAdapter next("touch", Personality::touch, 1000);
  CHECK(end->over());
  CHECK(next.newest() == std::nullopt);
}

TEST_CASE("page: what a killed controller has left has no force for the next one") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  in_killed_process([] {
    const auto end = open_end();
    if (!end || !end->send(forcing(1000), 1)) _exit(1);
    die();
  });
  CHECK(arm.newest()->command.force_mn[0] == 1000);
  const auto end = open_end();  // its lock has died with it
  REQUIRE(end);
  CHECK_FALSE(arm.newest());
  REQUIRE(end->send(forcing(5), 2));
  CHECK(arm.newest()->command.force_mn[0] == 5);
}

TEST_CASE("page: another device, another version, a folder in its place") {
  const RuntimeFolder folder;
  {
    ArmPageAdapter arm("x", Personality::omega, 1000);
    arm.set_state(ArmState::running, "");
    CHECK(error_of<kerf::ArmPageError>([] { open_end("x"); }) ==
          "the kerf-arm named x is of a omega, and the controller wants a touch; take --device "
          "omega, or another name");
    const int file = open(kerf::ArmPage::path_of("x").c_str(), O_RDWR);
    REQUIRE(pwrite(file, "\x09", 1, 8) == 1);
    close(file);
    CHECK(error_of<kerf::ArmPageError>([] {
            open_end("x", Personality::omega);
          }).ends_with("of another version; start the kerf-arm of this one"));
  }
  std::filesystem::create_directory(kerf::ArmPage::path_of("d"));
  CHECK(error_of<kerf::ArmPageError>([] { open_end("d"); }).find("arm-d.page: ") !=
        std::string::npos);
  CHECK_FALSE(
      error_of<kerf::ArmPageError>([] { ArmPageAdapter("../x", Personality::touch, 1); }).empty());
}

TEST_CASE("page: a short file and one without an adapter are no adapter") {
  const RuntimeFolder folder;
  const std::string path = kerf::ArmPage::path_of("touch");
  for (const int bytes : {0, 1, 100, 8191}) {
    folder.write(path.substr(folder.path().string().size() + 1),
                 std::string(static_cast<std::size_t>(bytes), 'x'));
    CHECK(absence_of() == Absence::no_adapter);
    CHECK_NOTHROW(ArmPageAdapter("touch", Personality::touch, 1000));  // which makes it whole
  }
}

TEST_CASE("page: both ends at once, and several senders, see whole packets alone") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  REQUIRE(end);
  constexpr std::int32_t kReports = 50'000;
  std::atomic<bool> is_over{false};
  std::atomic<int> torn{0};
  std::vector<std::thread> senders;
  for (int sender = 0; sender < 2; ++sender) {
    senders.emplace_back([&] {
      for (std::int16_t mn = 1; !is_over; mn = static_cast<std::int16_t>(mn % 30'000 + 1)) {
        const auto packet =
            encode(CartesianCommand{.force_mn = {mn, static_cast<std::int16_t>(-mn), mn},
                                    .force_on = true,
                                    .light = CartesianCommand::Light::ready,
                                    .answers = static_cast<std::uint32_t>(mn)});
        static_cast<void>(end->send(packet, mn));
      }
    });
  }
  std::thread adapter([&] {
    for (std::int32_t um = 1; um <= kReports; ++um) {
      arm.publish(report_at(um), um);
      const auto newest = arm.newest();
      if (!newest) continue;
      const auto& force = newest->command.force_mn;
      if (force[1] != -force[0] || force[2] != force[0] || newest->at_ns != force[0] ||
          newest->command.answers != static_cast<std::uint32_t>(force[0])) {
        ++torn;
      }
    }
    is_over = true;
  });
  std::uint32_t last = 0, taken = 0;
  kerf::cartesian::ReportBytes packet;
  while (!is_over || end->waits()) {
    if (!end->take(packet)) continue;
    const auto report = kerf::decode_cartesian_report(packet);
    const auto um = static_cast<std::int32_t>(report ? report->number : 0);
    if (!report || report->number <= last ||
        report->position_um != std::array<std::int32_t, 3>{um, -um, 2 * um}) {
      ++torn;
    }
    last = report ? report->number : last;
    ++taken;
  }
  adapter.join();
  for (std::thread& sender : senders) sender.join();
  CHECK(torn == 0);
  CHECK(last == kReports);
  CHECK(taken + end->overrun() == kReports);
}

TEST_CASE("page: foreign bytes anywhere lead to packets that are accepted or refused, no more") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  arm.set_state(ArmState::running, "");
  const auto end = open_end();
  REQUIRE(end);
  const int file = open(kerf::ArmPage::path_of("touch").c_str(), O_RDWR);
  REQUIRE(file >= 0);
  auto* const bytes = static_cast<std::uint8_t*>(
      mmap(nullptr, kerf::arm_page::kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
  std::mt19937_64 random(20261128);
  constexpr int kRounds = 20'000;
  int accepted = 0, refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    switch (random() % 4) {
      case 0:  // a word with any value
        for (int i = 0; i < 8; ++i)
          bytes[random() % kerf::arm_page::kBytes] = static_cast<std::uint8_t>(random());
        break;
      case 1:  // the number of the newest report
        reinterpret_cast<std::uint64_t*>(bytes + 256)[0] = random() >> (random() % 64);
        break;
      case 2:
        arm.publish(report_at(round), round);
        break;
      default:
        static_cast<void>(end->send(forcing(static_cast<std::int16_t>(round)), round));
        break;
    }
    kerf::cartesian::ReportBytes packet;
    for (std::uint64_t i = 0; i < 2 * kerf::arm_page::kReports && end->take(packet); ++i) {
      ++(kerf::decode_cartesian_report(packet) ? accepted : refused);
    }
    static_cast<void>(arm.newest());
    CHECK(end->status().text.back() == 0);
    static_cast<void>(end->over());
  }
  CHECK(accepted > 0);
  munmap(bytes, kerf::arm_page::kBytes);
  close(file);
}

TEST_CASE("page: random bytes under a live lock are one line, by what they hold, or an arm") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("touch", Personality::touch, 1000);
  const int file = open(kerf::ArmPage::path_of("touch").c_str(), O_RDWR);
  const std::atomic<bool> stop{false};
  std::mt19937_64 random(7);
  constexpr std::size_t kDevice = 12, kLockstep = 20, kStatus = 128, kState = 136;
  constexpr std::uint8_t kTouch = static_cast<std::uint8_t>(Personality::touch);
  int texts_with_breaks = 0;
  for (int round = 0; round < 600; ++round) {
    CAPTURE(round);
    std::array<std::uint8_t, 400> head;
    for (auto& byte : head) byte = static_cast<std::uint8_t>(random());
    const char* says = ": of another version; start the kerf-arm of this one";
    if (round % 2 == 0) {  // a right magic and layout, and the rest random
      std::ranges::copy(
          std::array<std::uint8_t, 12>{'k', 'a', 'r', 'm', 'p', 'g', '1', 0, 2, 0, 0, 0},
          head.begin());
      head[kDevice] = static_cast<std::uint8_t>(random() % 8);
      head[13] = head[14] = head[15] = 0;
      std::fill_n(head.begin() + kLockstep, 4, std::uint8_t{0});
      head[kStatus] &= 0xfe;  // a text that nobody is writing
      says = head[kDevice] >= kerf::kPersonalityWords.size() ? says : " is of a ";
      if (round % 4 == 0) {  // and a state that may be one
        head[kDevice] = kTouch;
        std::fill_n(head.begin() + kState, 8, std::uint8_t{0});
        head[kState] = static_cast<std::uint8_t>(random() % 6);
      }
      if (head[kDevice] == kTouch) {
        const bool is_small = round % 4 == 0;
        says = is_small && head[kState] == 0   ? " is not ready"
               : is_small && head[kState] == 1 ? ""
                                               : " has ended";
        const auto text = std::span(head).subspan(144, 111);
        const auto end = std::ranges::find(text, 0);
        if (*says != 0 && std::find(text.begin(), end, '\n') != end) ++texts_with_breaks;
      }
    }
    REQUIRE(pwrite(file, head.data(), head.size(), 0) == static_cast<ssize_t>(head.size()));
    const std::string error = error_of<std::runtime_error>(
        [&] { kerf::ArmPort("touch", {Personality::touch}, 0, stop); });
    CAPTURE(error);
    CHECK(error.empty() == (*says == 0));
    CHECK(error.find(says) != std::string::npos);
    CHECK(std::ranges::none_of(error, [](char c) { return c >= 0 && c < ' '; }));
  }
  CHECK(texts_with_breaks > 20);
  close(file);
}

TEST_CASE("page: an adapter that sleeps is woken by a command, and by nothing else") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("inverse3", Personality::inverse3, 1000);
  arm.set_state(ArmState::running, "");
  kerf::ArmPageController::Absence absence{};
  std::string text;
  const auto end = kerf::ArmPageController::open("inverse3", Personality::inverse3, absence, text);
  REQUIRE(end);
  CHECK_FALSE(arm.await_command(0, kerf::monotonic_ns() + 1'000'000));
  constexpr std::int64_t kLongNs = 60'000'000'000;
  for (std::uint64_t ticket = 0; ticket < 1000; ++ticket) {
    std::thread sender([&] { end->send(encode(kerf::CartesianCommand{}), 1); });
    const bool is_woken = arm.await_command(ticket, kerf::monotonic_ns() + kLongNs);
    sender.join();
    REQUIRE(is_woken);
    REQUIRE(arm.newest()->ticket == ticket + 1);
  }
  CHECK(arm.await_command(0, 0));  // there already
  CHECK_FALSE(arm.await_command(1000, 0));
}

TEST_CASE("page: in lock-step a controller begins with the newest report, and its rate must fit") {
  const RuntimeFolder folder;
  ArmPageAdapter arm("inverse3", Personality::inverse3, 1000);
  arm.set_lockstep(500);
  for (int i = 1; i <= 3; ++i) arm.publish({}, i);
  arm.set_state(ArmState::running, "");
  const std::atomic<bool> stop{false};
  const auto error = [&](const kerf::LinkHello& ours) {
    return error_of<std::runtime_error>([&] { kerf::ArmPort("inverse3", ours, 0, stop); });
  };
  CHECK(error({Personality::inverse3, false, 500}).find("in lock-step") != std::string::npos);
  CHECK(error({Personality::inverse3, true, 1000}).find("at 500 Hz") != std::string::npos);
  kerf::ArmPort port("inverse3", {Personality::inverse3, true, 500}, 0, stop);
  CHECK(arm.has_controller());
  kerf::cartesian::ReportBytes packet;
  REQUIRE(port.receive(packet) == packet.size());
  CHECK(kerf::decode_cartesian_report(packet)->number == 3);
  CHECK(port.receive(packet) == 0);
}

}  // namespace kerf::arm_page_test
