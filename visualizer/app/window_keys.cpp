// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/window_keys.hpp"

#include <chrono>
#include <string>
#include <vector>

#include "visualizer/error.hpp"
#include "visualizer/render/renderer_choice.hpp"

namespace kerf {

using Clock = std::chrono::steady_clock;

void change_look(Picture& picture, const Session& session, const Look& look, Notices& notices) {
  try {
    picture.set_look(session, look);
  } catch (const VisualizerError& problem) {
    notices.say({problem.what(), true}, Clock::now());
  }
}

bool WindowKeys::apply(const WindowInput& input, Session& session, Picture& picture, double aspect,
                       Notices& notices) {
  bool quit = input.close;
  Look look = picture.look();
  const std::vector<VolumeView>& volumes = session.scene().volumes;
  if (one > volumes.size()) one = 0;  // another controller may show fewer
  for (const char key : input.keys) {
    if (key == 'q') quit = true;
    if (key == 'r') picture.reset_camera(aspect);
    if (key == 's') screenshot = true;
    if (key == 'e') mesh = true;
    if (key == 'w') write = true;
    if (key == 'm') film = !film;
    if (key == 'h') {  // panels, with the keys, none
      const bool shown = !hidden;
      hidden = shown && help;
      help = shown && !help;
    }
    if (key == 'p') plot = !plot;
    if (key == 'v') {
      look.renderer = one > 0 ? next_renderer(look.renderer, volumes.size(), one - 1)
                              : next_renderer(look.renderer);
    }
    if (key == 'b') {
      one = (one + 1) % (volumes.size() + 1);
      notices.say({"v: " + (one > 0 ? volumes[one - 1].name : "all volumes")}, Clock::now());
    }
    if (key == 'c') look.clip.on = !look.clip.on;
    if (key == 't') look.stereo.on = !look.stereo.on;
    const int tool = key - '1';
    if (tool >= 0 && tool < static_cast<int>(session.scene().tools.size())) {
      session.select_tool(static_cast<std::uint32_t>(tool));
    }
  }
  change_look(picture, session, look, notices);
  return quit;
}

}  // namespace kerf
