// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/plain_client.hpp"

using kerf::test::MountedNode;
using kerf::test::PlainClient;

TEST_CASE("a node can be opened and asked who it is") {
  const MountedNode mounted;
  const PlainClient client(mounted.path());
  REQUIRE(client.fd() >= 0);
  CHECK(client.info() == 1);
  std::uint32_t rom[8]{};
  fw_cdev_get_info info{};
  info.version = 5;
  info.rom = reinterpret_cast<std::uintptr_t>(rom);
  info.rom_length = sizeof rom;
  CHECK(client.call(FW_CDEV_IOC_GET_INFO, &info) == 0);
  CHECK((rom[3] >> 8) == 0x000B99);
}
