// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <string>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "shared/segment/reader.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::seal_test {

using namespace kerf::test;

namespace {

void check_refuses_writes(int fd) {
  errno = 0;
  CHECK(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) == MAP_FAILED);
  CHECK(errno == EPERM);
  const char byte = 1;
  CHECK(pwrite(fd, &byte, 1, 0) == -1);
  CHECK(ftruncate(fd, 0) == -1);
  CHECK(ftruncate(fd, 1 << 30) == -1);
  void* const read_only = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, fd, 0);
  REQUIRE(read_only != MAP_FAILED);
  CHECK(mprotect(read_only, 4096, PROT_READ | PROT_WRITE) == -1);
  munmap(read_only, 4096);
}

}  // namespace

TEST_CASE("the seals refuse every way to write or to resize") {
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  check_refuses_writes(writer.fd());
  const int again = open(("/proc/self/fd/" + std::to_string(writer.fd())).c_str(), O_RDWR);
  REQUIRE(again >= 0);
  check_refuses_writes(again);
  close(again);
  CHECK(fcntl(writer.fd(), F_ADD_SEALS, F_SEAL_WRITE) == -1);
}

TEST_CASE("memory that could shrink under the reader is refused") {
  const int fd = memfd_create("unsealed", MFD_ALLOW_SEALING);
  REQUIRE(ftruncate(fd, 1 << 20) == 0);
  CHECK_THROWS_WITH_AS(static_cast<void>(SegmentReader::map(fd)), doctest::Contains("not sealed"),
                       SegmentError);
  close(fd);
}

TEST_CASE("a spec that cannot be is refused with place and value") {
  const NoiseVolume volume({8, 8, 8});
  const auto error_of = [](const SegmentSpec& spec) -> std::string {
    try {
      static_cast<void>(SegmentWriter::create(spec));
    } catch (const SegmentError& error) {
      return error.what();
    }
    return "accepted";
  };
  SegmentSpec spec = spec_of(volume);
  spec.volumes.resize(9, spec.volumes[0]);
  CHECK(error_of(spec).find("9 volumes") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes.clear();
  CHECK(error_of(spec).find("0 volumes") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes[0].grid.nx = 9;
  CHECK(error_of(spec).find("512 densities") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes[0].grid = {65536, 1, 1};
  CHECK(error_of(spec).find("65536") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes[0].grid = {65535, 65535, 65535};
  CHECK(error_of(spec).find("1024^3") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes[0].labels = std::span<const Label>(reinterpret_cast<const Label*>(""), 1);
  CHECK(error_of(spec).find("1 labels") != std::string::npos);
  spec = spec_of(volume);
  spec.volumes[0].spacing_mm[1] = 0;
  CHECK(error_of(spec).find("spacing") != std::string::npos);
  spec = spec_of(volume);
  spec.tick_ns = 0;
  CHECK(error_of(spec).find("tick") != std::string::npos);
  spec = spec_of(volume);
  spec.arms = 3;
  CHECK(error_of(spec) == "segment: 3 arms; a scene has 1 to 2");
  spec.arms = 0;
  CHECK(error_of(spec) == "segment: 0 arms; a scene has 1 to 2");
}

}  // namespace kerf::seal_test
