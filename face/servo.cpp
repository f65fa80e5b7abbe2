// SPDX-License-Identifier: Apache-2.0
#include "kerf/servo.hpp"

#include <algorithm>
#include <utility>

#include "controller/plan/compile.hpp"
#include "controller/tick/tick_record.hpp"
#include "face/loaded.hpp"

namespace kerf {

struct Servo::State::Kept {
  std::unique_ptr<ServoSnapshot> servo;
  std::array<TickRecord, kMaxArms> records{};
  TickCommands given;
  std::uint64_t volume_chain = kFnv1aBasis;
  std::uint64_t config_hash = 0;
};

struct Servo::Parts {
  explicit Parts(const Scene& scene) : shown(scene), loaded(scene.loaded().scene) {
    servo = compile(loaded);
    tick_ns = 1'000'000'000 / static_cast<std::uint64_t>(loaded.servo.rate_hz);
  }

  /// In the order of `apply_commands`, each once.
  bool apply(const ServoCommand& command) noexcept {
    using Kind = ServoCommand::Kind;
    const bool missed = command.kind == Kind::missed, fade_in = command.kind == Kind::fade_in;
    if (command.kind == Kind::none || command.kind > Kind::missed || given.fade_in ||
        (!fade_in && given.missed > 0)) {
      return false;
    }
    const bool of_person = !missed && !fade_in;
    const bool has_argument = missed || command.kind == Kind::select_tool;
    if (missed && command.argument == 0) return false;
    if (!has_argument && command.argument > (command.kind == Kind::hold ? 1U : 0U)) return false;
    if (of_person && given.command.kind != Kind::none) return false;
    TickCommands alone;
    if (of_person) alone.command = given.command = command;
    if (missed) alone.missed = given.missed = std::min(command.argument, kMostMissed);
    if (fade_in) alone.fade_in = given.fade_in = true;
    if (apply_commands(alone, *servo)) return true;
    given.command = {};  // nothing else is ever refused
    return false;
  }

  void step(std::span<const DeviceReport> given_reports) noexcept {
    std::array<DeviceReport, kMaxArms> reports{};
    std::copy_n(given_reports.begin(), std::min(given_reports.size(), reports.size()),
                reports.begin());
    const std::size_t arms = servo->arms();
    const auto all = std::span(reports).first(arms);
    const auto out = std::span(outputs).first(arms);
    servo->step(all, out);
    const std::uint64_t tick = records[0].tick + 1;
    make_records(*servo, all, given, out, volume_chain, std::span(records).first(arms));
    for (std::size_t arm = 0; arm < arms; ++arm) {
      TickRecord& record = records[arm];
      record.seq = 2 * tick;
      record.tick = tick;
      record.start_ns = tick * tick_ns;
      record.crc32c = tick_record_crc(record);
    }
    given = {};
  }

  Scene shown;
  LoadedScene loaded;  ///< without the densities, which the servo has
  std::unique_ptr<CompiledScene> servo;
  std::uint64_t tick_ns = 0;
  TickCommands given;
  std::uint64_t volume_chain = kFnv1aBasis;
  std::array<ServoOutput, kMaxArms> outputs;
  std::array<TickRecord, kMaxArms> records{};
};

Servo::Servo(const Scene& scene)
    : parts_(or_error([&] { return std::make_unique<Parts>(scene); })) {}
Servo::~Servo() = default;
Servo::Servo(Servo&&) noexcept = default;
Servo& Servo::operator=(Servo&&) noexcept = default;

std::size_t Servo::arms() const noexcept {
  return parts_->servo->arms();
}

const TickRecord& Servo::step(const DeviceReport& report) noexcept {
  parts_->step(std::span(&report, 1));
  return parts_->records[0];
}

std::span<const TickRecord> Servo::step(std::span<const DeviceReport> reports) noexcept {
  parts_->step(reports);
  return std::span(parts_->records).first(arms());
}

const TickRecord& Servo::last(std::size_t arm) const noexcept {
  return parts_->records[std::min(arm, kMaxArms - 1)];
}

bool Servo::apply(const ServoCommand& command) noexcept {
  return parts_->apply(command);
}

bool Servo::give_force(const ProgramForce& force, std::size_t arm) noexcept {
  return arm < arms() && parts_->servo->give_force(arm, force);
}

VoxelView Servo::voxels(std::size_t volume) const noexcept {
  const auto& volumes = parts_->loaded.volumes;
  if (volume >= volumes.size()) return {};
  const VoxelGrid& grid = volumes[volume].image.grid;
  return {.size = {grid.nx, grid.ny, grid.nz},
          .spacing_mm = volumes[volume].image.spacing_mm,
          .origin_mm = volumes[volume].pose.position_mm,
          .orientation = volumes[volume].pose.orientation,
          .density = parts_->servo->density(volume)};
}

std::uint64_t Servo::volume_hash() const noexcept {
  return hash_of_volumes(*parts_->servo, parts_->loaded.volumes.size());
}

Servo::State Servo::keep() const {
  auto kept = std::make_shared<State::Kept>();
  kept->servo = parts_->servo->keep();
  kept->records = parts_->records;
  kept->given = parts_->given;
  kept->volume_chain = parts_->volume_chain;
  kept->config_hash = parts_->shown.loaded().config_hash;
  return State(std::move(kept));
}

void Servo::restore(const State& state) {
  const State::Kept& kept = *state.kept_;
  if (kept.config_hash != parts_->shown.loaded().config_hash) {
    throw Error("restore: the state is of another scene; keep one of this scene");
  }
  or_error([&] { parts_->servo->restore(*kept.servo); });
  parts_->records = kept.records;
  parts_->given = kept.given;
  parts_->volume_chain = kept.volume_chain;
}

}  // namespace kerf
