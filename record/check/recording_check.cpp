// SPDX-License-Identifier: Apache-2.0
#include "record/check/recording_check.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "record/check/losses.hpp"
#include "record/input_rows.hpp"
#include "record/kept_volumes.hpp"
#include "record/manifest_seal.hpp"
#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCopyAgain = "; copy the recording again";

/// A short form of a value, on one line.
std::string shown(const Json& value) {
  constexpr std::size_t kMost = 60;
  const std::string text = value.canonical();
  return one_line(text.size() > kMost ? text.substr(0, kMost) + "..." : text);
}

class Check {
 public:
  Check(const fs::path& folder, TickRange range) : folder_(folder), range_(range) {
    out_.manifest = read_manifest(folder);
    text_ = manifest_text(folder);
    json_ = Json::parse(text_);
  }

  void facts() {
    check_members();
    check_scene();
    check_clock();
    check_end();
    for (std::size_t arm = 0; arm < out_.manifest.arms; ++arm) {
      logs_.emplace_back(folder_ / tick_log_name(arm));
      check_size(logs_.back(), arm);
    }
  }

  void rows() {
    std::vector<SummaryBuilder> figures;
    for (std::size_t arm = 0; arm < logs_.size(); ++arm) {
      figures.emplace_back(out_.manifest.tick_ns, out_.manifest.voxel_mm3);
    }
    LossesOfRows losses(out_.manifest.losses.missed_before_start);
    std::optional<std::uint64_t> first_index;
    read_rows([&](std::span<const TickRecord> arms) {
      if (!first_index) first_index = index_of(arms[0]);
      for (std::size_t arm = 0; arm < arms.size(); ++arm) figures[arm].add(arms[arm]);
      losses.add(arms[0]);
      check_time(arms[0]);
    });
    RecordLosses known = out_.manifest.losses;
    if (!range_.is_whole()) known = {.missed_before_start = first_index.value_or(0)};
    for (const SummaryBuilder& builder : figures) {
      out_.summaries.push_back(builder.result(known, out_.manifest.end_reason));
    }
    if (range_.is_whole() && out_.rows_readable) {
      check_losses(losses);
      check_figures();
    }
    for (std::size_t arm = 0; arm < logs_.size(); ++arm) {
      for (const TickLogReader::Part& part : logs_[arm].parts()) {
        if (part.rows < part.counted) out_.summaries[arm].end_reason = cut_text(part);
      }
    }
  }

  void files() {
    check_listed_files();
    check_volumes();
    check_inputs();
  }

  /// Behind what is said of a member: the checksum covers all of them, also those that nothing else
  /// says.
  void seal() {
    const Seal seal = seal_of(text_);
    if (seal == Seal::broken || (seal == Seal::none && json_.contains("files"))) {
      add_to_manifest("its checksum is wrong: it was changed after the recorder wrote it");
    }
  }

  [[nodiscard]] CheckedRecording result() && { return std::move(out_); }

 private:
  void add(const fs::path& name, const std::string& what, std::string_view remedy = kCopyAgain) {
    out_.problems.push_back((folder_ / name).string() + ": " + what + std::string(remedy));
  }
  void add_to_manifest(const std::string& what) {
    out_.in_manifest = true;
    add(kManifestName, what,
        "; copy the recording again, or kerf record check --repair makes it anew");
  }

  /// Compares a member of the manifest, if it is there, with what it follows from.
  template <class Value>
  void compare(const Json& object, std::string_view key, const std::string& shown_key,
               const Value& wanted, std::string_view source) {
    if (!object.contains(key)) return;
    const Json value = Json(wanted);
    if (object.at(key).canonical() == value.canonical()) return;
    add_to_manifest(shown_key + " is " + shown(object.at(key)) + ", and " + shown(value) + " by " +
                    std::string(source));
  }

  [[nodiscard]] bool is_final() const { return kerf::is_final(out_.manifest.end_reason); }

  static std::string cut_text(const TickLogReader::Part& part) {
    return "cut after " + std::to_string(part.rows) + " of " + std::to_string(part.counted) +
           " rows";
  }

  void check_members() {
    if (const auto twice = doubled_key(text_)) {
      add_to_manifest("\"" + one_line(*twice) + "\" stands twice in it");
    }
    compare(json_, "scene", "scene", kSceneName, "the name of that file");
    if (json_.contains("session_id") && !is_volume_hash(out_.manifest.session_id)) {
      add_to_manifest("session_id is " + shown(json_.at("session_id")) +
                      ", and not 16 hexadecimal digits");
    }
  }

  void check_scene() {
    SceneFacts scene;
    try {
      const std::string text = recorded_scene(folder_);
      scene = scene_facts(text);
      if (const auto twice = doubled_key(text)) {
        add(kSceneName, "\"" + one_line(*twice) + "\" stands twice in it");
      }
      check_listed(std::string(kSceneName));
    } catch (const RecordError& error) {
      out_.problems.push_back(error.what());
      return;
    } catch (const JsonError&) {
      add(kSceneName, "no JSON");
      return;
    }
    compare(json_, "config_hash", "config_hash", scene.config_hash, "scene.json");
    if (scene.arms) compare(json_, "arms", "arms", *scene.arms, "scene.json");
    if (scene.arms == 2 && !json_.contains("arms")) {
      add_to_manifest("arms is missing, and 2 by scene.json");
    }
    if (scene.tick_ns) {
      compare(json_, "tick_ns", "tick_ns", *scene.tick_ns, "scene.json's servo.rate_hz");
    }
    check_volume_facts(scene);
    take_facts(scene, out_.manifest);
    volumes_ = std::move(scene.volumes);
  }

