// SPDX-License-Identifier: Apache-2.0
#include "replay/recorded_run.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/kernel/kernel_shapes.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/scene/scene_file.hpp"
#include "record/kept_volumes.hpp"
#include "record/tick_log.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {
namespace {

struct RecordedScene {
  std::string canonical;  ///< of the loaded scene
  SceneSource source;
  InputsInJson inputs;
};

RecordedScene read_scene(const std::filesystem::path& folder) {
  const std::string text = recorded_scene(folder);
  try {
    return {json_without_source(text), source_in(text), inputs_in(text)};
  } catch (const JsonError&) {
    throw DamagedRecording(scene_without_source(folder));
  }
}

/// Whether the changes leave volumes, or meshes, as they were loaded.
bool change_one_of(const ReplayChanges& changes, std::initializer_list<std::string_view> tables) {
  if (changes.scene) return true;
  return std::ranges::any_of(changes.settings, [&](const std::string& setting) {
    return std::ranges::any_of(tables, [&](auto table) { return setting.starts_with(table); });
  });
}
bool keep_volumes(const ReplayChanges& changes) {
  return !change_one_of(changes, {"volume.", "material."});
}
/// `device.fit` scales the tools with the first volume.
bool keep_meshes(const ReplayChanges& changes) {
  return keep_volumes(changes) && !change_one_of(changes, {"tool.", "device."});
}

/// What the recording has of its volumes and meshes, if the changes leave those as they were.
RecordedInputs recorded_inputs(const std::filesystem::path& folder, InputsInJson from,
                               const ReplayChanges& changes) {
  RecordedInputs out = std::move(from.inputs);
  out.without_device_file = true;
  if (!keep_meshes(changes)) out.meshes.clear();
  const bool same_volumes = keep_volumes(changes);
  for (std::size_t v = 0; v < out.volumes.size(); ++v) {
    end_if_asked(folder.string());
    std::optional<SceneVolume>& volume = out.volumes[v];
    std::optional<VolumeContent> content;
    if (same_volumes) {
      content = read_starting_volume(folder, from.density_hashes[v], volume->image.grid);
    }
    if (!content) {
      volume.reset();
      continue;
    }
    volume->image.density = std::move(content->density);
    volume->image.labels = std::move(content->labels);
  }
  return out;
}

/// A short form of a value: a number or a text as it is, else its beginning.
std::string short_value(const Json& value) {
  constexpr std::size_t kMost = 40;
  std::string text = value.canonical();
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  return one_line(text);
}

struct Difference {
  std::string key, recorded, loaded;
};

/// The value as what it holds; null if it holds something else.
template <class Held>
const Held* held_as(const Json& value) {
  return value.visit([]<class T>(const T& held) -> const Held* {
    if constexpr (std::is_same_v<T, Held>) {
      return &held;
    } else {
      return nullptr;
    }
  });
}

/// The first value in which two scenes differ, depth first in the order of the keys.
std::optional<Difference> first_difference(const Json& recorded, const Json& loaded,
                                           const std::string& key) {
  if (recorded.canonical() == loaded.canonical()) return std::nullopt;
  if (const auto* a = held_as<Json::Members>(recorded), *b = held_as<Json::Members>(loaded);
      a != nullptr && b != nullptr) {
    for (const Json::Member& member : *a) {
      const std::string below = key.empty() ? member.key : key + "." + member.key;
      if (!loaded.contains(member.key)) return Difference{below, short_value(member.value), "none"};
      if (auto found = first_difference(member.value, loaded.at(member.key), below)) return found;
    }
    for (const Json::Member& member : *b) {
      if (recorded.contains(member.key)) continue;
      return Difference{key.empty() ? member.key : key + "." + member.key, "none",
                        short_value(member.value)};
    }
  }
  if (const auto* a = held_as<Json::List>(recorded), *b = held_as<Json::List>(loaded);
      a != nullptr && b != nullptr && a->size() == b->size()) {
    for (std::size_t i = 0; i < a->size(); ++i) {
      const std::string below = key + "[" + std::to_string(i) + "]";
      if (auto found = first_difference((*a)[i], (*b)[i], below)) return found;
    }
  }
  return Difference{key, short_value(recorded), short_value(loaded)};
}

/// The volumes first: what differs in a scene by another volume is seen in other keys, too.
void check_same_volumes(const std::filesystem::path& folder, const std::string& recorded,
                        const std::string& loaded) {
  const auto hashes = [](const std::string& scene) {
    Json out = Json::List{};
    const Json root = Json::parse(scene);
    for (const Json& volume : root.at("volumes")) {
      out.push_back(volume.at("density_hash").get<std::string>());
    }
    return out;
  };
  const auto found = first_difference(hashes(recorded), hashes(loaded), "volumes");
  if (!found) return;
  throw RecordError(
      (folder / kSceneName).string() + ": the content of " + found->key + " has hash " +
      found->recorded + " in the recording and " + found->loaded +
      " now, and no copy lies beside the log; put back the volume that it was recorded with");
}

void check_same(const std::filesystem::path& folder, const std::string& recorded,
                const std::string& loaded) {
  const auto found = first_difference(Json::parse(recorded), Json::parse(loaded), "");
  if (!found) return;
  throw RecordError((folder / kSceneName).string() + ": " + found->key + " is " + found->recorded +
                    " in the recording and " + found->loaded +
                    " now; replay it with the version of kerf that recorded it");
}

SceneSource changed(SceneSource source, const ReplayChanges& changes) {
  if (changes.scene) source = read_source(*changes.scene, source.overrides);
  std::vector<KeyOverride> settings;
  for (const std::string& text : changes.settings) {
    settings.push_back(parse_setting(text));
    drop_replaced(source.overrides.settings, settings.back());
  }
  std::ranges::copy(settings, std::back_inserter(source.overrides.settings));
  if (changes.numeric) source.overrides.numeric = changes.numeric;
  return source;
}

/// A replay takes ticks and counts as they are: of that rate and that device.
void check_same_counts(const std::string& recorded, const LoadedScene& scene) {
  const Json was = Json::parse(recorded);
  const auto rate_hz = was.at("servo").at("rate_hz").get<int>();
  const auto device = was.at("device").at("personality").get<std::string>();
  const std::string_view now = word_of(scene.device.personality);
  if (scene.servo.rate_hz != rate_hz) {
    throw RecordError(scene.path + ": servo.rate_hz is " + std::to_string(scene.servo.rate_hz) +
                      ", and the ticks of the recording are of " + std::to_string(rate_hz) +
                      " Hz; replay it at that rate");
  }
  if (device != now) {
    throw RecordError(scene.path + ": device.personality is " + std::string(now) +
                      ", and the counts of the recording are of " + one_line(device) +
                      "; replay it with that device");
  }
  const std::string second = was.contains("second_device")
                                 ? was.at("second_device").at("personality").get<std::string>()
                                 : "none";
  const std::string now_second(scene.second ? word_of(scene.second->device.personality) : "none");
  if (second != now_second) {
    throw RecordError(scene.path + ": the second device is " + now_second +
                      ", and in the recording it is " + one_line(second) +
                      "; replay it with that one");
  }
}

/// Of the ticks before the log a recording has the inputs.
void check_begins_at_first_tick(const std::filesystem::path& folder, const Manifest& manifest) {
  const std::uint64_t missed = manifest.losses.missed_before_start;
  if (missed == 0) return;
  std::error_code none;
  if (!std::filesystem::is_directory(folder / kInputsName, none)) {
    if (manifest.has_inputs) {
      throw DamagedRecording((folder / kInputsName).string() +
                             ": missing, and manifest.json lists its files; copy the recording "
                             "again");
    }
    throw RecordError(
        folder.string() + ": the first " +
        (missed == 1 ? "tick of the run is" : ticks_text(missed) + " of the run are") +
        " not in it; start the recorder before the controller, as ./kerf demo does");
  }
  TickRecord first;
  static_cast<void>(TickLogReader(folder / kTickLogName).read(0, std::span(&first, 1)));
  if (first.tick == missed + 1) return;
  throw DamagedRecording((folder / kManifestName).string() + ": " + ticks_text(missed) +
                         (missed == 1 ? " is" : " are") +
                         " before the log, and it begins at tick " + std::to_string(first.tick) +
                         "; copy the recording again");
}

std::vector<double> voxel_mm3_of(const InputsInJson& recorded) {
  std::vector<double> out;
  for (const std::optional<SceneVolume>& volume : recorded.inputs.volumes) {
    const auto& mm = volume->image.spacing_mm;
    out.push_back(mm[0] * mm[1] * mm[2]);
  }
  return out;
}

}  // namespace

