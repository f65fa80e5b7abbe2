// SPDX-License-Identifier: Apache-2.0
#include "web/tab_run.hpp"

#include <algorithm>
#include <deque>
#include <span>
#include <utility>

#include "bridge/wire/messages.hpp"
#include "controller/device/device_driver.hpp"
#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/plan/compile.hpp"
#include "face/emulated_hand.hpp"
#include "face/lock_step_port.hpp"
#include "hil/device/emulator.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/command.hpp"
#include "shared/segment/writer.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::web {
namespace {

Personality known_device(const std::string& word) {
  if (const auto personality = personality_of(word)) return *personality;
  throw LoadError("device: " + one_line(word) + unknown_word(word, kPersonalityWords));
}

SceneSource source_of(const TabInputs& inputs) {
  SceneSource source{inputs.scene_name, inputs.scene, {}};
  for (const std::string& setting : inputs.settings) {
    source.overrides.settings.push_back(parse_setting(setting));
  }
  source.overrides.personality = known_device(inputs.device);
  source.overrides.torque_scale = torque_scale_in_text(*source.overrides.personality);
  source.overrides.pedal = inputs.pedal;
  return source;
}

HandScript hand_of(const TabInputs& inputs, const LoadedScene& scene) {
  HandScript script;  // one that only a user leads goes to its start
  if (!inputs.hand.empty()) script = parse_hand_script(inputs.hand, "hand");
  return with_unit(std::move(script), scene);
}

/// A tab has one hand. Throws LoadError.
LoadedScene one_armed(LoadedScene scene) {
  if (!scene.second) return scene;
  throw LoadError(scene.path +
                  ": has two [[device]], and a tab has one hand; choose another scene");
}

/// The segment of the scene, with the JSON that readers get.
SegmentWriter segment_of(const LoadedScene& scene, const SceneSource& source) {
  Json json = scene_json(scene);
  const std::uint64_t config_hash = fnv1a(json.canonical());
  const std::string with_source = json_with_source(std::move(json), scene, source);
  return SegmentWriter::create(segment_spec(scene, with_source, config_hash), true);
}

}  // namespace

/// In the order in which it is made: the densities move from the scene into the servo after the
/// segment has copied them.
struct TabRun::State {
  explicit State(const TabInputs& inputs)
      : source(source_of(inputs)),
        scene(one_armed(load_scene(source))),
        servo(plan_scene(scene)),
        writer(segment_of(scene, source)),
        emulator(model_for(scene, hand_of(inputs, scene)), hand_of(inputs, scene)),
        port(emulator, scene.device.personality, scene.servo.rate_hz),
        driver(make_driver(scene.device.personality, port, scene.device.encoder_sign,
                           scene.servo.rate_hz)),
        viewer(writer, [this](const bridge::CommandMessage& asked) { return answer(asked); }),
        publisher(writer, *servo) {
    for (const SceneVolume& volume : scene.volumes) {
      const auto& h = volume.image.spacing_mm;
      voxel_mm3.push_back(h[0] * h[1] * h[2]);
    }
    servo->take(scene);
    driver->start();
    writer.set_lifecycle(Lifecycle::run);
  }

  void step_once() noexcept {
    ++tick;
    TickTiming timing;
    timing.heartbeat_ns = monotonic_ns();
    timing.start_ns = static_cast<std::int64_t>(tick) * (kNsPerSecond / scene.servo.rate_hz);
    const DeviceReport report = driver->read();
    given.command = {};
    if (!commands.empty()) {
      given.command = servo_command(commands.front());
      given.last_index = commands.front().index;
      commands.pop_front();
    }
    static_cast<void>(apply_commands(given, *servo));
    output = servo->step(report);
    timing.lost_packets[0] = driver->lost();
    timing.refused_packets[0] = driver->refused();
    driver->command(output);
    publisher.publish(tick, std::span(&report, 1), given, std::span(&output, 1), timing);
    for (std::size_t v = 0; v < kMaxVolumes; ++v) {
      if (output.resetting) removed_steps[v] = 0;
      removed_steps[v] += output.removed_by_volume[v] - output.returned_by_volume[v];
    }
    if (output.started) ++armed_ticks;
  }

