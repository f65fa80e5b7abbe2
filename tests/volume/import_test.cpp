// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <random>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/scene/scene_file.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/windowing.hpp"
#include "controller/volume_tool/import_command.hpp"
#include "tests/case_count.hpp"
#include "tests/support/real_data.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::import_test {

using namespace kerf::test;

namespace {

/// A ball of 200 in air of 10, on 20 x 20 x 20 voxels.
std::string ball_file(const TemporaryFolder& folder, const std::string& spacings) {
  const VoxelGrid grid{20, 20, 20};
  std::vector<std::uint8_t> values(grid.voxel_count(), 10);
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {20, 20, 20}})) {
    const std::int32_t r2 = (x - 10) * (x - 10) + (y - 10) * (y - 10) + (z - 8) * (z - 8);
    if (r2 <= 25) values[grid.index(x, y, z)] = 200;
  }
  return folder
      .write("ball.nrrd", nrrd("uint8", spacings, "raw", "20 20 20") + "\n" + bytes_of(values))
      .string();
}

const std::string kHalf = "spacings: 0.5 0.5 0.5\n";

}  // namespace

TEST_CASE("import writes a volume, a scene that reads it and a preview, and tells each choice") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out.nrrd").string();
  const Outcome made = run({"import", ball_file(folder, kHalf), "--out", out});
  CAPTURE(made.err);
  REQUIRE(made.code == 0);
  for (const char* line : {"file  ", "surface  ", "window  ", "body  ", "materials  ", "crop  ",
                           "denoise  ", "wrote  ", "try  "}) {
    CHECK(has(made.out, std::string("\n") + line) == (std::string(line) != "file  "));
  }
  CHECK(has(made.out, "--iso VALUE for another"));

  const SourceVolume v = read_volume(out);
  CHECK(v.grid == VoxelGrid{11 + 6, 11 + 6, 11 + 6});
  CHECK(v.spacing_mm == std::array<double, 3>{0.5, 0.5, 0.5});
  CHECK(v.origin_mm == std::array<double, 3>{1, 1, 0});  // voxel (2, 2, 0) of the source
  CHECK(v.min == 0);
  CHECK(v.max == kDensityMax);
  const SceneSpec scene = parse_scene_file(folder / "out.toml");
  REQUIRE(scene.volumes.size() == 1);
  CHECK(scene.volumes[0].file == "out.nrrd");
  CHECK(*scene.volumes[0].iso == doctest::Approx(0.5).epsilon(0.01));
  CHECK(scene.device.fit);
  CHECK(text_of(folder / "out.png").starts_with("\x89PNG\r\n"));
}

TEST_CASE("import takes the user's word for surface, window, crop and size") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out.nrrd").string();
  REQUIRE(run({"import", ball_file(folder, kHalf), "--out", out, "--iso", "50", "--window",
               "-90,210", "--no-crop", "--override-spacing", "2", "--denoise", "off", "--packed"})
              .code == 0);
  const SourceVolume v = read_volume(out);
  CHECK(v.grid == VoxelGrid{20, 20, 20});
  CHECK(v.spacing_mm == std::array<double, 3>{2, 2, 2});
  CHECK(v.min == std::lround(100.0 / 300 * kDensityMax));
  CHECK(v.max == std::lround(290.0 / 300 * kDensityMax));
  CHECK(*parse_scene_file(folder / "out.toml").volumes[0].iso ==
        doctest::Approx(140.0 / 300).epsilon(1e-4));
}

TEST_CASE("what an import crops ends in air, whatever lay around the solid") {
  const TemporaryFolder folder;
  const VoxelGrid grid{30, 30, 30};
  std::mt19937 random(1);
  std::vector<std::uint8_t> values(grid.voxel_count());
  for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(10 + random() % 40);
  for (std::int32_t z = 10; z < 20; ++z) {
    for (std::int32_t y = 10; y < 20; ++y) {
      std::fill_n(&values[grid.index(10, y, z)], 10, std::uint8_t{200});
    }
  }
  const auto scan =
      folder.write("scan.nrrd", nrrd("uint8", kHalf, "raw", "30 30 30") + "\n" + bytes_of(values));
  const std::string out = (folder / "out.nrrd").string();
  const Outcome made = run({"import", scan.string(), "--out", out, "--denoise", "off"});
  CAPTURE(made.err);
  REQUIRE(made.code == 0);
  CHECK(has(made.out, "the solid and three voxels around it"));
  const VolumeImage image = apply_window(read_volume(out), {0, kDensityMax});
  const VoxelGrid& g = image.grid;
  CHECK(g == VoxelGrid{16, 16, 16});
  Density border = 0, within = 0;
  for (std::int32_t z = 0; z < g.nz; ++z) {
    for (std::int32_t y = 0; y < g.ny; ++y) {
      for (const std::int32_t x : {0, 2}) {
        Density& most = x == 0 ? border : within;
        most = std::max(most, image.density[g.index(x, y, z)]);
      }
    }
  }
  CHECK(border == 0);
  CHECK(within > 0);  // what lay there is still around the solid
}

