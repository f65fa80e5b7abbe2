// SPDX-License-Identifier: Apache-2.0
// Pictures and videos as files.
#include "visualizer/picture/image_files.hpp"

#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <rapidcheck.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/posix/atomic_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::image_files_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace fs = std::filesystem;

namespace {

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
    write_png(folder / "a.png", size, rgb);
    const RgbPicture found = read_png(folder / "a.png").value();
    RC_ASSERT(found.rgb == rgb);
    RC_ASSERT(found.size == size);
  }));
}

TEST_CASE("a disk that fills up leaves the old file and nothing else, and one line says so") {
  const TemporaryFolder folder;
  const fs::path file = folder / "report.json";
  write_new_file(file, "oooooooooo");
  {
    const SmallDisk disk(100);
    CHECK_THROWS_AS(write_new_file(file, std::string(500, 'n')), FileError);
  }
  CHECK(text_of(file) == "oooooooooo");
  CHECK(folder.count() == 1);
}

TEST_CASE("a place that cannot be written is named") {
  CHECK_THROWS_WITH_AS(write_new_file("/nonexistent/a.png", "x"),
                       doctest::Contains("/nonexistent/a.png: cannot be written"), FileError);
  CHECK_THROWS_AS(make_folder("/dev/null/folder"), VisualizerError);
}

namespace fs = std::filesystem;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// As a player shows it: BT.709, limited range.
std::array<double, 3> rgb_of(double y, double cb, double cr) {
  const double luma = (y - 16.0) / 219.0;
  const double blue = (cb - 128.0) / 224.0 * 1.8556;
  const double red = (cr - 128.0) / 224.0 * 1.5748;
  const double r = luma + red;
  const double b = luma + blue;
  return {255.0 * r, 255.0 * (luma - 0.2126 * r - 0.0722 * b) / 0.7152, 255.0 * b};
}

struct Video {
  std::string header;
  std::vector<Bytes> frames;
};

Video read_back(const fs::path& file, PictureSize size) {
  std::ifstream stream(file, std::ios::binary);
  Video video;
  std::getline(stream, video.header);
  const auto half = [](int side) { return static_cast<std::size_t>((side + 1) / 2); };
  const std::size_t bytes =
      static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) +
      2 * half(size.width) * half(size.height);
  for (std::string mark; std::getline(stream, mark);) {
    REQUIRE(mark == "FRAME");
    Bytes frame(bytes);
    REQUIRE(
        stream.read(reinterpret_cast<char*>(frame.data()), static_cast<std::streamsize>(bytes)));
    video.frames.push_back(frame);
  }
  return video;
}

void paint(const RenderTarget& target, float brightness) {
  const float colour[4] = {brightness, brightness, brightness, 1.0F};
  glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, colour);
}

/// The one line of what `act` throws; empty where it does not.
template <typename Act>
std::string problem_of(const Act& act) {
  try {
    act();
  } catch (const FileError& problem) {
    return problem.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a player that decodes BT.709 in limited range shows the colours that were drawn") {
  CHECK(rc::check([] {
    const PictureSize size{*rc::gen::inRange(1, 8), *rc::gen::inRange(1, 8)};
    const std::array<int, 3> colour{*rc::gen::inRange(0, 256), *rc::gen::inRange(0, 256),
                                    *rc::gen::inRange(0, 256)};
    const auto pixels = static_cast<std::size_t>(size.width * size.height);
    Bytes rgb, yuv;
    for (std::size_t i = 0; i < 3 * pixels; ++i) {
      rgb.push_back(static_cast<std::uint8_t>(colour[i % 3]));
    }
    fill_yuv420(size, rgb, yuv);
    const std::size_t squares = (yuv.size() - pixels) / 2;
    // Half a step of each of the three values.
    constexpr std::array kMost{0.6 + 0.5 * 1.8, 0.6 + 0.5 * 0.8, 0.6 + 0.5 * 2.2};
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t square = i % squares;
      const auto seen = rgb_of(yuv[i], yuv[pixels + square], yuv[pixels + squares + square]);
      for (std::size_t c = 0; c < 3; ++c) RC_ASSERT(std::abs(seen[c] - colour[c]) <= kMost[c]);
    }
  }));
  Bytes yuv;
  fill_yuv420({2, 1}, Bytes{255, 255, 255, 0, 0, 0}, yuv);
  CHECK(yuv == Bytes{235, 16, 128, 128});  // white and black are the ends of the range
}

TEST_CASE("colour differences are those of the mean of their square, also at an odd side") {
  Bytes yuv;
  fill_yuv420({3, 1}, Bytes{0, 0, 255, 0, 0, 0, 0, 0, 255}, yuv);
  REQUIRE(yuv.size() == 3 + 2 * 2);
  CHECK(yuv[3] == 184);  // half blue: 128 + 112 / 2
  CHECK(yuv[4] == 240);  // the last column stands for two
}

