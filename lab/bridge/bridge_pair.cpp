// SPDX-License-Identifier: Apache-2.0
#include "lab/bridge/bridge_pair.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/segment/segment.hpp"
#include "shared/text/text.hpp"

namespace kerf::two_machines {
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
