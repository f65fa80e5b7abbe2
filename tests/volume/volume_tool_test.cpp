// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include <doctest/doctest.h>

#include "controller/load/load_scene.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "controller/volume/phantom.hpp"
#include "controller/volume/windowing.hpp"
#include "tests/json.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::volume_tool_test {

using namespace kerf::test;

namespace {

std::string blob_file(const TemporaryFolder& folder) {
  VolumeImage image = air({12, 12, 12});
  std::vector<std::uint8_t> values(12 * 12 * 12, 10);
  for (const int x : {5, 6, 7}) values[image.grid.index(x, 5, 5)] = 210;
  return folder
      .write("blob.nrrd",
             nrrd("uint8", "spacings: 0.5 0.5 1\n", "raw", "12 12 12") + "\n" + bytes_of(values))
      .string();
}

}  // namespace

TEST_CASE("help and version are answers, not errors") {
  CHECK(run({"--help"}).code == 0);
  CHECK(has(run({"--help"}).out, "resample"));
  CHECK(has(run({"info", "--help"}).out, "--report"));
  CHECK(run({"--version"}).out == KERF_VERSION "\n");
  CHECK(run({"--version"}).code == 0);
}

TEST_CASE("info tells size, spacing, values and what is solid, the same in its report") {
  const TemporaryFolder folder;
  const std::string report = (folder / "r.json").string();
  const Outcome result = run({"info", blob_file(folder), "--report", report});
  REQUIRE(result.code == 0);
  CHECK(has(result.out, "12 x 12 x 12 voxels"));
  CHECK(has(result.out, "0.5 x 0.5 x 1 mm"));
  CHECK(has(result.out, "10 .. 210"));
  CHECK(has(result.out, "(5, 5, 5) .. (7, 5, 5)"));
  const auto json = read_json_file(report);
  CHECK(json["size_vox"] == ReadJson(Json::List{12, 12, 12}));
  CHECK(json["spacing_mm"] == ReadJson(Json::List{0.5, 0.5, 1.0}));
  CHECK(json["solid_box"]["hi"] == ReadJson(Json::List{8, 6, 6}));
  CHECK(json["solid_ratio"].get<double>() == doctest::Approx(3.0 / 1728));
  CHECK(json["otsu_value"].get<double>() == doctest::Approx(110).epsilon(0.02));
  std::uint64_t voxels = 0;
  for (const kerf::Json& count : json["histogram"]) voxels += count.get<std::uint64_t>();
  CHECK(voxels == 1728);
}

TEST_CASE("info tells the noise in one line") {
  const TemporaryFolder folder;
  const VoxelGrid grid{24, 24, 24};
  std::vector<std::uint8_t> values(grid.voxel_count());
  std::mt19937 random(1);
  std::normal_distribution<double> normal(100, 3);
  for (const auto& [x, y, z] : voxels(VoxelBox{{3, 3, 3}, {21, 21, 21}})) {
    values[grid.index(x, y, z)] = static_cast<std::uint8_t>(std::lround(normal(random)));
  }
  values[grid.index(1, 1, 1)] = 200;
  const std::string file =
      folder
          .write("noisy.nrrd",
                 nrrd("uint8", "spacings: 1 1 1\n", "raw", "24 24 24") + "\n" + bytes_of(values))
          .string();
  const std::string report = (folder / "r.json").string();
  const Outcome info = run({"info", file, "--report", report});
  CHECK(has(info.out, "noise      3."));
  CHECK(info.out.find(" % of the surface's step); denoise = \"auto\" makes 3 passes\n") !=
        std::string::npos);
  const auto json = read_json_file(report);
  CHECK(json["noise_density"].get<double>() == doctest::Approx(3.0 / 200).scale(0).epsilon(0.1));
  CHECK(json["noise_share"].get<double>() ==
        doctest::Approx(3 / 2.0 / json["otsu_value"].get<double>()).scale(0).epsilon(0.1));
  CHECK(json["denoise_passes"] == 3);
  const std::string clean = blob_file(folder);
  CHECK(has(run({"info", clean}).out, "noise      none found\n"));
}

