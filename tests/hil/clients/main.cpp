// SPDX-License-Identifier: Apache-2.0
// The hosts of this folder as a program, for the guest: `test_hil_clients nifalcon`, or
// `test_hil_clients raw1394 FOLDER`. What it finds is printed, a line each; it waits for its
// device.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/hil/clients/nifalcon_client.hpp"
#include "tests/hil/clients/raw1394_client.hpp"

namespace {

using kerf::test::NifalconClient;
using kerf::test::Raw1394Client;

constexpr int kExchanges = 500;
constexpr std::size_t kFirmwareBytes = 1000;  // the emulated Falcon takes any

/// What `make` makes, as soon as it can; the last reason after 10 s.
template <class Client>
std::unique_ptr<Client> patiently(const std::function<std::unique_ptr<Client>()>& make) {
  constexpr int kTries = 500;
  for (int i = 1;; ++i) {
    try {
      return make();
    } catch (const std::runtime_error&) {
      if (i == kTries) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

std::unique_ptr<NifalconClient> open_falcon() {
  return patiently<NifalconClient>([] { return std::make_unique<NifalconClient>(); });
}

void speak_as_nifalcon() {
  auto client = open_falcon();
  std::printf("nifalcon before %d\n", client->firmware_answers() ? 1 : 0);
  std::printf("nifalcon reads %d\n", client->reads() ? 1 : 0);
  std::vector<std::uint8_t> firmware(kFirmwareBytes);
  for (std::size_t i = 0; i < firmware.size(); ++i) firmware[i] = static_cast<std::uint8_t>(i * 7);
  const std::string failure = client->load(firmware);
  std::printf("nifalcon load %s\n", failure.empty() ? "ok" : failure.c_str());
  std::printf("nifalcon after %d\n", client->firmware_answers() ? 1 : 0);
  int answers = 0;
  for (int i = 0; i < kExchanges; ++i) {
    answers += client->exchange({.homing = true, .blue = true}) ? 1 : 0;
  }
  std::printf("nifalcon exchanges %d\n", answers);
  std::printf("nifalcon closes with a read %d\n", client->reads() ? 1 : 0);
  client.reset();
  client = open_falcon();
  std::printf("nifalcon again %d\n", client->firmware_answers() ? 1 : 0);
}

void speak_as_raw1394(const std::string& folder) {
  const auto client =
      patiently<Raw1394Client>([&] { return std::make_unique<Raw1394Client>(folder); });
  std::printf("raw1394 local %s\n", client->local_path().substr(folder.size()).c_str());
  std::printf("raw1394 nodes %d\n", client->node_count());
  const std::uint32_t manager = client->manager_id();
  const auto get = [&](std::uint64_t offset) { return client->read(manager, offset).quadlet(); };
  std::printf("raw1394 bus manager %u\n", get(Raw1394Client::kBusManager));
  std::printf("raw1394 takes %d %d\n", client->take_channel(0) ? 1 : 0,
              client->take_bandwidth(915) ? 1 : 0);
  std::printf("raw1394 again takes %d\n", client->take_channel(0) ? 1 : 0);
  std::printf("raw1394 left %u %08x\n", get(Raw1394Client::kBandwidth),
              get(Raw1394Client::kChannelsLow));
  std::printf("raw1394 resets %d\n", client->reset_bus() ? 1 : 0);
  std::printf("raw1394 after reset left %u %08x\n", get(Raw1394Client::kBandwidth),
              get(Raw1394Client::kChannelsLow));
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string_view who = argc > 1 ? argv[1] : "";
  if (who == "nifalcon" && argc == 2) {
    speak_as_nifalcon();
  } else if (who == "raw1394" && argc == 3) {
    speak_as_raw1394(argv[2]);
  } else {
    std::fputs("test_hil_clients: say nifalcon, or raw1394 FOLDER\n", stderr);
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "test_hil_clients: %s\n", error.what());
  return 1;
}
