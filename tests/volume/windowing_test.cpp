// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/windowing.hpp"

#include <cmath>
#include <csignal>
#include <limits>

#include <doctest/doctest.h>
#include <sys/resource.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "shared/posix/atomic_file.hpp"
#include "tests/support/property.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::windowing_test {

using namespace kerf::test;

namespace {

/// Of values that outlive it.
SourceVolume source(std::vector<float>& values) {
  SourceVolume v;
  v.grid = {static_cast<std::int32_t>(values.size()), 1, 1};
  v.spacing_mm = {0.5, 0.25, 2};
  v.origin_mm = {1, 2, 3};
  v.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  v.values = VoxelValues(values);
  v.min = static_cast<double>(*std::min_element(values.begin(), values.end()));
  v.max = static_cast<double>(*std::max_element(values.begin(), values.end()));
  return v;
}

VolumeImage row(const std::vector<Density>& densities) {
  VolumeImage image = air({static_cast<std::int32_t>(densities.size()), 1, 1});
  image.density = densities;
  return image;
}

}  // namespace

TEST_CASE("the window of the range maps the ends to 0 and 65535 and rounds to the nearest") {
  std::vector<float> values{-1000, 0, 1000, 500.01F};
  const SourceVolume v = source(values);
  const Window window = range_window(v);
  CHECK(window.lo == -1000);
  CHECK(window.hi == 1000);
  const VolumeImage image = apply_window(v, window);
  CHECK(image.density == std::vector<Density>{0, 32768, 65535, 49152});  // 32767.5 rounds up
  CHECK(image.spacing_mm == v.spacing_mm);
  CHECK(image.origin_mm == v.origin_mm);
  CHECK(image.direction == v.direction);
}

TEST_CASE("values outside a window are clamped") {
  std::vector<float> values{-3000, 0, 50, 100, 4000};
  const VolumeImage image = apply_window(source(values), {0, 100});
  CHECK(image.density == std::vector<Density>{0, 0, 32768, 65535, 65535});
}

TEST_CASE("a window without width is refused, and a uniform file is named as the reason") {
  std::vector<float> fives{5, 5, 5};
  const SourceVolume uniform = source(fives);
  CHECK_THROWS_WITH_AS(static_cast<void>(apply_window(uniform, range_window(uniform))),
                       doctest::Contains("nothing to see"), LoadError);
  for (const Window bad :
       {Window{2, 1}, Window{1, 1}, Window{0, std::numeric_limits<double>::infinity()},
        Window{std::numeric_limits<double>::quiet_NaN(), 1}}) {
    std::vector<float> values{0, 1};
    CHECK_THROWS_AS(static_cast<void>(apply_window(source(values), bad)), LoadError);
  }
}

TEST_CASE("windowing is monotonic and within half a step of the straight line") {
  CHECK(property([] {
    std::vector<float> values(20);
    for (float& value : values) value = 0.1F * static_cast<float>(in_range(-30000, 30000));
    const SourceVolume v = source(values);
    if (!(v.min < v.max)) discard();
    const VolumeImage image = apply_window(v, range_window(v));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double exact = (static_cast<double>(values[i]) - v.min) / (v.max - v.min) * 65535;
      HOLDS(std::abs(image.density[i] - exact) <= 0.5 + 1e-6);
    }
  }));
}

TEST_CASE("Otsu parts two groups in the middle of the gap between them") {
  std::vector<Density> densities;
  for (int i = 0; i < 900; ++i) densities.push_back(static_cast<Density>(10000 + i % 100));
  for (int i = 0; i < 100; ++i) densities.push_back(static_cast<Density>(50000 + i % 100));
  const Density threshold = otsu_threshold(row(densities));
  CHECK(threshold == doctest::Approx((10100 + 50000) / 2).epsilon(0.01));
}

TEST_CASE("Otsu puts every voxel of the upper group at or above the threshold") {
  CHECK(property([] {
    const auto low = in_range(0, 65535 - 32);
    const auto high = in_range(low + 32, 65536);  // not in the same bin of 16
    const auto share = in_range<std::size_t>(1, 100);
    std::vector<Density> densities(100, static_cast<Density>(low));
    std::fill_n(densities.begin(), share, static_cast<Density>(high));
    const Density threshold = otsu_threshold(row(densities));
    HOLDS(low < threshold);
    HOLDS(threshold <= high);
  }));
}

TEST_CASE("Otsu of a uniform volume is the middle of the range") {
  CHECK(otsu_threshold(row({7, 7, 7})) == 32768);
}

TEST_CASE("the solid box is the tightest one, and empty when nothing is solid") {
  VolumeImage image = air({9, 8, 7});
  CHECK(solid_box(image, 1).empty());
  image.density[image.grid.index(2, 3, 4)] = 100;
  CHECK(solid_box(image, 100) == VoxelBox{{2, 3, 4}, {3, 4, 5}});
  CHECK(solid_box(image, 101).empty());
  image.density[image.grid.index(8, 0, 6)] = 200;
  CHECK(solid_box(image, 100) == VoxelBox{{2, 0, 4}, {9, 4, 7}});
}