TEST_CASE("crop and resample do what the library does") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out.nrrd").string();
  REQUIRE(run({"crop", blob_file(folder), "--out", out, "--guard", "1", "--raw"}).code == 0);
  CHECK(read_volume(out).grid == VoxelGrid{5, 3, 3});
  REQUIRE(run({"crop", blob_file(folder), "--out", out, "--iso", "0", "--force"}).code == 0);
  CHECK(read_volume(out).grid == VoxelGrid{18, 18, 18});

  REQUIRE(
      run({"resample", blob_file(folder), "--out", out, "--spacing", "1,1,0.5", "--force"}).code ==
      0);
  CHECK(read_volume(out).grid == VoxelGrid{6, 6, 24});
}

TEST_CASE("the phantom and its labels survive phantom, crop and resample") {
  const TemporaryFolder folder;
  const std::string tooth = (folder / "tooth.nrrd").string();
  const std::string part = (folder / "part.nrrd").string();
  REQUIRE(run({"phantom", "--size", "64x64x40", "--out", tooth}).code == 0);
  VolumeImage image = apply_window(read_volume(tooth), {0, kDensityMax});
  read_labels_beside(tooth, image);
  const VolumeImage made = make_phantom({.grid = {64, 64, 40}});
  CHECK(image.density == made.density);
  CHECK(image.labels == made.labels);
  REQUIRE(run({"crop", tooth, "--out", part}).code == 0);
  const std::string finer = (folder / "fine.nrrd").string();
  REQUIRE(run({"resample", part, "--out", finer, "--spacing", "0.25"}).code == 0);
  VolumeImage fine = apply_window(read_volume(finer), {0, kDensityMax});
  read_labels_beside(finer, fine);
  CHECK(fine.labels.size() == fine.density.size());
}

TEST_CASE("each command takes a spacing in place of the file's, and prints that it does") {
  const TemporaryFolder folder;
  const std::string blob = blob_file(folder), out = (folder / "out.nrrd").string();
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"info", blob},
        {"crop", blob, "--out", out},
        {"resample", blob, "--spacing", "1", "--out", out},
        {"import", blob, "--out", out}}) {
    CAPTURE(arguments.front());
    std::vector<std::string> all = arguments;
    for (const char* more : {"--override-spacing", "0.5"}) all.emplace_back(more);
    if (arguments.front() != "info") all.emplace_back("--force");
    const Outcome done = run(all);
    CAPTURE(done.err);
    CHECK(done.code == 0);
    CHECK(has(done.out, "OVERRIDDEN: spacing 0.5 x 0.5 x 0.5 mm in place of the file's"));
  }
  const auto unspaced =
      folder.write("u.nrrd", nrrd("uint8", "") + "\n" + bytes_of(counting<std::uint8_t>()));
  const Outcome asked = run(
      {"resample", unspaced.string(), "--spacing", "1", "--out", (folder / "new.nrrd").string()});
  CHECK(has(asked.err, "give it with --override-spacing"));
}

TEST_CASE("an import leaves a scene that runs, or nothing") {
  const TemporaryFolder folder;
  const std::string blob = blob_file(folder);  // smaller than the usual tools
  REQUIRE(run({"import", blob, "--out", (folder / "small.nrrd").string()}).code == 0);
  CHECK_NOTHROW(static_cast<void>(load_scene(folder / "small.toml")));

  const Outcome wide =
      run({"import", blob, "--override-spacing", "900", "--out", (folder / "wide.nrrd").string()});
  CHECK(wide.code == 2);
  CHECK(wide.out.empty());
  CHECK(has(wide.err, "wide.toml:5: the box needs a workspace scale of "));
  for (const char* kind : {"wide.nrrd", "wide.toml", "wide.png"}) {
    CHECK_FALSE(std::filesystem::exists(folder / kind));
  }
}

