// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <csignal>

#include <doctest/doctest.h>
#include <rapidcheck.h>
#include <sys/resource.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/posix/atomic_file.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

std::size_t files_in(const TempFolder& folder) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    static_cast<void>(entry);
    ++count;
  }
  return count;
}

/// While it lives no file may grow beyond `bytes`: a disk that is full there.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

VolumeImage noise(VoxelGrid grid) {
  VolumeImage image = air(grid);
  std::uint32_t state = 1;
  for (Density& d : image.density) {
    state = state * 1664525U + 1013904223U;
    d = static_cast<Density>(state >> 16);
  }
  return image;
}

}  // namespace

TEST_CASE("a written volume reads back the same: densities, labels, spacing, place, direction") {
  const TempFolder folder;
  CHECK(rc::check("round trip", [&] {
    const auto side = [] { return *rc::gen::inRange(1, 9); };
    VolumeImage image = noise({side(), side(), side()});
    image.density[0] = 0;
    image.density.back() = 65535;
    const auto mm = [] { return 0.001 * *rc::gen::inRange(1, 5000); };
    image.spacing_mm = {mm(), mm(), mm()};
    image.origin_mm = {mm() - 2.5, mm() - 2.5, mm() - 2.5};
    const double turn = mm();
    image.direction = {
        std::cos(turn), -std::sin(turn), 0, std::sin(turn), std::cos(turn), 0, 0, 0, 1};
    if (*rc::gen::arbitrary<bool>()) {
      for (const Density d : image.density) image.labels.push_back(static_cast<Label>(d % 4));
    }
    const auto encoding = *rc::gen::element(VolumeEncoding::gzip, VolumeEncoding::raw);
    const auto path = folder / "a.nrrd";
    write_volume(image, path, encoding);
    const SourceVolume source = read_volume(path);
    RC_PRE(image.density.size() > 1);
    VolumeImage back = apply_window(source, {0, kDensityMax});
    read_labels_beside(path, back);
    RC_ASSERT(back.grid == image.grid);
    RC_ASSERT(back.density == image.density);
    RC_ASSERT(back.labels == image.labels);
    for (std::size_t i = 0; i < 3; ++i) {
      RC_ASSERT(std::abs(back.spacing_mm[i] - image.spacing_mm[i]) < 1e-12);
      RC_ASSERT(std::abs(back.origin_mm[i] - image.origin_mm[i]) < 1e-12);
    }
    for (std::size_t i = 0; i < 9; ++i) {
      RC_ASSERT(std::abs(back.direction[i] - image.direction[i]) < 1e-12);
    }
  }));
}

TEST_CASE("labels lie beside the volume, and those of an earlier volume go away") {
  const TempFolder folder;
  CHECK(labels_path("dir/tooth.nrrd") == "dir/tooth-labels.nrrd");
  CHECK_THROWS_WITH_AS(
      check_volume_path("tooth-labels.nrrd"),
      "tooth-labels.nrrd: is the name of the labels of tooth.nrrd; give another one", LoadError);
  VolumeImage image = noise(kSmall);
  image.labels.assign(60, 2);
  write_volume(image, folder / "tooth.nrrd");
  CHECK(std::filesystem::exists(folder / "tooth-labels.nrrd"));
  image.labels.clear();
  write_volume(image, folder / "tooth.nrrd");
  CHECK_FALSE(std::filesystem::exists(folder / "tooth-labels.nrrd"));
  CHECK(files_in(folder) == 1);
}

TEST_CASE("labels that do not fit the volume beside them are refused") {
  const TempFolder folder;
  VolumeImage image = noise({2, 2, 2});
  image.labels.assign(8, 1);
  write_volume(image, folder / "tooth.nrrd");
  VolumeImage other = air(kSmall);
  CHECK_THROWS_WITH_AS(read_labels_beside(folder / "tooth.nrrd", other),
                       doctest::Contains("labels do not fit"), LoadError);
}

TEST_CASE("a full disk leaves the old volume as it was and nothing else") {
  const TempFolder folder;
  const auto path = folder / "a.nrrd";
  write_volume(noise(kSmall), path);
  const std::string before = read_bytes(path);
  VolumeImage large = noise({64, 64, 64});
  large.labels.assign(large.density.size(), 1);
  for (const auto encoding : {VolumeEncoding::gzip, VolumeEncoding::raw}) {
    const FullDisk full(100'000);
    try {
      write_volume(large, path, encoding);
      FAIL("written");
    } catch (const FileError& error) {
      CHECK(is_one_line(error.what()));
      CHECK(std::string(error.what()).find("cannot be written") != std::string::npos);
    }
  }
  CHECK(read_bytes(path) == before);
  CHECK(files_in(folder) == 1);
}

TEST_CASE("a folder that is not there and a name of another kind are refused") {
  const TempFolder folder;
  CHECK_THROWS_WITH_AS(write_volume(noise(kSmall), folder / "none/a.nrrd"),
                       doctest::Contains("cannot be written"), FileError);
  CHECK_THROWS_WITH_AS(write_volume(noise(kSmall), folder / "a.nii"),
                       doctest::Contains(".nrrd only"), LoadError);
  CHECK(files_in(folder) == 0);
}

TEST_CASE("a new file that is not committed never appears") {
  const TempFolder folder;
  {
    AtomicFile file(folder / "a.txt");
    file.write("half", 4);
  }
  CHECK(files_in(folder) == 0);
}
