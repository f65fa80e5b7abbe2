// SPDX-License-Identifier: Apache-2.0
// Numbered volumes through `kerf-volume import` and a scene to each picture of them: the segment,
// the window's sections and OpenIGTLink.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <doctest/doctest.h>
#include <igtlImageMessage.h>
#include <igtl_header.h>

#include "bridge/igtl/igtl_messages.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/run/run_start.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/segment/reader.hpp"
#include "tests/case_count.hpp"
#include "tests/volume/import_truth/check.hpp"
#include "tests/volume/volume_files.hpp"
#include "visualizer/scene/cross_sections.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf::import_chain_test {

using namespace kerf::test;
using vec3::length, vec3::operator-, vec3::operator+, vec3::operator*;

namespace {

/// World from LPS: (x, y, z) -> (x, z, -y) unless the scene gives an orientation.
Point3 standing(const Point3& lps) {
  return {lps[0], lps[2], -lps[1]};
}

/// A volume of densities in a space: voxel (i, j, k) lies at `at(i, j, k)`.
struct Shown {
  VoxelGrid grid;
  std::vector<Density> density;
  std::function<Point3(double, double, double)> at;

  /// Voxels of `truth` that are not found at their position, `middle` apart, with their density.
  [[nodiscard]] std::size_t wrong(const Numbered& truth, Window window,
                                  const std::function<Point3(const Point3&)>& from_lps) const {
    const auto& n = truth.size;
    const Point3 middle = truth.position((n[0] - 1) / 2.0, (n[1] - 1) / 2.0, (n[2] - 1) / 2.0);
    const Point3 origin = at(0, 0, 0);
    const std::array<Point3, 3> step{at(1, 0, 0) - origin, at(0, 1, 0) - origin,
                                     at(0, 0, 1) - origin};
    std::size_t count = 0;
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) {
          const Point3 wanted = from_lps(truth.position(i, j, k) - middle);  // middle at the origin
          std::array<std::int32_t, 3> v{};
          for (std::size_t a = 0; a < 3; ++a) {
            v[a] = static_cast<std::int32_t>(
                std::lround(vec3::dot(wanted - origin, step[a]) / vec3::dot(step[a], step[a])));
          }
          const VoxelBox own{{v[0], v[1], v[2]}, {v[0] + 1, v[1] + 1, v[2] + 1}};
          const auto t = static_cast<std::size_t>(i + n[0] * (j + n[1] * k));
          const double scale = kDensityMax / (window.hi - window.lo);
          const Density value =
              nearest_density((double{static_cast<float>(truth.values[t])} - window.lo) * scale);
          const bool inside = grid.box().clipped(own) == own;
          count += !inside || density[grid.index(v[0], v[1], v[2])] != value ||
                   length(at(v[0], v[1], v[2]) - wanted) > 1e-3;  // floats, of at most 100 mm
        }
      }
    }
    return count;
  }
};

/// The image as 3D Slicer puts it together: the origin of OpenIGTLink is the middle of the image.
Shown igtl_image(const SegmentVolumeInfo& info, const std::vector<Density>& density) {
  const auto bytes = bridge::image_message("a", info, density, info.grid.box());
  const igtl::ImageMessage::Pointer image = igtl::ImageMessage::New();
  image->InitPack();
  std::memcpy(image->GetPackPointer(), bytes->data(), IGTL_HEADER_SIZE);
  image->Unpack();
  image->AllocatePack();
  std::memcpy(image->GetPackBodyPointer(), bytes->data() + IGTL_HEADER_SIZE,
              bytes->size() - IGTL_HEADER_SIZE);
  REQUIRE((image->Unpack() & igtl::MessageHeader::UNPACK_BODY) != 0);
  std::array<int, 3> size{};
  std::array<float, 3> spacing{};
  igtl::Matrix4x4 m;
  image->GetDimensions(size.data());
  image->GetSpacing(spacing.data());
  image->GetMatrix(m);
  Shown shown{{size[0], size[1], size[2]}, std::vector<Density>(density.size()), {}};
  std::memcpy(shown.density.data(), image->GetScalarPointer(), 2 * density.size());
  std::array<Point3, 4> columns{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t c = 0; c < 4; ++c) columns[c][row] = double{m[row][c]};
  }
  shown.at = [=](double i, double j, double k) {
    return columns[3] + (double{spacing[0]} * (i - (size[0] - 1) / 2.0)) * columns[0] +
           (double{spacing[1]} * (j - (size[1] - 1) / 2.0)) * columns[1] +
           (double{spacing[2]} * (k - (size[2] - 1) / 2.0)) * columns[2];
  };
  return shown;
}

