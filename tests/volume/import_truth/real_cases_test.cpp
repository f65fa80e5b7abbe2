// SPDX-License-Identifier: Apache-2.0
// The small files of $KERF_DATA/import-cases (its README): situations of public trackers.
#include <filesystem>

#include <doctest/doctest.h>

#include "tests/support/real_data.hpp"
#include "tests/volume/import_truth/check.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::real_cases_test {

using namespace kerf::test;

namespace {

/// Empty, with a message, if it is not there.
std::filesystem::path case_folder() {
  return real_data("import-cases").value_or(std::filesystem::path());
}

/// 20 x 16 x 12 voxels of 0.5 x 0.5 x 0.7 mm that are numbered from 0, x fastest.
Numbered counted(std::array<int, 3> size = {20, 16, 12}) {
  Numbered v;
  v.size = size;
  v.lay_flat();
  v.spacing_mm = {0.5, 0.5, 0.7};
  v.digits = 1e-6;
  for (int i = 0; i < size[0] * size[1] * size[2]; ++i) v.stored.push_back(i);
  v.values = v.stored;
  return v;
}

/// The outcome as text: empty if each voxel is as in `truth`.
std::string outcome(const std::filesystem::path& path, const Numbered& truth, bool spaced) {
  ReadOptions options;
  if (spaced) options.spacing_mm = truth.spacing_mm;
  const std::string refused = refusal(path, options);
  return refused == "no error" ? difference(truth, read_volume(path, options)) : refused;
}

}  // namespace

TEST_CASE("each numbered file of the import cases is right, or refused by name") {
  const std::filesystem::path folder = case_folder();
  if (folder.empty()) return;
  struct Row {
    const char* name;
    const char* word;  ///< of a refusal; empty: read
    void (*change)(Numbered&) = nullptr;
    bool spaced = false;
  };
  const Row rows[] = {{"m1_regular.dcm", ""},
                      {"m5_descending.dcm", ""},
                      {"m4_gap.dcm", "missing"},
                      {"m3_slopes.dcm", ""},
                      {"d1_iop_jitter", ""},
                      {"d9_negative_sbs", ""},
                      {"d22_disc", ""},
                      {"d2b_rgb_screenshot", ""},
                      {"d19c_htj2k", "encod"},
                      {"r3_ras.nrrd", "",
                       [](Numbered& v) {
                         v.axes = {{{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}};
                       }},
                      {"r3b_las.nrrd", "",
                       [](Numbered& v) {
                         v.axes[1] = {0, -1, 0};
                       }},
                      {"r12_type.nrrd", ""},
                      {"r12_sizes.nrrd", ""},
                      {"r10_long_value.nrrd", ""},
                      {"r5b_time_last.nrrd", ""},
                      {"n2_pixdim_one.nii", ""},
                      {"n4_micron.nii", "",
                       [](Numbered& v) {
                         v.origin_mm = {-1, -2, 3};
                       }},
                      {"n1b_slope_zero.nii", ""},
                      {"t4/sform_beside_long_quaternion.nii", ""},
                      {"t4/quaternion_long.nii", "",
                       [](Numbered& v) {
                         v.origin_mm = {1, 2, 3};
                       }},
                      {"t4/three_stacks.dcm", ""},
                      {"t10_reduced_first.tif", "", nullptr, true},
                      {"t11_reduced_first.tif", "",
                       [](Numbered& v) {
                         v = counted({20, 16, 11});
                       },
                       true},
                      {"t3c_int32.tif", "",
                       [](Numbered& v) {
                         for (double& x : v.values) x -= 1024;
                       },
                       true},
                      {"h1_comma.mha", "comma"}};
  for (const Row& row : rows) {
    Numbered truth = counted();
    if (row.change != nullptr) row.change(truth);
    const std::string found = outcome(folder / row.name, truth, row.spaced);
    CAPTURE(std::string(row.name));
    CAPTURE(found);
    if (*row.word == '\0') {
      CHECK(found.empty());
    } else {
      CHECK(is_one_line(found));
      CHECK(has(found, row.word));
    }
  }
}

TEST_CASE("the import cases of one cylinder have the same HU, whatever tags they have") {
  const std::filesystem::path folder = case_folder();
  if (folder.empty()) return;
  const SourceVolume plain = read_volume(folder / "e5c_mono2");
  const SourceVolume inverse = read_volume(folder / "e5_mono1_stored12");
  const SourceVolume padded = read_volume(folder / "e2_pad_63536_unsigned");
  const SourceVolume whole = read_volume(folder / "e4_pad_none");
  std::size_t other = 0, dense = 0;
  for (std::size_t i = 0; i < plain.values.size(); ++i) {
    other += plain.values[i] != inverse.values[i];
  }
  CHECK(other == 0);
  REQUIRE(padded.values.size() == whole.values.size());
  for (std::size_t i = 0; i < whole.values.size(); ++i) {
    dense += padded.values[i] != whole.values[i] && padded.values[i] > -900;  // padding is air
  }
  CHECK(dense == 0);
}

}  // namespace kerf::real_cases_test
