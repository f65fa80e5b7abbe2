// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/bridge/two_machines.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/segment/segment.hpp"
#include "shared/text/text.hpp"

namespace kerf::two_machines {

namespace {

constexpr const char* kDevice = "link0";
constexpr const char* kOwnNetwork = "/proc/thread-self/ns/net";
constexpr std::size_t kLargestPacket = 65536;

[[noreturn]] void fail(const std::string& what) {
  throw NoNamespaces(what + ": " + system_message(errno));
}

void put(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) fail(path);
}

[[nodiscard]] ifreq request_for(const char* device) {
  ifreq out{};
  std::strncpy(out.ifr_name, device, IFNAMSIZ - 1);
  return out;
}

[[nodiscard]] File socket_of_any_kind() {
  return File(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
}

void bring(const File& any_socket, const char* device, bool up) {
  ifreq request = request_for(device);
  request.ifr_flags = up ? IFF_UP | IFF_RUNNING : 0;
  if (ioctl(any_socket.get(), SIOCSIFFLAGS, &request) != 0) {
    fail(std::string(device) + (up ? " up" : " down"));
  }
}

void set_address(const File& any_socket, const char* device, const char* address, int call) {
  ifreq request = request_for(device);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  inet_pton(AF_INET, address, &place.sin_addr);
  std::memcpy(&request.ifr_addr, &place, sizeof place);
  if (ioctl(any_socket.get(), static_cast<unsigned long>(call), &request) != 0) {
    fail(std::string("address ") + address);
  }
}

}  // namespace

File::File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
File& File::operator=(File&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}
File::~File() {
  if (fd_ >= 0) close(fd_);
}

void enter_user_namespace() {
  if (unshare(CLONE_NEWNET) == 0) return;  // has the right
  const std::string user = std::to_string(geteuid()), group = std::to_string(getegid());
  if (unshare(CLONE_NEWUSER) != 0) fail("user namespace");
  put("/proc/self/setgroups", "deny");
  put("/proc/self/uid_map", "0 " + user + " 1");
  put("/proc/self/gid_map", "0 " + group + " 1");
}

TwoNetworks::TwoNetworks(const LinkSettings& settings)
    : settings_(settings), home_(open(kOwnNetwork, O_RDONLY | O_CLOEXEC)) {
  near_ = make(kNearAddress);
  far_ = make(kFarAddress);
  if (setns(home_.get(), CLONE_NEWNET) != 0) fail("way back");
  stop_ = File(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  relay_ = std::thread([this] { relay(); });
}

TwoNetworks::~TwoNetworks() {
  eventfd_write(stop_.get(), 1);
  relay_.join();
}

TwoNetworks::Machine TwoNetworks::make(const char* address) const {
  if (unshare(CLONE_NEWNET) != 0) fail("network namespace");
  Machine out{File(open(kOwnNetwork, O_RDONLY | O_CLOEXEC)),
              File(open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC))};
  if (out.network.get() < 0) fail(kOwnNetwork);
  if (out.device.get() < 0) fail("/dev/net/tun");
  ifreq request = request_for(kDevice);
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (ioctl(out.device.get(), TUNSETIFF, &request) != 0) fail("TUN device");
  const File any_socket = socket_of_any_kind();
  set_address(any_socket, kDevice, address, SIOCSIFADDR);
  set_address(any_socket, kDevice, "255.255.255.0", SIOCSIFNETMASK);
  bring(any_socket, kDevice, true);
  bring(any_socket, "lo", true);
  return out;
}

std::unique_ptr<sweep::Child> TwoNetworks::start(Side side,
                                                 const std::vector<std::string>& arguments,
                                                 const std::filesystem::path& output) const {
  const Machine& machine = side == Side::near ? near_ : far_;
  if (setns(machine.network.get(), CLONE_NEWNET) != 0) fail("entering a network");
  auto child = std::make_unique<sweep::Child>(arguments, output);
  if (setns(home_.get(), CLONE_NEWNET) != 0) fail("way back");
  return child;
}

void TwoNetworks::set_interface(Side side, bool up) const {
  const Machine& machine = side == Side::near ? near_ : far_;
  if (setns(machine.network.get(), CLONE_NEWNET) != 0) fail("entering a network");
  bring(socket_of_any_kind(), kDevice, up);
  if (setns(home_.get(), CLONE_NEWNET) != 0) fail("way back");
}

void TwoNetworks::relay() {
  struct Way {
    int in, out;
    Link link;
  };
  std::array<Way, 2> ways{{{near_.device.get(), far_.device.get(), Link(settings_, 0)},
                           {far_.device.get(), near_.device.get(), Link(settings_, 1)}}};
  std::vector<std::byte> buffer(kLargestPacket);
  for (;;) {
    std::int64_t next_ns = monotonic_ns() + kNsPerSecond;
    for (Way& way : ways) {
      while (const auto packet = way.link.take(monotonic_ns())) {
        const ssize_t written = write(way.out, packet->data(), packet->size());
        if (written > 0 && &way == ways.data()) bytes_to_far_ += packet->size();
      }
      next_ns = std::min(next_ns, way.link.next_ns().value_or(next_ns));
    }
    const std::int64_t wait_ns = std::max<std::int64_t>(next_ns - monotonic_ns(), 0);
    const timespec wait{wait_ns / kNsPerSecond, wait_ns % kNsPerSecond};
    std::array<pollfd, 3> polled{
        {{ways[0].in, POLLIN, 0}, {ways[1].in, POLLIN, 0}, {stop_.get(), POLLIN, 0}}};
    if (ppoll(polled.data(), polled.size(), &wait, nullptr) > 0 && polled[2].revents != 0) return;
    for (Way& way : ways) {
      for (ssize_t n = 0; (n = read(way.in, buffer.data(), buffer.size())) > 0;) {
        if (cut_) continue;
        const auto packet = std::span(buffer).first(static_cast<std::size_t>(n));
        static_cast<void>(way.link.offer(monotonic_ns(), {packet.begin(), packet.end()}));
      }
    }
  }
}

namespace {

constexpr const char* kPort = "7400";
constexpr std::chrono::milliseconds kStopLook{50};

/// Runs to its end; throws with its last line if it failed.
void run_to_end(sweep::Child& child, const std::string& what) {
  while (!child.ended()) pause(std::chrono::milliseconds(2));
  if (*child.ended() != 0) throw HilError(what + ": " + child.last_line());
}

}  // namespace

void pause(std::chrono::nanoseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  for (auto left = time; left.count() > 0; left = end - std::chrono::steady_clock::now()) {
    if (stop_requested()) throw HilError("stopped");
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, kStopLook));
  }
}