TEST_CASE("import replaces no file without --force") {
  const TemporaryFolder folder;
  const std::string ball = ball_file(folder, kHalf), out = (folder / "out.nrrd").string();
  for (const std::string name : {"out.nrrd", "out.toml", "out.png", "out-labels.nrrd"}) {
    const auto there = folder.write(name, "mine");
    const Outcome refused = run({"import", ball, "--out", out});
    CHECK(refused.code == 2);
    CHECK(has(refused.err, name + ": exists already"));
    CHECK(text_of(there) == "mine");
    std::filesystem::remove(there);
  }
  CHECK(run({"import", ball, "--out", out}).code == 0);
  CHECK(run({"import", ball, "--out", out}).code == 2);
  CHECK(run({"import", ball, "--out", out, "--force"}).code == 0);
}

TEST_CASE("an import without --out has the name of its source, and leaves that one's labels") {
  const TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::rename(ball_file(folder, kHalf), folder / "ball.nhdr");  // its data within
  std::filesystem::current_path(folder.path());
  const Outcome made = run({"import", "ball.nhdr"});
  const auto labels = folder.write("ball-labels.nrrd", "mine");
  const Outcome refused = run({"import", "ball.nhdr", "--force"});
  std::filesystem::current_path(before);
  CAPTURE(made.err);
  CHECK(made.code == 0);
  CHECK(std::filesystem::exists(folder / "ball.toml"));
  CHECK(refused.code == 2);
  CHECK(has(refused.err, "ball-labels.nrrd: is a file of this run itself"));
  CHECK(text_of(labels) == "mine");
}

TEST_CASE("an import writes nothing into the folder that it reads") {
  const TemporaryFolder folder;
  const std::filesystem::path slices = folder / "slices", before = std::filesystem::current_path();
  std::filesystem::create_directory(slices);
  folder.write("slices/s1.png", "a slice");
  const auto refused = [&](const std::string& path, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"import", path, "--spacing", "0.5"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    CAPTURE(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, ", which are read; name a place outside with --out"));
  };
  refused(slices, {"--out", slices / "mine.nrrd"});
  refused(slices, {"--out", slices / "mine.nrrd", "--force"});
  std::filesystem::current_path(slices);
  refused(".", {});
  refused("../slices", {});
  std::filesystem::current_path(before);
  const auto files = std::filesystem::directory_iterator(slices);
  CHECK(std::distance(files, std::filesystem::directory_iterator()) == 1);
}

TEST_CASE("import writes all of its files or none") {
  const TemporaryFolder folder;
  const std::string ball = ball_file(folder, kHalf), out = (folder / "out.nrrd").string();
  for (const std::string name : {"out.toml", "out.png", "out-labels.nrrd"}) {
    const auto there = folder / name.c_str();
    std::filesystem::create_directory(there);
    const Outcome refused = run({"import", ball, "--out", out, "--force"});
    CAPTURE(refused.err);
    CHECK(refused.code == 2);
    CHECK(has(refused.err, name + ": cannot be written (Is a directory)"));
    CHECK_FALSE(std::filesystem::exists(out));
    std::filesystem::remove(there);
  }
}

TEST_CASE("of two imports to one name at once, one wins and the other gets its line") {
  const TemporaryFolder folder;
  const std::string ball = ball_file(folder, kHalf), out = (folder / "out.nrrd").string();
  constexpr std::size_t kAtOnce = 6;
  std::array<pid_t, kAtOnce> children{};
  for (pid_t& child : children) {  // of one thread: a lock that another held would stay shut
    child = fork();
    if (child == 0) {
      const Outcome made = run({"import", ball, "--out", out});
      const bool told = has(made.err, "exists already; choose another name, or --force");
      _exit(made.code == 0 ? 0 : told ? 1 : 2);
    }
  }
  std::array<int, kAtOnce> ends{};
  std::ranges::transform(children, ends.begin(), [](pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  });
  CHECK(std::ranges::count(ends, 0) == 1);
  CHECK(std::ranges::count(ends, 1) == kAtOnce - 1);
  CHECK(parse_scene_file(folder / "out.toml").volumes.size() == 1);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  CHECK(files == 4);  // the ball, and three of one import
}

