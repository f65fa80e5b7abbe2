// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/monkey/monkey.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <imgui.h>

#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr auto kMonkeyFrame = std::chrono::milliseconds(17);
constexpr const char* kMonkeyName = "monkey";
// Odd, narrow, of one pixel; the larger ones hold whole panels and some.
constexpr auto kSizes = std::to_array<PictureSize>({{160, 120},
                                                    {161, 80},
                                                    {97, 73},
                                                    {256, 256},
                                                    {320, 240},
                                                    {401, 301},
                                                    {1, 1},
                                                    {2, 37},
                                                    {230, 1}});
constexpr PictureSize kDefaultSize{800, 600}, kLargeSize{1100, 760};

/// While one lives, panels are made in a context of their own.
class OtherPanels {
 public:
  OtherPanels() { ImGui::SetCurrentContext(nullptr); }
  ~OtherPanels() { ImGui::SetCurrentContext(own_); }
  OtherPanels(const OtherPanels&) = delete;
  OtherPanels& operator=(const OtherPanels&) = delete;

 private:
  ImGuiContext* const own_ = ImGui::GetCurrentContext();
};

std::string size_text(PictureSize size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

std::string settings_text(const ViewSettings& settings) {
  return settings.renderer + (settings.clip.on ? ", cut open" : "") +
         (settings.stereo.on ? ", stereo" : "") + (settings.voxel_tool ? ", voxel tool" : "") +
         ", gradient " + std::string(name_of(settings.gradient));
}

/// "N pixels, within (x, y) to (x, y)", from the upper left corner; empty if they are equal.
std::string difference_of(const MonkeyPicture& a, const MonkeyPicture& b) {
  if (a.rgb == b.rgb && a.size == b.size) return {};
  if (a.size != b.size) return "a size of " + size_text(a.size) + " and not " + size_text(b.size);
  int count = 0;
  PixelRect where;
  for (int y = 0; y < a.size.height; ++y) {
    for (int x = 0; x < a.size.width; ++x) {
      const auto at = 3 * static_cast<std::ptrdiff_t>(y * a.size.width + x);
      if (std::equal(a.rgb.begin() + at, a.rgb.begin() + at + 3, b.rgb.begin() + at)) continue;
      ++count;
      where = where.united({x, y, x + 1, y + 1});
    }
  }
  return std::to_string(count) + " pixels, within (" + std::to_string(where.x0) + ", " +
         std::to_string(where.y0) + ") to (" + std::to_string(where.x1) + ", " +
         std::to_string(where.y1) + ")";
}

}  // namespace

Monkey::Count& Monkey::Count::operator+=(const Count& more) noexcept {
  events += more.events;
  frames += more.frames;
  compared += more.compared;
  return *this;
}

Monkey::Monkey(const GlContext& context, const Habits& habits)
    : window_(habits.window),
      large_(habits.large),
      dice_(habits.seed),
      size_(habits.large ? kLargeSize : kSizes.front()) {
  options_.name = kMonkeyName;
  options_.size = size_;
  options_.out = habits.folder;
  const auto kinds = renderer_kinds();
  options_.settings.renderer = dice_.one_of(std::span<const std::string_view>(kinds));
  controller_ = std::make_unique<MonkeyController>(kMonkeyName, dice_);
  run_.emplace(options_, Session(kMonkeyName), context);
  // Some runs see each change at once; the others coarsely at first, whatever it costs.
  constexpr double kFewPixels = 2500, kManyPixels = 60'000;
  run_->set_most_pixels(dice_.once_in(2) ? std::numeric_limits<double>::infinity()
                        : habits.large   ? kManyPixels
                                         : kFewPixels);
  event_ = "begin with " + options_.settings.renderer;
}

void Monkey::act() {
  event_.clear();
  ++count_.events;
  // Some frames long nothing is compared: the fresh picture might put right what the window's left
  // behind in GL.
  for (int frames = dice_.once_in(4) ? 1 + dice_.below(6) : 1; frames > 0; --frames) {
    WindowInput input;
    for (int things = dice_.once_in(3) ? 2 + dice_.below(3) : 1; things > 0; --things) {
      choose(input);
    }
    if (frames > 1) say("then");
    frame(input);
  }
  rest();
  compare();
}

void Monkey::say(const std::string& what) {
  event_ += (event_.empty() ? "" : ", ") + what;
}

void Monkey::choose(WindowInput& input) {
  switch (dice_.below(8)) {
    case 0:
    case 1:
      return press_key(input);
    case 2:
    case 3:
      return use_mouse(input);
    case 4:
      return use_panel(input);
    case 5:
      return resize(input);
    default:
      return use_controller();
  }
}

void Monkey::press_key(WindowInput& input) {
  constexpr std::string_view kOften = "vvvvbccxxyttttlhpp123456789rzZu";
  constexpr std::string_view kSeldom = "sewm";  // each leaves a file
  const std::string_view keys = dice_.once_in(15) ? kSeldom : kOften;
  input.keys.push_back(keys[static_cast<std::size_t>(dice_.below(static_cast<int>(keys.size())))]);
  say(std::string("key ") + input.keys.back());
}

