// SPDX-License-Identifier: Apache-2.0
#include "tests/support/real_data.hpp"

#include <doctest/doctest.h>

#include "controller/volume/crop_resample.hpp"
#include "controller/volume/denoise.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::real_data_test {

using kerf::test::real_data;

namespace {

double in_values(Density d, Window window) {
  return window.lo + (window.hi - window.lo) * d / kDensityMax;
}

}  // namespace

TEST_CASE("the 16-bit CT tooth: big-endian, detached, and Otsu parts dentin from air") {
  const auto path = real_data("ge_tooth_16bit/tooth.nhdr");
  if (!path) return;
  const SourceVolume v = read_volume(*path);
  CHECK(v.grid == VoxelGrid{103, 94, 161});
  CHECK(v.min == 0);
  CHECK(v.max == 1300);
  CHECK(v.spacing_mm == std::array<double, 3>{1, 1, 1});
  const Window window = range_window(v);
  const VolumeImage image = apply_window(v, window);
  const Density otsu = otsu_threshold(image);
  CHECK(in_values(otsu, window) > 500);  // air 391, dentin 835
  CHECK(in_values(otsu, window) < 750);
  // 390 092 voxels at >= 620, as counted independently; the box is that of the same count.
  const auto iso = static_cast<Density>(620.0 / 1300 * kDensityMax + 0.5);
  std::size_t solid = 0;
  for (const Density d : image.density) solid += d >= iso;
  CHECK(solid == 390092);
  CHECK(solid_box(image, iso) == VoxelBox{{7, 8, 4}, {96, 86, 160}});
  const VolumeImage part = crop_to_solid(image, iso);
  CHECK(part.grid == VoxelGrid{89 + 6, 78 + 6, 156 + 6});
}

TEST_CASE("the 8-bit CT tooth: MetaImage") {
  const auto path = real_data("ge_tooth_8bit/tooth.mhd");
  if (!path) return;
  const SourceVolume v = read_volume(*path);
  CHECK(v.grid == VoxelGrid{140, 120, 161});
  CHECK(v.min == 0);
  CHECK(v.max == 255);
}

TEST_CASE("the CT of spine and pelvis: NIfTI in HU; bone from a window that begins at 0 HU") {
  const auto path = real_data("ct_spine_pelvis/example_ct.nii.gz");
  if (!path) return;
  const SourceVolume v = read_volume(*path);
  CHECK(v.grid == VoxelGrid{122, 101, 112});
  CHECK(v.min == -1207);
  CHECK(v.max == 3382);
  for (const double s : v.spacing_mm) CHECK(s == doctest::Approx(3.0));
  const auto threshold_hu = [&](Window window) {
    return in_values(otsu_threshold(apply_window(v, window)), window);
  };
  CHECK(threshold_hu(range_window(v)) < -300);  // air from skin
  const double bone = threshold_hu({0, 1500});
  CHECK(bone > 120);  // soft tissue ends
  CHECK(bone < 400);
}

TEST_CASE("the noise of the real scans, and the passes that it takes") {
  struct Scan {
    const char* file;
    double values;  ///< deviation in values of the file
    double share;
    int passes;
  };
  for (const Scan& scan : {Scan{"ge_tooth_16bit/tooth.nhdr", 5.33, 0.0104, 1},
                           Scan{"ge_tooth_8bit/tooth.mhd", 1.11, 0.0063, 0},
                           Scan{"ct_spine_pelvis/example_ct.nii.gz", 15.3, 0.0153, 1}}) {
    const auto path = real_data(scan.file);
    if (!path) continue;
    const SourceVolume v = read_volume(*path);
    const VolumeImage image = apply_window(v, range_window(v));
    const Noise noise = noise_of(image.grid, image.density, otsu_threshold(image));
    CAPTURE(scan.file);
    CHECK(noise.density * (v.max - v.min) == doctest::Approx(scan.values).scale(0).epsilon(0.01));
    CHECK(noise.share == doctest::Approx(scan.share).scale(0).epsilon(0.01));
    CHECK(passes_for(noise) == scan.passes);
    CHECK_FALSE(is_label_map(image.grid, image.density));
  }
}

}  // namespace kerf::real_data_test
