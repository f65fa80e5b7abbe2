// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/device/firewire/firewire_file.hpp"
#include "controller/device/firewire/firewire_streams.hpp"

using kerf::cycle_of_stamp;
using kerf::cycles_between;
using kerf::FirewireOptions;
using kerf::parse_firewire_port;

TEST_CASE("--port fw takes a place and options in any order after it") {
  CHECK(parse_firewire_port("").where == "");
  CHECK(parse_firewire_port(":/dev/fw1").where == "/dev/fw1");
  CHECK(parse_firewire_port(":50626300006").where == "50626300006");
  const FirewireOptions both = parse_firewire_port(":/tmp/bus,fill,20010");
  CHECK(both.where == "/tmp/bus");
  CHECK(both.fill);
  CHECK(both.write_20010);
  const FirewireOptions bare = parse_firewire_port(",20010");
  CHECK(bare.where == "");
  CHECK(bare.write_20010);
  CHECK_FALSE(bare.fill);
  CHECK_THROWS_WITH_AS(static_cast<void>(parse_firewire_port(":/dev/fw1,fast")),
                       "--port fw: 'fast' is not known; use 20010 or fill", std::runtime_error);
}

TEST_CASE("the serial number is unpacked as printed, whatever bit 0 says") {
  CHECK(kerf::firewire_serial(0x82B6'980C) == "50626300006");
  CHECK(kerf::firewire_serial(0x82B6'980D) == "50626300006");
  CHECK(kerf::firewire_serial(0x83A6'D80E) == "70427300007");
}

TEST_CASE("where no device is, one line says what to do") {
  FirewireOptions options;
  options.where = std::filesystem::temp_directory_path().string();
  CHECK_THROWS_WITH_AS(
      static_cast<void>(kerf::find_firewire(options)),
      doctest::Contains("no device of SensAble is there; connect one, or try ./kerf demo"),
      std::runtime_error);
  options.where = "/dev/fw-nothing";
  CHECK_THROWS_WITH_AS(
      static_cast<void>(kerf::find_firewire(options)),
      "--port fw:/dev/fw-nothing: no such node; --port fw finds the device by itself",
      std::runtime_error);
  options.where = "12345678901";
  CHECK_THROWS_WITH_AS(
      static_cast<void>(kerf::find_firewire(options, std::filesystem::temp_directory_path())),
      doctest::Contains("no device of SensAble with this serial number is there"),
      std::runtime_error);
  options.where = "/dev/null";  // it opens, and is something else
  CHECK_THROWS_WITH_AS(static_cast<void>(kerf::find_firewire(options)),
                       doctest::Contains("no device of SensAble"), std::runtime_error);
}

TEST_CASE("cycles are counted over the wrap of a stamp's eight seconds") {
  CHECK(cycle_of_stamp(0x0000) == 0);
  CHECK(cycle_of_stamp(1U << 13 | 5) == 8005);
  CHECK(cycle_of_stamp(0xFFFF'0000U | 7U << 13 | 7999) == 63'999);
  CHECK(cycles_between(0, 8) == 8);
  CHECK(cycles_between(8, 0) == -8);
  CHECK(cycles_between(63'999, 1) == 2);
  CHECK(cycles_between(1, 63'999) == -2);
  CHECK(cycles_between(0, 31'999) == 31'999);
}
