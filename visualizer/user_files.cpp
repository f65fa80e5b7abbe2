// SPDX-License-Identifier: Apache-2.0
#include "visualizer/user_files.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "visualizer/file_out.hpp"
#include "visualizer/surface/export_surface.hpp"
#include "visualizer/transfer_file.hpp"

namespace kerf {

namespace {

/// kerf-0001 and so on in `folder`, which is made where it is missing.
std::filesystem::path unused_file(const std::filesystem::path& folder, const char* ending) {
  make_folder(folder);
  for (int i = 1;; ++i) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "kerf-%04d%s", i, ending);
    if (!std::filesystem::exists(folder / name.data())) return folder / name.data();
  }
}

/// `write` returns the file it wrote.
template <typename Write>
void write_for_user(const char* what, const Write& write) {
  try {
    std::printf("%s: %s\n", what, write().c_str());
  } catch (const std::runtime_error& problem) {
    std::fprintf(stderr, "kerf-visualizer: %s\n", problem.what());
  }
}

}  // namespace

void take_screenshot(const VisualizerOptions& options, const RenderTarget& target) {
  write_for_user("screenshot", [&] {
    const std::filesystem::path file = unused_file(options.out, ".png");
    write_png(file, target.size(), target.read_rgb());
    return file;
  });
}

void toggle_recording(const VisualizerOptions& options, PictureSize size,
                      std::optional<Recording>& recording) {
  if (recording) return recording.reset();
  write_for_user("video", [&] {
    const std::filesystem::path file = unused_file(options.out, ".y4m");
    recording.emplace(file.string(), size, options.video_hz);
    return file;
  });
}

void write_opacities(const VisualizerOptions& options, const Picture& picture) {
  write_for_user("opacities", [&] {
    const std::filesystem::path file =
        options.transfer ? *options.transfer : unused_file(options.out, ".toml");
    write_transfer(file, picture.opacities());
    return file;
  });
}

void export_mesh(const VisualizerOptions& options, const Session& session) {
  write_for_user("surface", [&] {
    const std::filesystem::path file =
        options.mesh ? *options.mesh : unused_file(options.out, ".ply");
    export_surface(file, session.scene(), session.contents());
    return file;
  });
}

}  // namespace kerf