TEST_CASE("a video plays in true time whenever pictures come") {
  if (!have_gl()) return;
  const TemporaryFolder folder;
  const PictureSize size{5, 3};
  const RenderTarget target(size);
  const fs::path file = folder / "a.y4m";
  {
    Film film(file.string(), size, 60);
    const auto at = [&](double servo_s, float brightness) {
      paint(target, brightness);
      film.add(target, servo_s);
    };
    at(7.0, 0.0F);    // frame 0
    at(7.010, 0.2F);  // too early
    CHECK(film.due_in_s(7.010) == doctest::Approx(1.0 / 60.0 - 0.010));
    at(7.017, 0.4F);        // frame 1
    at(7.0835, 0.6F);       // late: frames 2 to 5
    at(0.5, 0.8F);          // another controller: no time has passed
    at(0.5 + 0.017, 1.0F);  // frame 6
    CHECK(film.file().frames() == 7);
  }
  const Video video = read_back(file, size);
  CHECK(video.header == "YUV4MPEG2 W5 H3 F60:1 Ip A1:1 C420jpeg XCOLORRANGE=LIMITED");
  std::vector<int> luma;
  for (const Bytes& frame : video.frames) luma.push_back(frame[0]);
  CHECK(luma == std::vector<int>{16, 104, 147, 147, 147, 147, 235});
}

TEST_CASE("a picture of another size ends the video, and the picture goes on") {
  if (!have_gl()) return;
  const TemporaryFolder folder;
  const fs::path file = folder / "a.y4m";
  std::optional<Film> film(std::in_place, file.string(), PictureSize{4, 4}, 30);
  CHECK_FALSE(add_frame(film, RenderTarget({4, 4}), 0.0));
  CHECK(film);
  const auto problem = add_frame(film, RenderTarget({6, 4}), 1.0);
  REQUIRE(problem);
  CHECK(problem->find("another size") != std::string::npos);
  CHECK_FALSE(film);
  CHECK_FALSE(add_frame(film, RenderTarget({6, 4}), 1.0));  // nothing to do
  CHECK(read_back(file, {4, 4}).frames.size() == 1);
}

TEST_CASE("a full disk leaves whole frames and says so in one line") {
  const TemporaryFolder folder;
  const PictureSize size{64, 64};
  const Bytes frame(64 * 64 * 3 / 2, 100);
  const fs::path file = folder / "a.y4m";
  std::string problem;
  {
    const SmallDisk disk(20'000);
    problem = problem_of([&] {
      VideoFile video(file.string(), size, 60);
      while (true) video.write_frame(frame);
    });
  }
  CHECK(problem == "video " + file.string() +
                       ": File too large; name a place with room (3 frames are written)");
  CHECK(read_back(file, size).frames.size() == 3);
  CHECK(problem_of([&] { VideoFile("/dev/full", size, 60); }).find("No space left") !=
        std::string::npos);
  CHECK(problem_of([&] {
          VideoFile((folder / "none/a.y4m").string(), size, 60);
        }).find("choose another place") != std::string::npos);
  const std::string link = (folder / "link.y4m").string();
  std::filesystem::create_symlink(folder / "another's", link);
  CHECK(problem_of([&] { VideoFile(link, size, 60); }).find("is a link; name a file itself") !=
        std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "another's"));
}

TEST_CASE("a name that ends in .mp4 is written by ffmpeg, and is whole when the film ends") {
  const TemporaryFolder folder;
  const std::string path_before = std::getenv("PATH");
  const PictureSize size{64, 64};
  const Bytes frame(64 * 64 * 3 / 2, 100);
  const std::string file = (folder / "-a film.mp4").string();
  setenv("PATH", folder.path().c_str(), 1);
  CHECK_FALSE(have_ffmpeg());
  CHECK(problem_of([&] { VideoFile(file, size, 60); }).find("no ffmpeg to compress it; apt-get") !=
        std::string::npos);
  CHECK(video_growth("a.y4m", {640, 480}, 60).starts_with("raw, 28 MB a second; ffmpeg would"));
  const auto become = [&](const std::string& script) {
    folder.write("ffmpeg", "#!/bin/sh\nPATH=" + path_before + "\n" + script);
    chmod((folder / "ffmpeg").c_str(), 0755);
  };
  // Writes what it reads, later than it is closed, to its last argument.
  become(
      "for last; do :; done\ncat >\"${last#file:}.part\"\nsleep 0.2\n"
      "mv \"${last#file:}.part\" \"${last#file:}\"\n");
  {
    VideoFile video(file, size, 60);
    for (int i = 0; i < 40; ++i) video.write_frame(frame);
  }
  CHECK(read_back(file, size).frames.size() == 40);
  CHECK(video_growth("a.y4m", {640, 480}, 60).ends_with("ends in .mp4 compresses it"));
  CHECK(video_growth("a.mkv", size, 60).empty());
  CHECK(video_growth("-", size, 60).empty());
  CHECK(video_growth("/dev/null", size, 60).empty());
  become("exit 1\n");
  CHECK(problem_of([&] {
          VideoFile video(file, size, 60);
          while (true) video.write_frame(frame);
        }).find("ffmpeg has ended; make room, or name a .y4m") != std::string::npos);
  setenv("PATH", path_before.c_str(), 1);
}

TEST_CASE("a reader that is not there, goes away or takes nothing is told in one line") {
  const TemporaryFolder folder;
  const PictureSize size{256, 256};
  const Bytes frame(256 * 256 * 3 / 2, 100);
  const std::string pipe = (folder / "pipe").string();
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(problem_of([&] { VideoFile(pipe, size, 60); }).find("start the reader first") !=
        std::string::npos);
  int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  {
    VideoFile video(pipe, size, 60);
    CHECK(problem_of([&] { video.write_frame(frame); }).find("takes nothing any more") !=
          std::string::npos);
  }
  close(reader);
  reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);  // empty again
  VideoFile video(pipe, size, 60);
  close(reader);
  CHECK(problem_of([&] { video.write_frame(frame); }).find("its reader has gone") !=
        std::string::npos);
}

}  // namespace kerf::image_files_test
