// SPDX-License-Identifier: Apache-2.0
#include "standin/emulated_arm.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/sockets.hpp"
#include "shared/wire/emulator_link.hpp"

namespace kerf::standin {
namespace {

constexpr int kPatienceMs = 5000;  // a loaded machine, or an emulator that ends its last client

[[nodiscard]] bool readable(int fd, int timeout_ms) noexcept {
  pollfd waiting{fd, POLLIN, 0};
  int ready = -1;
  while ((ready = poll(&waiting, 1, timeout_ms)) < 0 && errno == EINTR) {
  }
  return ready > 0;
}

}  // namespace

EmulatedArm::EmulatedArm(const Settings& settings, const DeviceSettings& device, Ledger& ledger,
                         Follow follow)
    : ledger_(ledger),
      follow_(std::move(follow)),
      hand_waits_(settings.hand_waits),
      lockstep_(settings.lockstep) {
  try {
    connect_to(device.socket);
    agree(device);
  } catch (...) {
    if (fd_ >= 0) close(fd_);
    throw;
  }
}

EmulatedArm::EmulatedArm(const Settings& settings, const DeviceSettings& device, const Pose& still,
                         Ledger& ledger) noexcept
    : ledger_(ledger),
      closed_(true),
      is_still_(true),
      hand_waits_(settings.hand_waits),
      lockstep_(settings.lockstep),
      report_hz_(device.rate_hz) {
  history_[newest_] = still;
  known_ = 1;
}

EmulatedArm::~EmulatedArm() {
  if (fd_ < 0) return;
  // A child by `fork` has the socket too: the emulator would go on with a client that has closed.
  if (opener_ == getpid()) shutdown(fd_, SHUT_RDWR);
  close(fd_);
}

void EmulatedArm::connect_to(const std::string& path) {
  if (path.size() >= sizeof(sockaddr_un::sun_path)) {
    throw std::runtime_error(path + ": a socket path has at most " +
                             std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                             " bytes; use a shorter one");
  }
  const sockaddr_un address = unix_address(path);
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the sockets API asks for it
  if (fd_ < 0 || connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error(path + ": no device answers (" +
                             std::generic_category().message(errno) +
                             "); start the program by ./kerf stand-in -- COMMAND");
  }
}

void EmulatedArm::agree(const DeviceSettings& device) {
  const LinkHello ours{device.kind, lockstep_, device.rate_hz};
  const HelloBytes hello = encode(ours);
  bool is_agreed =
      send(fd_, hello.data(), hello.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(hello.size());
  const std::int64_t give_up_ns = monotonic_ns() + std::int64_t{kPatienceMs} * 1'000'000;
  for (bool is_answered = false; is_agreed && !is_answered;) {
    std::array<std::uint8_t, Turn::kMostBytes> packet;
    is_agreed = monotonic_ns() < give_up_ns && readable(fd_, kPatienceMs);
    const ssize_t size = is_agreed ? recv(fd_, packet.data(), packet.size(), 0) : 0;
    is_agreed = is_agreed && size > 0;
    const auto theirs = is_agreed
                            ? decode_hello(std::span(packet).first(static_cast<std::size_t>(size)))
                            : std::nullopt;
    if (!theirs) continue;  // a report from before the answer
    if (const std::string reason = discord(ours, *theirs); !reason.empty()) {
      throw std::runtime_error(device.socket + ": " + reason);
    }
    report_hz_ = theirs->rate_hz;
    is_answered = true;
  }
  while (is_agreed && known_ == 0 && !closed_) is_agreed = take(kPatienceMs);
  if (is_agreed && known_ > 0) return;
  throw std::runtime_error(device.socket +
                           ": the emulator serves another program, or has ended; end that "
                           "program, or start this one by ./kerf stand-in -- COMMAND");
}

void EmulatedArm::refresh() noexcept {
  while (take(0)) {
  }
}

bool EmulatedArm::take(int timeout_ms) noexcept {
  if (closed_ || !readable(fd_, timeout_ms)) return false;
  std::array<std::uint8_t, Turn::kMostBytes> datagram;
  const ssize_t size = recv(fd_, datagram.data(), datagram.size(), MSG_DONTWAIT);
  if (size <= 0) {
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return false;
    closed_ = true;
    return false;
  }
  auto bytes = std::span<const std::uint8_t>(datagram).first(static_cast<std::size_t>(size));
  if (!Turn::is_turn(bytes)) {
    take_packet(bytes);
    return true;
  }
  bytes = bytes.subspan(Turn::kMagic.size());
  for (auto packet = Turn::next(bytes); !packet.empty(); packet = Turn::next(bytes)) {
    take_packet(packet);
  }
  return true;
}

void EmulatedArm::take_packet(std::span<const std::uint8_t> bytes) noexcept {
  const auto report = decode_cartesian_report(bytes);
  if (!report) return;
  const auto newer = static_cast<std::int32_t>(report->number - pose().number);
  if (known_ > 0 && newer <= 0) return;  // repeated, or overtaken
  const double dt_s = known_ > 0 ? newer / report_hz_ : 0;
  heard_ns_ = monotonic_ns();
  silent_ticks_ = 0;
  newest_ = (newest_ + 1) % kHistory;
  known_ = std::min(known_ + 1, kHistory);
  Pose& pose = history_[newest_];
  const auto& um = report->position_um;
  const auto& mn = report->force_mn;
  pose.number = report->number;
  pose.tip_mm = {um[0] / 1000.0, um[1] / 1000.0, um[2] / 1000.0};
  for (std::size_t i = 0; i < 4; ++i) {
    pose.orientation[i] = report->orientation[i] / cartesian::kQuaternionOne;
  }
  pose.applied_n =
      DeviceVec<double>{mn[0] / 1.0, mn[1] / 1.0, mn[2] / 1.0} * cartesian::kNewtonsPerCount;
  pose.button1 = report->button1;
  pose.button2 = report->button2;
  pose.parked = report->parked;
  if (follow_) follow_(pose, dt_s);
}

void EmulatedArm::command(DeviceVec<double> force_n, bool on, bool ready) noexcept {
  if (closed_) {
    if (lockstep_) std::this_thread::sleep_for(std::chrono::duration<double>(1 / report_hz_));
    return;
  }
  CartesianCommand command;
  command.force_mn = {cartesian::packed_n(force_n.x), cartesian::packed_n(force_n.y),
                      cartesian::packed_n(force_n.z)};
  // What the emulated hand waits for before it takes the arm.
  if (norm(force_n) > 0) hand_waits_ = false;
  command.force_on = on && !hand_waits_;
  command.light =
      ready && !hand_waits_ ? CartesianCommand::Light::ready : CartesianCommand::Light::asks;
  command.answers = pose().number;
  const auto bytes = encode(command);
  if (send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno == EPIPE) {
    refresh();  // finds the end
    return;
  }
  ledger_.set(Row::last_n, on ? norm(force_n) : 0.0);
  if (!lockstep_) return;
  ++silent_ticks_;
  static_cast<void>(take(kPatienceMs));
}

void EmulatedArm::count_command(double wanted_n) noexcept {
  if (closed_ && !is_still_) return;
  ledger_.record_force_n(wanted_n);
}

const Pose* EmulatedArm::oldest_within(double window_s) const noexcept {
  const double reach = window_s * report_hz_;
  const Pose* oldest = nullptr;
  for (std::size_t back = 1; back < known_; ++back) {
    const Pose& earlier = history_[(newest_ + kHistory - back) % kHistory];
    if (pose().number - earlier.number > reach + 0.5) break;
    oldest = &earlier;
  }
  return oldest;
}

std::optional<DeviceVec<double>> EmulatedArm::velocity(double window_s) const noexcept {
  const Pose* from = oldest_within(window_s);
  if (from == nullptr) return std::nullopt;
  return (pose().tip_mm - from->tip_mm) * (report_hz_ / (pose().number - from->number));
}

DeviceVec<double> EmulatedArm::angular_velocity(double window_s) const noexcept {
  const Pose* from = oldest_within(window_s);
  if (from == nullptr) return {};
  // The rotation from the older to the newer pose: newer * conjugate(older).
  const auto& b = pose().orientation;
  const auto& a = from->orientation;
  const DeviceVec<double> old{a[0], a[1], a[2]}, now{b[0], b[1], b[2]};
  const double w = b[3] * a[3] + dot(now, old);
  const DeviceVec<double> axis = now * a[3] - old * b[3] - cross(now, old);
  const double sine = norm(axis);
  if (sine < 1e-9) return {};
  const double angle = 2 * std::atan2(sine, std::abs(w)) * (w < 0 ? -1 : 1);
  return axis * (angle / sine * report_hz_ / (pose().number - from->number));
}

bool EmulatedArm::lost() noexcept {
  if (is_still_) return false;
  const double silent_s = lockstep_
                              ? silent_ticks_ / report_hz_
                              : static_cast<double>(monotonic_ns() - heard_ns_) / kNsPerSecond;
  const bool is_lost = closed_ || silent_s > kSilenceS;
  if (is_lost && !was_lost_) ledger_.add(Row::lost_link);
  was_lost_ = is_lost;
  return is_lost;
}

}  // namespace kerf::standin
