// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/window_keys.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "shared/text/text.hpp"
#include "visualizer/compose/tool_painter.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/visualizer_error.hpp"
#include "visualizer/surface/volume_surface.hpp"

namespace kerf {
namespace {

/// The first free name of kerf-0001, kerf-0002 and so on in `folder`, which is made if missing.
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
Notice write_for_user(const std::string& what, const Write& write) {
  try {
    return {what + ": " + write().string()};
  } catch (const std::runtime_error& problem) {
    return {problem.what(), true};
  }
}

using namespace std::string_literals;

constexpr double kMmPerNotch = 0.25;  // of the clip plane, as of a hand's depth

std::optional<glm::dvec3> tip_of(const Session& session) {
  const auto hand = session.latest() ? hand_of(*session.latest()) : std::nullopt;
  return hand ? std::optional(hand->tip_mm) : std::nullopt;
}

/// A slip of a finger must not undo what was cut: the key is pressed twice.
void undo_all(std::optional<Notices::Clock::time_point>& asked, Session& session, Notices& notices,
              Notices::Clock::time_point now) {
  const bool again = asked && now - *asked < Notices::kShownFor;
  asked = again ? std::nullopt : std::optional(now);
  if (!again) {
    notices.say({"u again: undo all cuts"}, now);
  } else if (session.reset()) {
    notices.say({"all cuts are undone"}, now);
  } else {
    notices.say({"undo: the controller did not take it; press u twice again", true}, now);
  }
}

constexpr std::uint32_t kRestores = kFlagReset | kFlagUndo | kFlagRedo;

void undo_stroke(Session& session, Notices& notices, Notices::Clock::time_point now) {
  const auto& newest = session.latest();
  if (!newest || (newest->flags & kFlagUndoable) == 0) {
    const std::vector<double> removed_mm3 = session.removed_by_material_mm3();
    const bool removed = std::ranges::any_of(removed_mm3, [](double mm3) { return mm3 > 0.0; });
    notices.say({no_undo(newest, removed, session.cut_before()), true}, now);
  } else if (session.undo()) {
    notices.say({"the last stroke is undone; shift and z cuts it again"}, now);
  } else {
    notices.say({"undo: the controller did not take it; press z again", true}, now);
  }
}

void redo_stroke(Session& session, Notices& notices, Notices::Clock::time_point now) {
  const auto& newest = session.latest();
  if (newest && (newest->flags & kRestores) != 0) {
    notices.say({"redo: what was asked before is still being done; press shift and z again", true},
                now);
  } else if (!newest || (newest->flags & kFlagRedoable) == 0) {
    notices.say({"redo: no stroke was undone since the last cut", true}, now);
  } else if (session.redo()) {
    notices.say({"the stroke is cut again"}, now);
  } else {
    notices.say({"redo: the controller did not take it; press shift and z again", true}, now);
  }
}

void mark_tick(Session& session, Notices& notices, Notices::Clock::time_point now) {
  const auto& newest = session.latest();
  if (newest && session.mark()) {
    notices.say({"marked tick " + std::to_string(newest->tick)}, now);
  } else {
    notices.say({"mark: the controller did not take it; press f again", true}, now);
  }
}

}  // namespace

std::string no_undo(const std::optional<TickRecord>& newest, bool removed, bool cut_before) {
  const std::uint32_t flags = newest ? newest->flags : 0;
  if ((flags & kRestores) != 0) {
    return "undo: what was asked before is still being done; press z again";
  }
  if ((flags & kFlagRedoable) != 0) {  // some are undone, and none is kept from before them
    return removed ? "undo: older strokes are not kept: 20 are, with at most 12 MiB of voxels; "
                     "u, u undoes all cuts"
                   : "undo: all strokes are undone; shift and z cuts the last one again";
  }
  if (removed) {  // a stroke that fits could be undone
    return "undo: the last stroke is too long to be kept, above 12 MiB of voxels; u, u undoes all "
           "cuts";
  }
  return cut_before ? "undo: no stroke since this window joined; u, u undoes all cuts"
                    : "undo: nothing has been cut";
}

std::string no_such_tool(std::size_t index, std::size_t tools) {
  const std::string last =
      tools > 1 ? " to " + std::to_string(std::min<std::size_t>(tools, 9)) : "";
  return "tool " + std::to_string(index + 1) + ": the scene has " + std::to_string(tools) +
         "; press 1" + last;
}

void change_view(Picture& picture, const Session& session, const ViewSettings& settings,
                 Notices& notices, Notices::Clock::time_point now) {
  try {
    picture.set_view(session, settings);
  } catch (const VisualizerError& problem) {
    notices.say({problem.what(), true}, now);
  }
}

void take_tool(std::size_t index, Session& session, Notices& notices,
               Notices::Clock::time_point now) {
  const std::size_t tools = session.scene().tools.size();
  if (index >= tools) {
    notices.say({no_such_tool(index, tools), true}, now);
  } else if (!session.select_tool(static_cast<std::uint32_t>(index))) {
    notices.say(
        {"tool "s + std::to_string(index + 1) + ": the controller did not take it; choose it again",
         true},
        now);
  }
}

void WindowKeys::switch_panel(bool& panel, bool& other) {
  panel = hidden || !panel;
  other = false;
  hidden = false;
}

bool WindowKeys::apply(const WindowInput& input, Session& session, Picture& picture, double aspect,
                       Notices& notices, Notices::Clock::time_point now) {
  bool quit = input.close;
  ViewSettings settings = picture.settings();
  const std::vector<VolumeView>& volumes = session.scene().volumes;
  if (one > volumes.size()) one = 0;  // another controller may show fewer
  for (const char key : input.keys) {
    if (key == 'q') quit = true;
    if (key == 'r') picture.reset_camera(aspect);
    if (key == 's') screenshot = true;
    if (key == 'e') mesh = true;
    if (key == 'w') write = true;
    if (key == 'n') note = true;
    if (key == 'm') film = !film;
    if (key == 'h') {  // panels, the keys page by page, none
      const bool next = !hidden && help < help_pages;
      hidden = !hidden && !next;
      help = next ? help + 1 : 0;
    }
    if (key == 'l') switch_panel(slices, plot);
    if (key == 'p') switch_panel(plot, slices);
    if (key == 'v') {
      settings.renderer = one > 0 ? next_renderer(settings.renderer, volumes.size(), one - 1)
                                  : next_renderer(settings.renderer);
    }
    if (key == 'b') {
      one = (one + 1) % (volumes.size() + 1);
      notices.say({"v: " + (one > 0 ? volumes[one - 1].name : "all volumes")}, now);
    }
    if (key == 'o') open = !open;
    if (key == 'g') come = true;
    if (key == 'k') park = true;
    if (key == 'z') undo_stroke(session, notices, now);
    if (key == 'Z') redo_stroke(session, notices, now);
    if (key == 'u') undo_all(undo_asked, session, notices, now);
    end_press = end_press || key == 'z' || key == 'Z' || key == 'u';
    if (key == 'f') mark_tick(session, notices, now);
    if (key == 'c') settings.clip.on = !settings.clip.on;
    if (key == 'x') settings.clip = picture.facing_plane(tip_of(session));
    if (key == 'y') settings.colour_blind = !settings.colour_blind;
    if (key == 't') settings.stereo.on = !settings.stereo.on;
    if (key >= '1' && key <= '9') {
      take_tool(static_cast<std::size_t>(key - '1'), session, notices, now);
    }
  }
  if (settings.clip.on && input.plane != 0.0) {
    settings.clip = picture.moved(settings.clip, -kMmPerNotch * input.plane);
  }
  change_view(picture, session, settings, notices, now);
  return quit;
}

Notice take_screenshot(const VisualizerOptions& options, const RenderTarget& target) {
  return write_for_user("screenshot", [&] {
    const std::filesystem::path file = unused_file(options.out, ".png");
    write_png(file, target.size(), target.read_rgb());
    return file;
  });
}

Notice toggle_film(const VisualizerOptions& options, PictureSize size, std::optional<Film>& film) {
  if (film) {
    const VideoFile& file = film->file();
    const std::string path = file.path(), frames = std::to_string(file.frames());
    film.reset();  // completes the file
    std::error_code fault;
    const auto bytes = std::filesystem::file_size(path, fault);
    return {"video: " + path + ": " + frames + " frames" +
            (fault
                 ? ""
                 : ", " + number_text(std::round(static_cast<double>(bytes) / 1e5) / 10) + " MB")};
  }
  Notice begun = write_for_user("video begins", [&] {
    const std::filesystem::path file = unused_file(options.out, have_ffmpeg() ? ".mp4" : ".y4m");
    film.emplace(file.string(), size, options.video_hz);
    return file;
  });
  if (film) {
    const std::string growth = video_growth(film->file().path(), size, options.video_hz);
    if (!growth.empty()) begun.text += " (" + growth + ")";
  }
  return begun;
}

Notice write_opacities(const VisualizerOptions& options, const Picture& picture) {
  return write_for_user("opacities", [&] {
    const std::filesystem::path file =
        options.transfer ? *options.transfer : unused_file(options.out, ".toml");
    write_transfer(file, picture.opacities());
    return file;
  });
}

Notice write_view(const VisualizerOptions& options, const Picture& picture) {
  return write_for_user("view", [&] {
    const std::filesystem::path file =
        options.camera_file ? *options.camera_file : unused_file(options.out, "-camera.toml");
    write_camera(file, picture.camera().pose());
    return file;
  });
}

Notice export_mesh(const VisualizerOptions& options, const Session& session) {
  return write_for_user("surface", [&] {
    const std::filesystem::path file =
        options.mesh ? *options.mesh : unused_file(options.out, ".ply");
    export_surface(file, session.scene(), session.contents());
    return file;
  });
}

}  // namespace kerf