WorkFolder::WorkFolder() : folder_("kerf-bridge") {
  setenv("XDG_RUNTIME_DIR", path().c_str(), 1);  // NOLINT(concurrency-mt-unsafe): first thread
}

BridgeFiles::BridgeFiles(std::filesystem::path in)
    : folder(std::move(in)),
      program(sweep::program_beside("bridge")),
      certificate(folder / "cert.pem"),
      key(folder / "key.pem"),
      token_file(folder / "tokens"),
      token(hex64(random_session_id()) + hex64(random_session_id())) {
  std::ofstream(token_file) << token << '\n';
  using std::filesystem::perms;
  std::filesystem::permissions(token_file, perms::owner_read | perms::owner_write);
  sweep::Child make(
      {"openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "group:P-256", "-noenc", "-subj",
       "/CN=near", "-addext", std::string("subjectAltName=IP:") + TwoNetworks::kNearAddress,
       "-keyout", key, "-out", certificate},
      folder / "openssl.log");
  run_to_end(make, "openssl");
}

BridgePair::BridgePair(const TwoNetworks& networks, const BridgeFiles& files, bool dedicated_link)
    : networks_(networks), files_(files), dedicated_link_(dedicated_link) {
  start_serve();
}

void BridgePair::start_serve() {
  std::vector<std::string> arguments{
      files_.program, "serve",
      "--listen",     std::string(TwoNetworks::kNearAddress) + ":" + kPort,
      "--name",       kNearName,
      "--cert",       files_.certificate,
      "--key",        files_.key,
      "--token-file", files_.token_file};
  if (dedicated_link_) arguments.emplace_back("--dedicated-link");
  serve_ = networks_.start(TwoNetworks::Side::near, arguments, files_.folder / "serve.log");
}

void BridgePair::require_serve() {
  if (serve_->ended()) throw HilError(serve_->last_line());
}

void BridgePair::kill_serve() {
  serve_->signal(SIGKILL);
  while (!serve_->ended()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

std::unique_ptr<sweep::Child> BridgePair::join(const std::string& name) const {
  return networks_.start(
      TwoNetworks::Side::far,
      {files_.program, "join", std::string("wss://") + TwoNetworks::kNearAddress + ":" + kPort,
       "--token-file", files_.token_file, "--ca", files_.certificate, "--name", name},
      files_.folder / (name + ".log"));
}

ProcessCost cost_of(const sweep::Child& process) {
  const std::string folder = "/proc/" + std::to_string(process.pid());
  std::ifstream stat(folder + "/stat");
  std::string text;
  std::getline(stat, text);
  // Fields 14 and 15; the second may hold spaces and ends with the last ')'.
  std::istringstream fields(text.substr(std::min(text.rfind(')') + 2, text.size())));
  std::string skipped;
  for (int i = 3; i < 14; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  ProcessCost out;
  out.cpu_s = (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  std::ifstream status(folder + "/status");
  for (std::string line; std::getline(status, line);) {
    std::istringstream words(line);
    std::string name;
    double kib = 0;
    words >> name >> kib;
    if (name == "RssAnon:" || name == "RssFile:") out.own_mib += kib / 1024;
  }
  return out;
}

}  // namespace kerf::two_machines