std::vector<double> voxel_mm3_of(const LoadedScene& scene) {
  std::vector<double> out;
  for (const SceneVolume& volume : scene.volumes) {
    const auto& mm = volume.image.spacing_mm;
    out.push_back(mm[0] * mm[1] * mm[2]);
  }
  return out;
}

std::string scene_without_source(const std::filesystem::path& folder) {
  return (folder / kSceneName).string() +
         ": does not say, as this version does, what the scene was loaded from; copy the recording "
         "again, or record it with this version";
}

RecordedRun load_run(const std::filesystem::path& folder, const ReplayChanges& changes,
                     const KernelSet& kernels, bool with_segment) {
  RecordedRun run;
  run.manifest = read_manifest(folder);
  check_begins_at_first_tick(folder, run.manifest);
  const RecordedScene recorded = read_scene(folder);
  const SceneSource source = changed(recorded.source, changes);
  run.scene = load_scene(source, recorded_inputs(folder, recorded.inputs, changes));
  // Inputs before the log are `TickInputs`, which have no force of a program.
  if (run.scene.force.model == ForceModel::external && run.earlier_ticks() > 0) {
    throw RecordError(folder.string() + ": of the first " + ticks_text(run.earlier_ticks()) +
                      " the force of the program is not in it; record the run whole, with a "
                      "recorder without --flight that starts before the controller");
  }
  Json json = scene_json(run.scene);
  run.canonical = json.canonical();
  run.scene_json = json_with_source(std::move(json), run.scene, source);
  if (keep_volumes(changes)) check_same_volumes(folder, recorded.canonical, run.canonical);
  if (changes.none()) {
    check_same(folder, recorded.canonical, run.canonical);
  } else {
    try {
      check_same_counts(recorded.canonical, run.scene);
    } catch (const JsonError&) {
      throw DamagedRecording((folder / kSceneName).string() +
                             ": has no rate or no device; copy the recording again");
    }
  }
  run.manifest.tick_ns = static_cast<std::uint32_t>(1'000'000'000 / run.scene.servo.rate_hz);
  run.manifest.voxel_mm3 = voxel_mm3_of(recorded.inputs);
  if (with_segment) {
    const std::uint64_t hash = fnv1a(run.canonical);
    run.segment = SegmentWriter::create(segment_spec(run.scene, run.scene_json, hash));
  }
  run.servo = compile(run.scene, kernels);
  return run;
}

EarlierTicks::EarlierTicks(RecordedRun& run, const std::filesystem::path& folder)
    : run_(run),
      inputs_(folder, run.earlier_ticks(), run.servo->arms()),
      step_(*run.servo, run.volume_chain) {}

bool EarlierTicks::step() {
  const std::span<const TickRecord> inputs = inputs_.next();
  if (inputs.empty()) return false;
  ArmRecords tick{};
  std::ranges::copy(inputs, tick.begin());
  run_.volume_chain = step_(tick)[inputs.size() - 1].volume_hash;
  ++done_;
  ++*run_.steps;
  return true;
}

void step_earlier_ticks(RecordedRun& run, const std::filesystem::path& folder) {
  EarlierTicks ticks(run, folder);
  constexpr Tick kOften = 1024;
  while (ticks.step()) {
    if (ticks.done() % kOften == 0) end_if_asked(folder.string());
  }
}

const KernelSet& kernels_named(const std::string& name) {
  std::string here;
  for (const KernelSet* const* set = kernel_sets(); *set != nullptr; ++set) {
    if (name.empty() || name == (*set)->name) return **set;
    here += std::string(here.empty() ? "" : ", ") + (*set)->name;
  }
  std::string all;
  for (const KernelShape& shape : kKernelShapes) {
    if (name == shape.name) {
      throw UsageError("--kernels " + name +
                       ": not on this processor, or hidden by KERF_HIDE_SETS; use one of " + here);
    }
    all += std::string(all.empty() ? "" : ", ") + shape.name;
  }
  throw UsageError("--kernels " + one_line(name) + ": unknown; use one of " + all);
}

}  // namespace kerf