TEST_CASE("import asks about a voxel size that makes no sense, and writes nothing") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out.nrrd").string();
  for (const std::string spacings :
       {"spacings: 1 1 1\n", "spacings: 300 300 300\n", "spacings: 0.1 0.1 50\n", ""}) {
    const std::string ball = ball_file(folder, spacings);
    const Outcome asked = run({"import", ball, "--out", out});
    CAPTURE(asked.err);
    CHECK(asked.code == 2);
    CHECK(is_one_line(asked.err.substr(0, asked.err.size() - 1)));
    CHECK_FALSE(std::filesystem::exists(out));
    const char* const option = spacings.empty() ? "--spacing" : "--override-spacing";
    CHECK(has(asked.err, option));
    CHECK(run({"import", ball, "--out", out, option, "1", "--force"}).code == 0);
    std::filesystem::remove(out);
    std::filesystem::remove(folder / "out.toml");
    std::filesystem::remove(folder / "out.png");
  }
}

TEST_CASE("a scene tells its source, whatever bytes its name has") {
  const TemporaryFolder folder;
  const std::string ball = ball_file(folder, kHalf);
  for (const std::string name :
       {"z\xe4hne.nrrd", "two\nlines\x7f.nrrd", "\"quoted\\\".nrrd", "zähne.nrrd"}) {
    CAPTURE(name);
    const auto source = folder.path() / name;
    std::filesystem::copy_file(ball, source);
    const std::string out = (folder / "out.nrrd").string();
    const Outcome made = run({"import", source.string(), "--out", out, "--force"});
    CAPTURE(made.err);
    CHECK(made.code == 0);
    CHECK(parse_scene_file(folder / "out.toml").volumes.size() == 1);
    CHECK(has(text_of(folder / "out.toml"), "zähne.nrrd") == (name == "zähne.nrrd"));
    CHECK_FALSE(has(text_of(folder / "out.toml"), "\xe4hne"));
  }
}

TEST_CASE("a volume with labels keeps them and gets no proposal") {
  const TemporaryFolder folder;
  const std::string tooth = (folder / "tooth.nrrd").string();
  const std::string out = (folder / "out.nrrd").string();
  write_volume(make_phantom({.grid = {48, 48, 30}}), tooth);
  REQUIRE(run({"import", tooth, "--out", out}).code == 0);
  CHECK(text_of(folder / "out.png").starts_with("\x89PNG\r\n"));
  VolumeImage image = apply_window(read_volume(out), {0, kDensityMax});
  read_labels_beside(out, image);
  CHECK(image.labels.size() == image.density.size());
  CHECK(parse_scene_file(folder / "out.toml").materials.size() == 4);

  image.labels.front() = 6;  // a material that nobody knows
  write_volume(image, tooth);
  REQUIRE(run({"import", tooth, "--out", out, "--force", "--no-crop"}).code == 0);
  const SceneSpec scene = parse_scene_file(folder / "out.toml");
  REQUIRE(scene.materials.size() == 7);
  CHECK(scene.materials[6].name == "label 6");

  CHECK(has(run({"import", tooth, "--out", out, "--force", "--override-spacing", "1,1,90"}).err,
            "has a side of more than 60 times another"));
}

namespace {

/// Balls of labels 1 .. `count` in air, beside each other along x.
VolumeImage labelled_balls(int count) {
  VolumeImage image;
  image.grid = {16 * count, 16, 16};
  image.density.assign(image.grid.voxel_count(), 0);
  image.labels.assign(image.grid.voxel_count(), 0);
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {16 * count, 16, 16}})) {
    const std::int32_t from = x % 16 - 8;
    if (from * from + (y - 8) * (y - 8) + (z - 8) * (z - 8) > 25) continue;
    image.labels[image.grid.index(x, y, z)] = static_cast<Label>(x / 16 + 1);
    image.density[image.grid.index(x, y, z)] = static_cast<Density>(kDensityMax);
  }
  return image;
}

}  // namespace

TEST_CASE("each label has its own colour in the preview, in slices and on the surface") {
  const RgbPicture picture = label_preview(labelled_balls(3), 32768);
  std::array<std::array<int, 4>, 3> seen{};  // pixels of the label in the panels, row by row
  for (std::int32_t y = 0; y < picture.height; ++y) {
    for (std::int32_t x = 0; x < picture.width; ++x) {
      const std::uint8_t* const rgb =
          &picture.rgb[3 * static_cast<std::size_t>(y * picture.width + x)];
      // Sky blue, yellow and vermilion keep their order of channels in any light.
      const bool lit = std::max({rgb[0], rgb[1], rgb[2]}) > 100 && rgb[0] != rgb[1];
      if (!lit) continue;
      const std::size_t label = rgb[2] > rgb[1] ? 0 : rgb[1] > 0.9 * rgb[0] ? 1 : 2;
      ++seen[label][2 * (2 * y > picture.height) + (2 * x > picture.width)];
    }
  }
  CAPTURE(seen[0][0]);
  for (const auto& panels : seen) {
    for (const std::size_t panel : {0U, 1U, 3U}) CHECK(panels[panel] > 100);
  }
  CHECK(seen[0][2] == 0);  // across x, through the one in the middle
  CHECK(seen[1][2] > 100);
  CHECK(seen[2][2] == 0);
}