void Monkey::use_mouse(WindowInput& input) {
  switch (dice_.below(7)) {
    case 0:
      input.turn_right += dice_.between(-0.3, 0.3);
      input.turn_up += dice_.between(-0.3, 0.3);
      return say("turn");
    case 1:
      input.move_right += dice_.between(-0.2, 0.2);
      input.move_up += dice_.between(-0.2, 0.2);
      return say("pan");
    case 2:
      input.exposed = true;
      return say("expose");
    case 3:  // with the wheel, as a hand does both
      input.drag_right += dice_.between(-0.3, 0.3);
      input.drag_up += dice_.between(-0.3, 0.3);
      input.wheel += dice_.below(7) - 3;
      return say("drag and wheel");
    case 4:
      input.plane += dice_.below(9) - 4;
      return say("move the plane");
    case 5:
      input.zoom += dice_.below(7) - 3;
      return say("zoom");
    default:
      input.wheel += dice_.below(7) - 3;
      if (dice_.once_in(20)) input.wheel *= 20.0;  // into a volume, or far away
      return say("wheel");
  }
}

/// The controls stand in the lower left corner.
void Monkey::use_panel(WindowInput& /*input*/) {
  constexpr int kWide = 240, kHigh = 230;
  pointer_.x = dice_.below(std::min(kWide, size_.width) + 1);
  pointer_.y = size_.height - dice_.below(std::min(kHigh, size_.height) + 1);
  if (dice_.once_in(6)) pointer_.x += 0.5 * size_.width;  // what the other eye sees
  pointer_.down = !dice_.once_in(4);
  release_ = pointer_.down && !dice_.once_in(3);  // else it is dragged
  say("pointer " + std::to_string(static_cast<int>(pointer_.x)) + " " +
      std::to_string(static_cast<int>(pointer_.y)) + (pointer_.down ? " down" : ""));
}

void Monkey::resize(WindowInput& input) {
  size_ = dice_.one_of(std::span<const PictureSize>(kSizes));
  if (dice_.once_in(4)) size_ = {1 + dice_.below(300), 1 + dice_.below(200)};
  if (large_ || dice_.once_in(40)) size_ = dice_.once_in(2) ? kDefaultSize : kLargeSize;
  if (dice_.once_in(12)) (dice_.once_in(2) ? size_.width : size_.height) = 0;
  input.exposed = true;
  // The window follows when the screen lets it: until then it shows pictures of another size.
  if (window_ != nullptr && size_.width > 0 && size_.height > 0) window_->resize(size_);
  say("resize " + size_text(size_));
}

void Monkey::use_controller() {
  switch (const int what = dice_.below(20)) {
    case 0:
      return restart_controller();
    case 1:
      say("refill");
      return controller_->refill(dice_);
    case 2:
      say("tick");
      return controller_->tick();
    case 3:
      say("hours pass");
      now_ += std::chrono::hours(1);
      return;
    default:
      say(what < 12 ? "cut" : "move");
      return what < 12 ? controller_->cut(dice_) : controller_->move(dice_);
  }
}

void Monkey::restart_controller() {
  if (dice_.once_in(2)) {
    controller_->end(dice_.once_in(2) ? Lifecycle::clean_end : Lifecycle::fault);
    say("end");
  }
  if (dice_.once_in(3)) return;  // it stays in the list
  controller_.reset();
  controller_ = std::make_unique<MonkeyController>(kMonkeyName, dice_);
  now_ += std::chrono::seconds(dice_.below(2));  // the window looks for it now and then
  say("another controller");
}

void Monkey::frame(const WindowInput& input) {
  WindowInput all = input;
  all.pointer = pointer_;
  now_ += kMonkeyFrame;
  ++count_.frames;
  const WindowRun::Frame frame = run_->step(all, size_, now_);
  rests_ = frame.drawn == nullptr;
  if (!rests_) shown_ = {size_, frame.drawn->read_rgb()};
  if (window_ != nullptr) {
    static_cast<void>(window_->poll());
    if (!rests_) window_->present(*frame.drawn, frame.parts);
  }
  if (release_) pointer_.down = release_ = false;
}

/// What moves may be drawn coarsely, and a button goes up in a frame of its own.
void Monkey::rest() {
  constexpr int kMost = 6;  // a release, the setting it changes, the tool's rest
  constexpr int kMostFiner = 2000;
  frame({});
  for (int frames = 0, finer = 0; frames < kMost && finer < kMostFiner && !rests_;) {
    ++(run_->picture().is_late() ? finer : frames);
    frame({});
  }
  if (!rests_) {
    throw VisualizerError("frames do not come to rest, though nothing happens");
  }
}

void Monkey::compare() {
  if (size_.width == 0 || size_.height == 0) return;
  ++count_.compared;
  expected_ = drawn_anew();
  const std::string differs = difference_of(shown_, expected_);
  if (differs.empty()) return;
  // Whether what was kept is wrong, or the renderers hold something else than the volumes.
  const MonkeyPicture wrong = shown_;
  run_->picture().redraw_all();
  frame({});
  const bool kept = shown_.rgb == expected_.rgb;
  shown_ = wrong;
  throw VisualizerError(settings_text(run_->picture().settings()) + " at " + size_text(size_) +
                        " shows another picture than one drawn anew: " + differs + "; all of it " +
                        (kept ? "drawn again is right" : "drawn again stays wrong"));
}

MonkeyPicture Monkey::drawn_anew() {
  const RenderTarget target(size_);
  std::optional<Session> other;
  if (!run_->session().ended()) other.emplace(kMonkeyName);
  const Session& session = other ? *other : run_->session();
  {
    const OtherPanels panels;
    Picture picture(session, run_->picture().settings(), 1.0);
    picture.camera() = run_->picture().camera();
    OverlayFigures no_panels;
    no_panels.hidden = true;
    static_cast<void>(picture.draw(session, no_panels, target));
  }
  glUseProgram(0);  // panels put back what was in use, and that has gone
  run_->picture().draw_panels(target);
  return {size_, target.read_rgb()};
}

}  // namespace kerf
