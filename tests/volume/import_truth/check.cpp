// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import_truth/check.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "controller/input/load_error.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::test {
using vec3::Vec, vec3::dot, vec3::length, vec3::operator-, vec3::operator+, vec3::operator*;

const std::vector<Situation>& situations() {
  static const std::vector<Situation> all = [] {
    std::vector<Situation> list;
    for (const auto add : {add_dicom_series, add_dicom_frames, add_nrrd, add_meta, add_nifti,
                           add_tiff, add_stacks_and_raw}) {
      add(list);
    }
    return list;
  }();
  return all;
}

VoxelIndex voxel_at(const VolumeFrame& frame, const Vec& lps_mm, double& apart_mm) {
  const auto& d = frame.direction;
  const Vec from_origin = lps_mm - Vec{frame.origin_mm[0], frame.origin_mm[1], frame.origin_mm[2]};
  std::array<double, 3> index{};
  Vec rest = from_origin;
  for (std::size_t a = 0; a < 3; ++a) {
    const Vec axis{d[a], d[3 + a], d[6 + a]};
    index[a] = std::round(dot(from_origin, axis) / frame.spacing_mm[a]);
    rest = rest - (index[a] * frame.spacing_mm[a]) * axis;
  }
  apart_mm = length(rest);
  return {static_cast<std::int32_t>(index[0]), static_cast<std::int32_t>(index[1]),
          static_cast<std::int32_t>(index[2])};
}

namespace {

/// Moves the truth so that its middle is that of the source.
void move_to_middle(const SourceVolume& source, Numbered& truth) {
  const double last[] = {source.grid.nx - 1.0, source.grid.ny - 1.0, source.grid.nz - 1.0};
  Vec middle =
      truth.origin_mm - truth.position((truth.size[0] - 1) / 2.0, (truth.size[1] - 1) / 2.0,
                                       (truth.size[2] - 1) / 2.0);
  for (std::size_t row = 0; row < 3; ++row) {
    middle[row] += source.origin_mm[row];
    for (std::size_t a = 0; a < 3; ++a) {
      middle[row] += source.direction[3 * row + a] * source.spacing_mm[a] * last[a] / 2;
    }
  }
  truth.origin_mm = middle;
}

}  // namespace

std::string difference(const Numbered& written, const SourceVolume& source) {
  Numbered truth = written;
  if (truth.any_origin) move_to_middle(source, truth);
  if (std::ranges::min(truth.spacing_mm) <= 0) return "read, though its file has no such frame";
  if (source.grid.voxel_count() != truth.count()) {
    return std::to_string(source.grid.voxel_count()) + " voxels in place of " +
           std::to_string(truth.count());
  }
  // Each number of the header is rounded relative to the largest of its kind.
  const auto& n = truth.size;
  const double slack_mm =
      truth.slack_mm + 1e-9 +
      4 * truth.digits *
          (length(truth.origin_mm) + length(truth.position(n[0], n[1], n[2]) - truth.origin_mm));
  double most = 0, least = HUGE_VAL;
  for (const double value : truth.values) {
    if (std::isnan(value)) continue;  // air
    most = std::max(most, std::abs(value));
    least = std::min(least, value);
  }
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const auto t = static_cast<std::size_t>(i + n[0] * (j + n[1] * k));
        const Vec position = truth.position(i, j, k);
        double apart_mm = 0;
        const VoxelIndex at = voxel_at(source, position, apart_mm);
        const bool inside = source.grid.box().clipped({at, {at.x + 1, at.y + 1, at.z + 1}}) ==
                            VoxelBox{at, {at.x + 1, at.y + 1, at.z + 1}};
        const double value =
            inside ? double{source.values[source.grid.index(at.x, at.y, at.z)]} : NAN;
        const double wanted = truth.values[t];
        const bool same = std::isnan(wanted)
                              ? value <= least
                              : value == double{static_cast<float>(wanted)} ||
                                    std::abs(value - wanted) <= truth.value_slack * most;
        if (inside && apart_mm <= slack_mm && same) continue;
        std::ostringstream text;
        text << "voxel (" << i << ", " << j << ", " << k << ") of " << n[0] << " x " << n[1]
             << " x " << n[2] << " at (" << position[0] << ", " << position[1] << ", "
             << position[2] << ") mm has the value " << wanted << ", and is read as " << value
             << ", " << apart_mm << " mm beside";
        return text.str();
      }
    }
  }
  return {};
}