TEST_CASE("a map of labels alone becomes a material each, a scan of the same steps does not") {
  const TemporaryFolder folder;
  const VolumeImage balls = labelled_balls(5);
  std::vector<std::uint8_t> values(balls.labels.begin(), balls.labels.end());
  const auto write = [&] {
    return folder
        .write("map.nrrd", nrrd("uint8", kHalf, "raw", "80 16 16") + "\n" + bytes_of(values))
        .string();
  };
  const std::string out = (folder / "out.nrrd").string();
  const Outcome made = run({"import", write(), "--out", out});
  CAPTURE(made.err);
  REQUIRE(made.code == 0);
  CHECK(has(made.out, "a map of labels; --iso 0.5 makes one body of them"));
  CHECK(text_of(folder / "out.png").starts_with("\x89PNG\r\n"));
  const SceneSpec scene = parse_scene_file(folder / "out.toml");
  REQUIRE(scene.materials.size() == 6);
  CHECK(scene.materials[4].colour != scene.materials[5].colour);
  VolumeImage image = apply_window(read_volume(out), {0, kDensityMax});
  read_labels_beside(out, image);
  CHECK(*std::ranges::max_element(image.labels) == 5);

  const Outcome body = run({"import", write(), "--out", out, "--force", "--iso", "0.5"});
  CHECK(has(body.out, "materials  "));
  CHECK_FALSE(has(body.out, "a map of labels"));
  CHECK_FALSE(std::filesystem::exists(folder / "out-labels.nrrd"));
  for (std::size_t i = 1; i + 1 < values.size(); ++i) {  // blurred, as a scan is
    if (values[i] > 1 && values[i - 1] == 0) values[i] /= 2;
  }
  const Outcome scan = run({"import", write(), "--out", out, "--force"});
  CHECK_FALSE(has(scan.out, "a map of labels"));
}

TEST_CASE("each real scan is imported at first try") {
  struct Scan {
    const char* file;
    std::vector<std::string> words;  ///< that the options need, or that the answer has
    double least, most;              ///< of the surface, in values of the file
  };
  for (const Scan& scan :
       kinds({Scan{"ge_tooth_8bit/tooth.mhd", {"--override-spacing", "0.125"}, 70, 110},
              Scan{"ge_tooth_16bit/tooth.nhdr", {"--override-spacing", "0.125"}, 550, 750},
              Scan{"ct_spine_pelvis/example_ct.nii.gz", {}, 120, 400}})) {
    const auto file = real_data(scan.file);
    if (!file.has_value()) continue;
    CAPTURE(scan.file);
    const TemporaryFolder folder;
    const std::string path = file->string();
    std::vector<std::string> arguments{"import", path, "--out", (folder / "out.nrrd").string()};
    if (!scan.words.empty()) CHECK(run(arguments).code == 2);  // 1 mm for a tooth
    arguments.insert(arguments.end(), scan.words.begin(), scan.words.end());
    const Outcome made = run(arguments);
    CAPTURE(made.err);
    REQUIRE(made.code == 0);
    const std::size_t at = made.out.find("\nsurface") + 8;
    const double surface = std::stod(made.out.substr(at));
    CHECK(surface > scan.least);
    CHECK(surface < scan.most);
    CHECK(has(made.out, "bone") == scan.words.empty());
  }
}

TEST_CASE("a PNG has the bytes that its standard asks for") {
  const std::string bytes = png_bytes({1, 1, {255, 0, 0}});
  CHECK(bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n");
  CHECK(bytes.substr(8, 8) == std::string("\0\0\0\x0dIHDR", 8));
  CHECK(bytes.substr(16, 13) == std::string("\0\0\0\1\0\0\0\1\x08\x02\0\0\0", 13));
  CHECK(bytes.substr(29, 4) == "\x90\x77\x53\xde");  // the checksum of every picture of 1 x 1
  CHECK(bytes.substr(bytes.size() - 12) == std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12));
}

}  // namespace kerf::import_test