/// The first row of each format: a plain file.
std::vector<std::size_t> plain_situations() {
  std::vector<std::size_t> plain;
  const auto& all = situations();
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (s == 0 || all[s].format != all[s - 1].format) plain.push_back(s);
  }
  return plain;
}

std::vector<std::string> import_words(const Written& written, Window window,
                                      const std::string& out) {
  const auto text = [](double x) { return fixed_text(x, 6); };
  std::vector<std::string> words{"import",    written.path.string(), "--out",     out,
                                 "--no-crop", "--keep-all",          "--denoise", "off"};
  words.insert(words.end(), {"--window", text(window.lo) + "," + text(window.hi), "--iso",
                             text((window.lo + window.hi) / 2)});
  if (const auto& s = written.options.spacing_mm) {
    words.insert(words.end(),
                 {"--spacing", text((*s)[0]) + "," + text((*s)[1]) + "," + text((*s)[2])});
  }
  if (const auto& raw = written.options.raw) {
    const auto& g = raw->grid;
    words.insert(
        words.end(),
        {"--dims", std::to_string(g.nx) + "x" + std::to_string(g.ny) + "x" + std::to_string(g.nz),
         "--type", std::string(kVoxelTypeWords[std::size_t(raw->type)]), "--skip",
         std::to_string(raw->skip)});
    if (raw->big_endian) words.emplace_back("--big-endian");
  }
  return words;
}

}  // namespace

TEST_CASE("a numbered volume lies in the segment, the window and OpenIGTLink as in the patient") {
  for (const std::size_t s : plain_situations()) {
    int whole = 0;
    for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(cases(6)); ++seed) {
      const TemporaryFolder folder;
      Draw draw(seed, 14);
      const Written written = situations()[s].write(draw, folder);
      const Numbered& truth = written.truth;
      const auto [lo, hi] = std::ranges::minmax(truth.values);
      // Text of 6 digits holds each value of such a window.
      if (truth.type >= VoxelType::float32 || !(lo < hi) || truth.count() < 100) continue;
      CAPTURE(situations()[s].format);
      CAPTURE(seed);
      const Window window{lo, hi};
      const TemporaryFolder made;
      const Outcome outcome = run(import_words(written, window, (made / "a.nrrd").string()));
      CAPTURE(outcome.err);
      if (outcome.code != 0) continue;  // a scene that no tool fits: stretched voxels, all solid
      ++whole;

      for (const bool stands : {true, false}) {
        SceneOverrides overrides;
        if (!stands) {
          std::string text = text_of(made / "a.toml");
          text.insert(text.find("window ="),
                      "pose.orientation = [0, 0, 0, 1]\n");  // the world is LPS
          made.write("a.toml", text);
        }
        const LoadedScene scene = load_scene(made / "a.toml", overrides);
        const SegmentSpec spec = segment_spec(scene, canonical_json(scene), 1);
        const SegmentWriter writer = SegmentWriter::create(spec);
        const SegmentReader reader = SegmentReader::map(writer.fd());
        VolumeSnapshot snapshot;
        reader.update(0, snapshot);
        const SegmentInfo& segment = reader.info();
        const SceneView view = scene_view(segment);
        const glm::dmat4 world = view.volumes[0].world_from_voxel;
        const Shown shown{segment.volumes[0].grid, snapshot.density,
                          [&](double i, double j, double k) {
                            const glm::dvec4 p = world * glm::dvec4(i, j, k, 1);
                            return Point3{p.x, p.y, p.z};
                          }};
        const auto in_world = [&](const Point3& lps) { return stands ? standing(lps) : lps; };
        CHECK(shown.wrong(truth, window, in_world) == 0);
        const Shown image = igtl_image(segment.volumes[0], snapshot.density);
        CHECK(image.wrong(truth, window, [&](const Point3& lps) {
          const Point3 at = in_world(lps);
          return Point3{-at[0], -at[1], at[2]};  // RAS
        }) == 0);

        // A point to the left, in front and above of the middle, in the three sections.
        if (!stands) continue;
        const Point3 p = in_world({3, -2, 1});  // L, A, S
        const std::vector<VolumeContent> contents{{snapshot.density, {}}};
        const auto tip = slice_views(view, contents, {p[0], p[1], p[2]}, 8).tip;
        CHECK(tip[0][0] > 0.5);  // axial from above: left to the right, front below
        CHECK(tip[0][1] > 0.5);
        CHECK(tip[1][0] > 0.5);  // coronal from in front: left to the right, head above
        CHECK(tip[1][1] < 0.5);
        CHECK(tip[2][0] < 0.5);  // sagittal from the left: front to the left, head above
        CHECK(tip[2][1] < 0.5);
      }
    }
    CAPTURE(situations()[s].format);
    CHECK(whole > 0);
  }
}

}  // namespace kerf::import_chain_test