  bridge::ReplyMessage answer(const bridge::CommandMessage& asked) {
    SegmentCommand command;
    command.kind = static_cast<CommandKind>(asked.kind);
    command.argument = asked.argument;
    command.arm = asked.arm;
    const bool valid = is_valid(command, {.tools = static_cast<std::uint32_t>(scene.tools.size())});
    bridge::ReplyMessage reply{bridge::kReplyMagic, asked.sequence, 0, 0};
    if (!valid) {
      reply.status = static_cast<std::uint32_t>(ReplyStatus::refused);
    } else if (commands.size() >= kCommandSlots) {
      reply.status = static_cast<std::uint32_t>(ReplyStatus::busy);
    } else {
      reply.index = command.index = ++last_index;
      commands.push_back(command);
    }
    return reply;
  }

  SceneSource source;
  LoadedScene scene;
  std::unique_ptr<CompiledScene> servo;
  SegmentWriter writer;
  Emulator emulator;
  DirectLockStepPort port;
  std::unique_ptr<DeviceDriver> driver;
  TabViewer viewer;
  Publisher publisher;

  Tick tick = 0;
  std::uint64_t armed_ticks = 0;
  TickCommands given;
  ServoOutput output;
  std::array<std::uint64_t, kMaxVolumes> removed_steps{};
  std::vector<double> voxel_mm3;
  std::deque<SegmentCommand> commands;
  std::uint32_t last_index = 0;
};

TabRun::TabRun(const TabInputs& inputs) : state_(std::make_unique<State>(inputs)) {}
TabRun::~TabRun() = default;

int TabRun::step(int ticks, std::uint64_t most_armed) noexcept {
  int made = 0;
  for (; made < ticks && state_->armed_ticks < most_armed; ++made) state_->step_once();
  return made;
}

TabViewer& TabRun::viewer() noexcept {
  return state_->viewer;
}

void TabRun::lead(const std::array<double, 3>& world_mm,
                  const std::array<double, 3>& orientation_rad, bool button) noexcept {
  const auto& device = state_->scene.device;
  const auto axis = [&](std::size_t i) {
    return (world_mm[i] - device.offset_mm[i]) / device.workspace_scale;
  };
  // Through the packet of a window, whose numbers are whole and within the limits.
  const HandTarget target{.tip_mm = {axis(0), axis(1), axis(2)},
                          .orientation_rad = orientation_rad,
                          .button1 = button,
                          .button2 = false,
                          .park = false};
  if (const auto sent = decode_hand_target(encode(target))) state_->emulator.set_target(*sent);
}

void TabRun::release() noexcept {
  state_->emulator.release();
}

int TabRun::rate_hz() const noexcept {
  return state_->scene.servo.rate_hz;
}

std::string TabRun::facts() const {
  const State& s = *state_;
  double removed_density_mm3 = 0;
  for (std::size_t v = 0; v < s.voxel_mm3.size(); ++v) {
    removed_density_mm3 += static_cast<double>(s.removed_steps[v]) / kDensityMax * s.voxel_mm3[v];
  }
  Json energy;
  for (std::size_t i = 0; i < kEnergySources; ++i) {
    energy[kEnergySourceNames[i]] = energy_mj_of_steps(s.output.energy_steps[i]);
  }
  const Json facts = {{"rate_hz", rate_hz()},
                      {"ticks", s.tick},
                      {"armed_ticks", s.armed_ticks},
                      {"output_hash", hex64(s.output.output_hash)},
                      {"fault", fault_name(s.output.fault)},
                      {"phase", static_cast<int>(s.output.phase)},
                      {"hand_led", s.emulator.accepts_target()},
                      {"force_n", vec3::length(s.output.commanded_force_n)},
                      {"removed_density_mm3", removed_density_mm3},
                      {"absorbed_mj", s.output.absorbed_mj},
                      {"energy_mj", std::move(energy)}};
  return facts.canonical();
}

std::string TabRun::volume_hash() const {
  return hex64(hash_of_volumes(*state_->servo, state_->scene.volumes.size()));
}

}  // namespace kerf::web