TEST_CASE("an import that is refused replaces nothing") {
  const TemporaryFolder folder;
  const std::string blob = blob_file(folder);
  const std::string names[] = {"old.nrrd", "old-labels.nrrd", "old.toml", "old.png"};
  for (const std::string& name : names) folder.write(name, "mine: " + name);
  const Outcome refused = run({"import", blob, "--override-spacing", "900", "--out",
                               (folder / "old.nrrd").string(), "--force"});
  CHECK(refused.code == 2);
  for (const std::string& name : names) {
    CAPTURE(name);
    CHECK(std::filesystem::exists(folder / name));
    CHECK(text_of(folder / name) == "mine: " + name);
  }
  const auto files = std::filesystem::directory_iterator(folder.path());
  CHECK(std::distance(files, std::filesystem::directory_iterator()) == 5);  // and the scan
}

TEST_CASE("a file that is there is replaced where that is asked for, and else stays") {
  const TemporaryFolder folder;
  const std::string blob = blob_file(folder);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"import", blob},
                                                  {"crop", blob},
                                                  {"resample", blob, "--spacing", "1"},
                                                  {"phantom", "--size", "16x16x10"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--out", ""});
    const auto refused = [&](const std::string& out, const std::string& place) {
      arguments.back() = (folder / out).string();
      const Outcome result = run(arguments);
      CHECK(result.code == 2);
      CHECK(result.out.empty());
      CHECK(result.err.starts_with("kerf-volume: " + (folder / place).string() +
                                   ": exists already; "));
    };
    folder.write("there.nrrd", "mine");
    refused("there.nrrd", "there.nrrd");
    CHECK(text_of(folder / "there.nrrd") == "mine");
    const auto labels = folder.write("new-labels.nrrd", "mine");
    refused("new.nrrd", "new-labels.nrrd");
    CHECK(text_of(labels) == "mine");
    std::filesystem::remove(labels);
    arguments.back() = (folder / "there.nrrd").string();
    arguments.emplace_back("--force");
    CHECK(run(arguments).code == 0);
    CHECK(text_of(folder / "there.nrrd").starts_with("NRRD0004"));
    std::filesystem::remove(folder / "there-labels.nrrd");
  }
}

TEST_CASE("no output takes the place of the volume that is read, with --force neither") {
  const TemporaryFolder folder;
  const std::string tooth = (folder / "tooth.nrrd").string(),
                    labels = (folder / "tooth-labels.nrrd").string();
  write_volume(make_phantom({.grid = {48, 48, 30}}), tooth);
  const std::string before = text_of(tooth), labels_before = text_of(labels);
  std::filesystem::create_hard_link(tooth, folder / "same.nrrd");
  std::filesystem::create_hard_link(tooth, folder / "same");
  const std::string same = (folder / "same").string();
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"info", tooth, "--report", tooth},
           {"info", tooth, "--report", labels},
           {"info", tooth, "--report", same},
           {"import", tooth, "--out", tooth, "--force"},
           {"import", tooth, "--out", same + ".nrrd", "--force"},
           {"import", labels, "--out", tooth, "--force"},
           {"crop", tooth, "--out", tooth, "--force"},
           {"resample", tooth, "--out", tooth, "--force", "--spacing", "1"}}) {
    const Outcome refused = run(arguments);
    CAPTURE(refused.err);
    CHECK(refused.code == 2);
    CHECK(refused.out.empty());
    CHECK(is_one_line(refused.err.substr(0, refused.err.size() - 1)));
    const bool wrong_kind = refused.err.find("let it end in .json") != std::string::npos;
    CHECK((wrong_kind || refused.err.find("is a file of this run itself") != std::string::npos));
  }
  CHECK(text_of(tooth) == before);
  CHECK(text_of(labels) == labels_before);
}

TEST_CASE("the time to read has both ends of its range") {
  const TemporaryFolder folder;
  const std::string blob = blob_file(folder);
  CHECK(run({"info", blob, "--read-seconds", "1"}).code == 0);
  CHECK(run({"info", blob, "--read-seconds", "86400"}).code == 0);
  CHECK(run({"info", blob, "--read-seconds", "0"}).code == 2);
  CHECK(run({"info", blob, "--read-seconds", "86401"}).code == 2);
}

}  // namespace kerf::volume_tool_test