Verdict verdict_of(const Case& one) {
  const Situation& situation = situations()[one.s];
  const TemporaryFolder folder;
  Draw draw(one.seed * 1000 + one.s, one.longest);
  const Written written = situation.write(draw, folder);
  if (!one.kept_in.empty()) {
    std::filesystem::copy(folder.path(), one.kept_in, std::filesystem::copy_options::recursive);
  }
  Verdict verdict;
  try {
    const SourceVolume source = read_volume(written.path, written.options);
    verdict.read = true;
    verdict.note = source.note;
    verdict.wrong = difference(written.truth, source);
    if (verdict.wrong.empty() && situation.expected != Expected::read &&
        situation.expected != Expected::read_or_refused) {
      verdict.wrong = "is read";
    }
    if (verdict.wrong.empty() && !has(source.note, written.note)) {
      verdict.wrong = "is read without a note of '" + written.note + "': " + source.note;
    }
  } catch (const LoadError& error) {
    verdict.message = error.what();
    for (const std::string& path : {folder.path().string() + "/", folder.path().string()}) {
      for (std::size_t at = 0; (at = verdict.message.find(path)) != std::string::npos;) {
        verdict.message.erase(at, path.size());
      }
    }
    const bool fits =
        is_one_line(std::string(error.what())) && has(verdict.message, situation.word);
    if (situation.expected == Expected::read || !fits) {
      verdict.wrong = "is refused: " + verdict.message;
    }
  }
  return verdict;
}

namespace {

/// The text behind the file that a message names, up to its way out.
std::string first_words(const std::string& message) {
  std::string text = message.substr(message.find(": ") + 2);
  text = text.substr(0, text.find("; "));
  constexpr std::size_t kLongest = 100;
  if (text.size() > kLongest) text = text.substr(0, text.rfind(' ', kLongest)) + " ...";
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

}  // namespace

std::string import_page() {
  std::ostringstream page;
  page
      << "## Which files are read\n\n"
         "Each row is a situation. A test writes files for it, in which each voxel has its own "
         "value and a known position\nin the patient (LPS). *Read*: each voxel comes back with its "
         "value and position. *Refused*: one line gives the\nreason, and nothing is read. *Asked*: "
         "the line names the option that is missing. *Read or refused*: some files\nof this kind "
         "are read, others are refused. *First words*: how the line begins after the file's "
         "name.\n\nThe test "
         "writes the files byte by byte from the specifications of the formats "
         "(`tests/volume/import_truth`),\nin random sizes, spacings, orientations and types. "
         "`.ci/all import` tries 10,000 of them. The test also makes\nthis part of the page:\n\n"
         "    KERF_WRITE_PAGE=1 build/release/bin/test_volume_readers -tc='*own-volume.md*'\n";
  constexpr std::uint64_t kSeeds = 6;
  std::string format;
  for (std::size_t s = 0; s < situations().size(); ++s) {
    const Situation& situation = situations()[s];
    if (situation.format != format) {
      format = situation.format;
      page << "\n### " << static_cast<char>(std::toupper(format[0])) << format.substr(1)
           << "\n\n| situation | outcome | first words |\n|---|---|---|\n";
    }
    std::string words;
    std::set<std::string> outcomes;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const Verdict verdict = verdict_of({s, seed, 6});
      const auto asks = [&](const char* text) { return has(verdict.message, text); };
      const bool asked =
          asks(" is not in the file; add") || asks("; choose one") || asks("--dims NX");
      outcomes.insert(verdict.read ? "read" : asked ? "asked" : "refused");
      if (words.empty() && !verdict.read) words = first_words(verdict.message);
    }
    page << "| " << situation.name << " | ";
    for (const std::string& outcome : outcomes) {
      page << (outcome == *outcomes.begin() ? "" : " or ") << outcome;
    }
    page << " | " << words << " |\n";
  }
  return page.str();
}

}  // namespace kerf::test
