// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <doctest/doctest.h>
#include <png.h>
#include <rapidcheck.h>
#include <sys/resource.h>
#include <unistd.h>

#include "shared/posix/atomic_file.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/scene/visualizer_error.hpp"

using namespace kerf;
namespace fs = std::filesystem;

namespace {

struct TemporaryFolder {
  fs::path path = fs::temp_directory_path() / ("kerf-file-out-" + std::to_string(::getpid()));
  TemporaryFolder() { fs::create_directories(path); }
  ~TemporaryFolder() { fs::remove_all(path); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

std::vector<std::uint8_t> read_png(const fs::path& file, PictureSize& size) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, file.c_str()) != 0);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(image));
  REQUIRE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr) != 0);
  size = {static_cast<int>(image.width), static_cast<int>(image.height)};
  return rgb;
}

/// A disk with room for `bytes` more per file, as far as this process can tell.
struct SmallDisk {
  rlimit before{};
  explicit SmallDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() { setrlimit(RLIMIT_FSIZE, &before); }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
};

}  // namespace

TEST_CASE("a PNG holds exactly the pixels that were written") {
  const TemporaryFolder folder;
  CHECK(rc::check([&] {
    const PictureSize size{*rc::gen::inRange(1, 40), *rc::gen::inRange(1, 40)};
    const auto count = static_cast<std::size_t>(size.width * size.height * 3);
    const auto rgb =
        *rc::gen::container<std::vector<std::uint8_t>>(count, rc::gen::arbitrary<std::uint8_t>());
    write_png(folder.path / "a.png", size, rgb);
    PictureSize found;
    RC_ASSERT(read_png(folder.path / "a.png", found) == rgb);
    RC_ASSERT(found == size);
  }));
}

TEST_CASE("a disk that fills up leaves the old file and nothing else, and one line says so") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "report.json";
  write_new_file(file, "oooooooooo");
  {
    const SmallDisk disk(100);
    CHECK_THROWS_AS(write_new_file(file, std::string(500, 'n')), FileError);
  }
  std::ifstream stream(file, std::ios::binary);
  CHECK(std::string(std::istreambuf_iterator<char>(stream), {}) == "oooooooooo");
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
}

TEST_CASE("a place that cannot be written is named") {
  CHECK_THROWS_WITH_AS(write_new_file("/nonexistent/a.png", "x"),
                       doctest::Contains("/nonexistent/a.png: cannot be written"), FileError);
  CHECK_THROWS_AS(make_folder("/dev/null/folder"), VisualizerError);
}
