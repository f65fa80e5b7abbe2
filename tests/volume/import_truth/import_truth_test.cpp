// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include <doctest/doctest.h>

#include "controller/volume/crop_resample.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/case_count.hpp"
#include "tests/volume/import_truth/check.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::import_truth_test {

using namespace kerf::test;

namespace {

std::string text_of(const Case& one, const Verdict& verdict) {
  const Situation& situation = situations()[one.s];
  return situation.format + ", " + situation.name + " (situation " + std::to_string(one.s) +
         ", seed " + std::to_string(one.seed) + ", sides to " + std::to_string(one.longest) +
         "): " + verdict.wrong;
}

/// The same failure with the smallest sides.
std::string smallest(const Case& failed) {
  for (int longest = 1; longest < failed.longest; ++longest) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Case one{failed.s, seed, longest};
      const Verdict verdict = verdict_of(one);
      if (!verdict.wrong.empty()) return text_of(one, verdict);
    }
  }
  return text_of(failed, verdict_of(failed));
}

}  // namespace

TEST_CASE("each numbered volume of every format is read voxel by voxel, or refused in one line") {
  const int rounds = cases(3);
  std::map<std::size_t, Case> failed;
  int count = 0;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t s = 0; s < situations().size(); ++s) {
      if (failed.contains(s)) continue;
      const Case one{s, static_cast<std::uint64_t>(100 + round), 1 + (round * 7 + 5) % 20};
      ++count;
      if (!verdict_of(one).wrong.empty()) failed[s] = one;
    }
  }
  MESSAGE(count << " cases of " << situations().size() << " situations");
  for (const auto& [s, one] : failed) FAIL_CHECK(smallest(one));
}

TEST_CASE("one case, to look for a fault") {
  // KERF_IMPORT_CASE="SITUATION SEED SIDES FOLDER": its files go there.
  const char* words = std::getenv("KERF_IMPORT_CASE");
  if (words == nullptr) return;
  Case one;
  std::istringstream(words) >> one.s >> one.seed >> one.longest >> one.kept_in;
  const Verdict verdict = verdict_of(one);
  MESSAGE(std::string(verdict.read ? "read. " : "refused. ")
          << verdict.message << verdict.note << verdict.wrong);
}

TEST_CASE("the last part of docs/own-volume.md is what the files do") {
  const std::string made = import_page();
  const std::string path = KERF_DOCS "/own-volume.md";
  const auto text = [&] {
    std::ifstream file(path, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::string heading = made.substr(0, made.find('\n') + 1);
  if (std::getenv("KERF_WRITE_PAGE") != nullptr) {
    const std::string whole = text();
    std::ofstream(path, std::ios::binary) << whole.substr(0, whole.find(heading)) << made;
  }
  const std::string whole = text();
  REQUIRE(whole.find(heading) != std::string::npos);
  const std::string page = whole.substr(whole.find(heading));
  INFO("renew it: KERF_WRITE_PAGE=1 build/release/bin/test_volume_readers -tc='*own-volume.md*'");
  CHECK((page == made));
  std::istringstream lines(made), kept(page);  // the first line that differs
  for (std::string line, old; std::getline(lines, line);) {
    std::getline(kept, old);
    CHECK(old == line);
    if (old != line) break;
  }
}

TEST_CASE("every voxel of a read volume depends on its file, in every format") {
  for (std::size_t s = 0; s < situations().size(); ++s) {
    const Situation& situation = situations()[s];
    if (s > 0 && situation.format == situations()[s - 1].format) continue;  // the plain one
    CAPTURE(situation.format);
    // Two readings of one layout with other values: the same seed, then values inverted.
    const TemporaryFolder one, two;
    Draw draw(s, 9), again(s, 9);
    Written first = situation.write(draw, one);
    again.invert_values = true;
    Written second = situation.write(again, two);
    const SourceVolume a = read_volume(first.path, first.options);
    const SourceVolume b = read_volume(second.path, second.options);
    REQUIRE(a.grid == b.grid);
    CHECK(difference(first.truth, a).empty());
    CHECK(difference(second.truth, b).empty());
    std::size_t same = 0;
    for (std::size_t i = 0; i < a.values.size(); ++i) same += a.values[i] == b.values[i];
    CHECK(same == 0);
  }
}

TEST_CASE("values and positions stay through window, file, crop and refinement") {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(cases(40)); ++seed) {
    const TemporaryFolder folder;
    Draw draw(seed, 9);
    const Written written = situations()[0].write(draw, folder);  // a DICOM series
    const SourceVolume source = read_volume(written.path, written.options);
    const Window window = range_window(source);
    if (!(window.lo < window.hi)) continue;
    const VolumeImage image = apply_window(source, window);

    const Numbered& truth = written.truth;
    const auto check = [&](const VolumeImage& held, int refined, const VoxelBox& box) {
      std::size_t found = 0, wrong = 0;
      for (int k = 0; k < truth.size[2]; ++k) {
        for (int j = 0; j < truth.size[1]; ++j) {
          for (int i = 0; i < truth.size[0]; ++i) {
            double apart_mm = 0;
            const VoxelIndex at = voxel_at(held, truth.position(i, j, k), apart_mm);
            const VoxelBox own{at, {at.x + 1, at.y + 1, at.z + 1}};
            if (held.grid.box().clipped(own) != own) continue;
            ++found;
            const auto t = static_cast<std::size_t>(i + truth.size[0] * (j + truth.size[1] * k));
            const double wanted =
                (truth.values[t] - window.lo) * kDensityMax / (window.hi - window.lo);
            const double off = std::abs(held.density[held.grid.index(at.x, at.y, at.z)] - wanted);
            constexpr double kRounded = 0.5 + 1e-9;  // a tie goes either way
            wrong += apart_mm > 1e-6 || off > (refined > 1 ? 1 + kRounded : kRounded);
          }
        }
      }
      CHECK(wrong == 0);
      const VoxelIndex n = box.extent();
      CHECK(found == static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) *
                         static_cast<std::size_t>(n.z));
    };
    CAPTURE(seed);
    const VoxelBox all = image.grid.box();
    check(image, 1, all);
    write_volume(image, folder / "out.nrrd");
    check(apply_window(read_volume(folder / "out.nrrd"), {0, kDensityMax}), 1, all);
    const VoxelIndex low{draw.below(image.grid.nx + 2) - 2, draw.below(image.grid.ny + 2) - 2,
                         draw.below(image.grid.nz + 2) - 2};
    const VoxelBox box{
        low, {low.x + 1 + draw.below(9), low.y + 1 + draw.below(9), low.z + 1 + draw.below(9)}};
    const VoxelBox kept = box.clipped(all);
    if (!kept.empty()) check(crop(image, box), 1, kept);
    const auto& s = image.spacing_mm;  // each voxel is in the middle of three
    check(resample(image, {s[0] / 3, s[1] / 3, s[2] / 3}), 3, all);
  }
}

}  // namespace kerf::import_truth_test