namespace {

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
  const TemporaryFolder folder;
  CHECK(property([&] {
    const auto side = [] { return in_range(1, 9); };
    VolumeImage image = noise({side(), side(), side()});
    image.density[0] = 0;
    image.density.back() = 65535;
    const auto mm = [] { return 0.001 * in_range(1, 5000); };
    image.spacing_mm = {mm(), mm(), mm()};
    image.origin_mm = {mm() - 2.5, mm() - 2.5, mm() - 2.5};
    const double turn = mm();
    image.direction = {
        std::cos(turn), -std::sin(turn), 0, std::sin(turn), std::cos(turn), 0, 0, 0, 1};
    if (any<bool>()) {
      for (const Density d : image.density) image.labels.push_back(static_cast<Label>(d % 4));
    }
    const auto encoding = any<bool>() ? VolumeEncoding::gzip : VolumeEncoding::raw;
    const auto path = folder / "a.nrrd";
    write_volume(image, path, encoding);
    const SourceVolume source = read_volume(path);
    if (!(image.density.size() > 1)) discard();
    VolumeImage back = apply_window(source, {0, kDensityMax});
    read_labels_beside(path, back);
    HOLDS(back.grid == image.grid);
    HOLDS(back.density == image.density);
    HOLDS(back.labels == image.labels);
    for (std::size_t i = 0; i < 3; ++i) {
      HOLDS(std::abs(back.spacing_mm[i] - image.spacing_mm[i]) < 1e-12);
      HOLDS(std::abs(back.origin_mm[i] - image.origin_mm[i]) < 1e-12);
    }
    for (std::size_t i = 0; i < 9; ++i) {
      HOLDS(std::abs(back.direction[i] - image.direction[i]) < 1e-12);
    }
  }));
}

TEST_CASE("labels lie beside the volume, and those of an earlier volume go away") {
  const TemporaryFolder folder;
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
  CHECK(folder.count() == 1);
}

TEST_CASE("labels that do not fit the volume beside them are refused") {
  const TemporaryFolder folder;
  VolumeImage image = noise({2, 2, 2});
  image.labels.assign(8, 1);
  write_volume(image, folder / "tooth.nrrd");
  VolumeImage other = air(kSmall);
  CHECK_THROWS_WITH_AS(read_labels_beside(folder / "tooth.nrrd", other),
                       doctest::Contains("labels do not fit"), LoadError);
  // Halves of labels would become other labels.
  static_cast<void>(
      folder.write("float-labels.nrrd", nrrd("float", "endian: little\n" + kSpacings) + "\n" +
                                            bytes_of(std::vector<float>(60, 1.5F))));
  CHECK_THROWS_WITH_AS(read_labels_beside(folder / "float.nrrd", other),
                       doctest::Contains("whole values"), LoadError);
}

TEST_CASE("labels of another frame than the volume's are refused, those without a frame are not") {
  const TemporaryFolder folder;
  VolumeImage image = air(kSmall);
  image.spacing_mm = {1, 2, 3};
  image.origin_mm = {10, 20, 30};
  image.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  image.labels.assign(60, 1);
  write_volume(image, folder / "tooth.nrrd");
  read_labels_beside(folder / "tooth.nrrd", image);
  VolumeImage moved = image, mirrored = image;
  moved.origin_mm[2] += 0.4;  // less than half a voxel
  CHECK_NOTHROW(read_labels_beside(folder / "tooth.nrrd", moved));
  moved.origin_mm[2] += 0.2;
  mirrored.direction = {0, 1, 0, 1, 0, 0, 0, 0, -1};
  for (VolumeImage* other : {&moved, &mirrored}) {
    CHECK_THROWS_WITH_AS(read_labels_beside(folder / "tooth.nrrd", *other),
                         doctest::Contains("labels lie elsewhere"), LoadError);
  }
  static_cast<void>(
      folder.write("plain-labels.nrrd", nrrd("uint8", "") + "\n" + std::string(60, '\1')));
  CHECK_NOTHROW(read_labels_beside(folder / "plain.nrrd", image));
}

TEST_CASE("a full disk leaves the old volume as it was and nothing else") {
  const TemporaryFolder folder;
  const auto path = folder / "a.nrrd";
  write_volume(noise(kSmall), path);
  const std::string before = text_of(path);
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
  CHECK(text_of(path) == before);
  CHECK(folder.count() == 1);
}

TEST_CASE("a folder that is not there and a name of another kind are refused") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH_AS(write_volume(noise(kSmall), folder / "none/a.nrrd"),
                       doctest::Contains("cannot be written"), FileError);
  CHECK_THROWS_WITH_AS(write_volume(noise(kSmall), folder / "a.nii"),
                       doctest::Contains(".nrrd only"), LoadError);
  CHECK(folder.count() == 0);
}

TEST_CASE("a new file that is not committed never appears") {
  const TemporaryFolder folder;
  {
    AtomicFile file(folder / "a.txt");
    file.write("half", 4);
  }
  CHECK(folder.count() == 0);
}

}  // namespace kerf::windowing_test