  void check_volume_facts(const SceneFacts& scene) {
    if (scene.volumes.empty()) return;
    const Json& volumes = json_.at("volumes");
    if (volumes.size() != scene.volumes.size()) {
      add_to_manifest("volumes has " + std::to_string(volumes.size()) +
                      " volumes, and scene.json " + std::to_string(scene.volumes.size()));
      return;
    }
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      const std::string place = "volumes[" + std::to_string(v) + "].";
      const SceneFacts::Volume& of_scene = scene.volumes[v];
      compare(volumes.at(v), "size_vox", place + "size_vox", of_scene.size_vox, "scene.json");
      compare(volumes.at(v), "spacing_mm", place + "spacing_mm", of_scene.spacing_mm, "scene.json");
    }
  }

  void check_clock() {
    const LogClock clock = read_clock(folder_, out_.manifest.has_clock);
    if (!clock.problem().empty()) {
      out_.problems.push_back(clock.problem());
    } else if (is_final()) {
      check_listed(std::string(kClockName));
    }
  }

  /// What the manifest says of the end, which its figures say too.
  void check_end() {
    const Manifest& manifest = out_.manifest;
    const bool has_figures = !manifest.summaries.empty();
    if (manifest.end_reason == kStillRunning && has_figures) {
      add_to_manifest("end_reason is \"running\", and it has the figures of the end");
    }
    if (has_figures && manifest.summaries.size() != manifest.arms) {
      add_to_manifest("arms is " + std::to_string(manifest.arms) + ", and it has figures of " +
                      std::to_string(manifest.summaries.size()));
    }
  }

  /// Rows by the header, by the bytes and by the manifest.
  void check_size(const TickLogReader& log, std::size_t arm) {
    const std::string_view name = tick_log_name(arm);
    for (const TickLogReader::Part& part : log.parts()) {
      const fs::path file = part.path.filename();
      if (part.rows < part.counted) {
        add(file, cut_text(part));
      } else if (is_final() && part.rows != part.counted) {
        add(file, std::to_string(part.counted) + " rows by its header, and it has " +
                      std::to_string(part.rows));
      } else if (is_final() && part.bytes_left != 0) {
        add(file, std::to_string(part.bytes_left) + " bytes behind its last row");
      }
    }
    if (arm > 0 && log.rows() < logs_.front().rows()) {
      add(name, std::to_string(log.rows()) + " rows, and " + std::string(kTickLogName) + " has " +
                    std::to_string(logs_.front().rows()));
    }
    if (!json_.contains("rows")) return;
    if (is_final()) {
      compare(json_, "rows", "rows", log.rows(), name);
      return;
    }
    try {
      if (json_.at("rows").get<std::uint64_t>() <= log.rows() ||
          out_.manifest.end_reason == kNoRoom) {
        return;
      }
    } catch (const JsonError&) {  // NOLINT(bugprone-empty-catch): it is no number of rows
    }
    add_to_manifest("rows is " + shown(json_.at("rows")) + ", and " + std::string(name) + " has " +
                    std::to_string(log.rows()));
  }

  /// Calls `visit` with the rows of each tick in the range, of all arms, up to the first that is
  /// damaged, missing, or of another tick than that of the first arm.
  template <class Visit>
  void read_rows(const Visit& visit) {
    std::vector<std::vector<TickRecord>> chunks(logs_.size());
    for (auto& chunk : chunks) chunk.resize(TickLogReader::kChunkRows);
    std::array<TickRecord, kMaxArms> tick;
    const std::uint64_t end = logs_.front().rows();
    std::uint64_t row = range_.from == 0 ? 0 : logs_.front().row_of(range_.from);
    while (row < end && out_.rows_readable) {
      std::size_t count = TickLogReader::kChunkRows;
      std::string problem;
      for (std::size_t arm = 0; arm < logs_.size() && problem.empty(); ++arm) {
        count = std::min(count, logs_[arm].read(row, chunks[arm], problem));
      }
      for (std::size_t i = 0; i < count && problem.empty(); ++i) {
        if (chunks[0][i].tick > range_.until) return;
        for (std::size_t arm = 0; arm < logs_.size(); ++arm) tick[arm] = chunks[arm][i];
        if (logs_.size() > 1 && tick[0].seq != tick[1].seq) {
          problem = (folder_ / tick_log_name(1)).string() + ": row " + std::to_string(row + i) +
                    " is not of the tick of ticks.npy" + std::string(kCopyAgain);
        } else {
          visit(std::span<const TickRecord>(tick).first(logs_.size()));
          if (tick[0].tick == range_.until) return;
        }
      }
      if (count == 0 && problem.empty()) return;  // the end of the shorter log, told by its size
      if (!problem.empty()) {
        out_.problems.push_back(problem);
        out_.rows_readable = false;
      }
      row += count;
    }
  }

  /// In lock-step no clock runs, and the time of a tick follows from its number.
  void check_time(const TickRecord& row) {
    const bool is_lockstep = json_.contains("start_ns") && json_.at("start_ns").canonical() == "0";
    if (!is_lockstep || time_told_ || row.start_ns == row.tick * out_.manifest.tick_ns) return;
    time_told_ = true;
    add_to_manifest("start_ns is 0, as in lock-step, and tick " + std::to_string(row.tick) +
                    " began at " + std::to_string(row.start_ns) + " ns");
  }

  void check_losses(const LossesOfRows& losses) {
    const std::string why = losses.why_not(out_.manifest.losses, is_final());
    if (!why.empty()) add_to_manifest(why);
  }

  void check_figures() {
    for (std::size_t arm = 0; arm < out_.summaries.size(); ++arm) {
      const std::string name = arm == 0 ? "summary" : "summary_2";
      if (!json_.contains(name)) continue;
      const Json of_rows = figures_of(out_.summaries[arm]);
      for (const auto& [key, value] : of_rows.members()) {
        compare(json_.at(name), key, name + "." + key, value,
                key == "end_reason" ? "end_reason" : "the rows");
      }
    }
  }

  /// Compares a file with its checksum in the manifest, if that has one.
  void check_listed(const std::string& name) {
    if (!json_.contains("files") || !json_.at("files").contains(name)) return;
    const std::string is = crc32_of_file(folder_ / name);
    const Json& was = json_.at("files").at(name);
    if (is.empty()) {
      add(name, "cannot be read, and manifest.json has its checksum");
    } else if (was.canonical() != Json(is).canonical()) {
      add(name, "its checksum is " + is + ", and " + shown(was) + " in manifest.json");
    }
  }

  void check_listed_files() {
    if (!json_.contains("files") || !is_final()) return;
    for (const auto& [name, sum] : json_.at("files").members()) {
      if (name != kSceneName && name != kClockName && is_name_of_file(name)) check_listed(name);
    }
    for (const std::string& name : names_of_files(folder_, true)) {
      if (json_.at("files").contains(name)) continue;
      add(one_line(name), "manifest.json does not list it", "; remove it");
    }
  }

  /// The manifest may be foreign, and name any file.
  static bool is_name_of_file(const fs::path& name) {
    return name.is_relative() && std::ranges::find(name, "..") == name.end();
  }

  /// Volumes by the hash that is their name; `initial_hash` is another one of the densities alone.
  void check_volumes() {
    for (std::size_t v = 0; v < volumes_.size(); ++v) {
      const SceneFacts::Volume& volume = volumes_[v];
      const auto [nx, ny, nz] = volume.size_vox;
      constexpr int kMost = 1 << 16;
      if (std::ranges::any_of(volume.size_vox, [](int n) { return n < 1 || n > kMost; })) {
        add(kSceneName, "volumes[" + std::to_string(v) + "].grid is no size of a volume");
        continue;
      }
      std::optional<VolumeContent> content;
      try {
        content = read_starting_volume(folder_, volume.density_hash, {nx, ny, nz});
      } catch (const RecordError& error) {
        out_.problems.push_back(error.what());
      }
      const Json& volumes = json_.at("volumes");
      if (!content || v >= volumes.size()) continue;
      compare(volumes.at(v), "initial_hash", "volumes[" + std::to_string(v) + "].initial_hash",
              hex64(density_hash(content->density)),
              density_path({}, volume.density_hash).string());
    }
  }

  /// The inputs of the ticks before the log, if there are any.
  void check_inputs() {
    std::error_code fault;
    if (!fs::is_directory(folder_ / kInputsName, fault)) return;
    try {
      InputReader inputs(folder_, out_.manifest.losses.missed_before_start, logs_.size());
      while (!inputs.next().empty()) {
      }
    } catch (const RecordError& error) {
      out_.problems.push_back(error.what());
    }
  }

  fs::path folder_;
  TickRange range_;
  CheckedRecording out_;
  std::string text_;  ///< of the manifest
  Json json_;         ///< the same, parsed
  std::vector<SceneFacts::Volume> volumes_;
  std::vector<TickLogReader> logs_;  ///< by arm
  bool time_told_ = false;
};

}  // namespace

CheckedRecording check_recording(const fs::path& folder, TickRange range, CheckDepth depth) {
  Check check(folder, range);
  check.facts();
  if (depth != CheckDepth::facts) check.rows();
  check.seal();
  if (depth == CheckDepth::files) check.files();
  return std::move(check).result();
}

RecordSummary summarise(const fs::path& folder, TickRange range, std::size_t arm) {
  CheckedRecording checked = check_recording(folder, range);
  require_arm(folder, checked.manifest, arm);
  if (!checked.rows_readable) throw RecordError(checked.problems.back());
  return std::move(checked.summaries[arm]);
}

}  // namespace kerf
