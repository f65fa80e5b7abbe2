// SPDX-License-Identifier: Apache-2.0
#include "record/check/recording_check.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "record/check/findings.hpp"
#include "record/kept_volumes.hpp"
#include "record/losses_of_rows.hpp"
#include "record/manifest_seal.hpp"
#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

class Check {
 public:
  Check(const fs::path& folder, TickRange range)
      : folder_(folder), range_(range), findings_(folder) {
    out_.manifest = findings_.manifest();
  }

  void facts() {
    check_members();
    check_scene();
    check_clock();
    check_end();
    logs_ = open_logs(folder_, out_.manifest.arms);
    for (std::size_t arm = 0; arm < logs_.size(); ++arm) {
      check_parts(logs_[arm], arm);
      check_first_row(logs_[arm], arm);
      check_size(logs_[arm], arm);
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
    // Of rows that are missing at the end nothing follows for the manifest.
    if (range_.is_whole() && out_.rows_readable && !is_cut_) {
      check_losses(losses);
      check_figures();
    }
    for (std::size_t arm = 0; arm < logs_.size(); ++arm) {
      for (const TickLogReader::Part& part : logs_[arm].parts()) {
        if (part.rows < part.counted) out_.summaries[arm].end_reason = cut_text(part);
      }
    }
  }

  void files() { out_.without_checksum = check_files(scene_, logs_.size(), is_final(), findings_); }

  void manifest_text() { findings_.check_manifest_text(); }

  [[nodiscard]] CheckedRecording result() && {
    out_.problems = findings_.problems();
    out_.in_manifest = findings_.in_manifest();
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool is_final() const { return is_of_whole_log(out_.manifest.end_reason); }
  [[nodiscard]] const Json& json() const { return findings_.json(); }

  static std::string cut_text(const TickLogReader::Part& part) {
    return "cut after " + std::to_string(part.rows) + " of " + std::to_string(part.counted) +
           " rows";
  }

  void check_members() {
    findings_.compare(json(), "scene", "scene", kSceneName, "the name of that file");
    if (json().contains("session_id") && !is_volume_hash(out_.manifest.session_id)) {
      findings_.add_to_manifest("session_id is " + shown(json().at("session_id")) +
                                ", and not 16 hexadecimal digits");
    }
  }

  void check_scene() {
    try {
      const std::string text = recorded_scene(folder_);
      scene_ = scene_facts(text);
      if (const auto twice = doubled_key(text)) {
        findings_.add(kSceneName, "\"" + one_line(*twice) + "\" stands twice in it");
      }
      findings_.compare_file(std::string(kSceneName));
    } catch (const DamagedRecording& error) {
      findings_.add_line(error.what());
      return;
    } catch (const JsonError&) {
      findings_.add(kSceneName, "no JSON");
      return;
    }
    findings_.compare(json(), "config_hash", "config_hash", scene_.config_hash, "scene.json");
    if (scene_.arms) findings_.compare(json(), "arms", "arms", *scene_.arms, "scene.json");
    if (scene_.arms == 2 && !json().contains("arms")) {
      findings_.add_to_manifest("arms is missing, and 2 by scene.json");
    }
    if (scene_.tick_ns) {
      findings_.compare(json(), "tick_ns", "tick_ns", *scene_.tick_ns,
                        "scene.json's servo.rate_hz");
    }
    check_volume_facts();
    take_facts(scene_, out_.manifest);
  }

  void check_volume_facts() {
    if (scene_.volumes.empty()) return;
    const Json& volumes = json().at("volumes");
    if (volumes.size() != scene_.volumes.size()) {
      findings_.add_to_manifest("volumes has " + std::to_string(volumes.size()) +
                                " volumes, and scene.json " +
                                std::to_string(scene_.volumes.size()));
      return;
    }
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      const std::string location = "volumes[" + std::to_string(v) + "].";
      const SceneFacts::Volume& of_scene = scene_.volumes[v];
      findings_.compare(volumes.at(v), "size_vox", location + "size_vox", of_scene.size_vox,
                        "scene.json");
      findings_.compare(volumes.at(v), "spacing_mm", location + "spacing_mm", of_scene.spacing_mm,
                        "scene.json");
    }
  }

  void check_clock() {
    const LogClock clock = read_clock(folder_, out_.manifest.has_clock);
    if (!clock.problem().empty()) {
      findings_.add_line(clock.problem());
      return;
    }
    // The recorder writes the row first, and then its checksum.
    const bool is_a_row_ahead =
        !is_final() && findings_.lists(kClockName, checksum_before_last_row(folder_, clock));
    if (!is_a_row_ahead) findings_.compare_file(std::string(kClockName));
  }

  /// The files of an arm's log by the manifest, which counts each as it begins.
  void check_parts(const TickLogReader& log, std::size_t arm) {
    const fs::path name = tick_log_name(arm);
    const std::size_t files = files_of_log(folder_ / name), read = log.parts().size();
    // Of an earlier version it counts none.
    const std::size_t parts = json().contains("parts") ? out_.manifest.parts : read;
    if (files < parts) {
      findings_.add(part_of_log(name, files + 1), "missing, and the recorder had begun " +
                                                      std::to_string(parts) + " files of this log");
    } else if (files > parts && is_final()) {
      findings_.add(part_of_log(name, parts + 1),
                    "no file of this log, which has " + std::to_string(parts), "; remove it");
    } else if (files > read && is_final()) {
      findings_.add(part_of_log(name, read + 1), "cut in its header");
    }
  }

  /// Whether it is the log that the recorder began, and not that of the other arm or another run.
  void check_first_row(TickLogReader& log, std::size_t arm) {
    std::array<TickRecord, 1> row;
    std::string problem;  // of an unsound row, which is found with the others
    if (arm >= out_.manifest.first_rows.size() || log.read(0, row, problem) == 0) return;
    if (row[0].crc32c == out_.manifest.first_rows[arm]) return;
    findings_.add(tick_log_name(arm), "does not begin with the row that its recorder wrote first");
  }

  /// What the manifest says of the end, which its figures say too.
  void check_end() {
    const Manifest& manifest = out_.manifest;
    const bool has_figures = !manifest.summaries.empty();
    if (manifest.end_reason == kStillRunning && has_figures) {
      findings_.add_to_manifest("end_reason is \"running\", and it has the figures of the end");
    }
    if (has_figures && manifest.summaries.size() != manifest.arms) {
      findings_.add_to_manifest("arms is " + std::to_string(manifest.arms) +
                                ", and it has figures of " +
                                std::to_string(manifest.summaries.size()));
    }
  }

  /// Rows by the header, by the bytes and by the manifest.
  void check_size(const TickLogReader& log, std::size_t arm) {
    const std::string_view name = tick_log_name(arm);
    for (const TickLogReader::Part& part : log.parts()) {
      const fs::path file = part.path.filename();
      if (part.rows < part.counted) {
        findings_.add(file, cut_text(part));
        is_cut_ = true;
      } else if (is_final() && part.rows != part.counted) {
        findings_.add(file, std::to_string(part.counted) + " rows by its header, and it has " +
                                std::to_string(part.rows));
      } else if (is_final() && part.bytes_left != 0) {
        findings_.add(file, std::to_string(part.bytes_left) + " bytes behind its last row");
      } else if (part.bytes_left >= sizeof(TickRecord)) {
        out_.notes.push_back(part.path.string() + ": " + std::to_string(part.bytes_left) +
                             " bytes behind its " + std::to_string(part.rows) +
                             " rows are left out, since they are torn and the recorder had not "
                             "counted them; the rows before are sound");
      }
    }
    if (is_cut_) return;
    const std::uint64_t rows = log.rows_in_files();
    if (arm > 0 && rows < logs_.front().rows()) {
      findings_.add(name, std::to_string(rows) + " rows, and " + std::string(kTickLogName) +
                              " has " + std::to_string(logs_.front().rows()));
    }
    if (!json().contains("rows")) return;
    if (is_final()) {
      findings_.compare(json(), "rows", "rows", rows, name);
      return;
    }
    try {
      if (json().at("rows").get<std::uint64_t>() <= rows || out_.manifest.end_reason == kNoRoom) {
        return;
      }
    } catch (const JsonError&) {  // NOLINT(bugprone-empty-catch): it is no number of rows
    }
    findings_.add_to_manifest("rows is " + shown(json().at("rows")) + ", and " + std::string(name) +
                              " has " + std::to_string(rows));
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
                    " is not of the tick of ticks.npy" + "; copy the recording again";
        } else {
          visit(std::span<const TickRecord>(tick).first(logs_.size()));
          if (tick[0].tick == range_.until) return;
        }
      }
      if (count == 0 && problem.empty()) return;  // the shorter log ends; its size says so
      if (!problem.empty()) {
        findings_.add_line(problem);
        out_.rows_readable = false;
      }
      row += count;
    }
  }

  /// In lock-step no clock runs, and the time of a tick follows from its number.
  void check_time(const TickRecord& row) {
    const bool is_lockstep =
        json().contains("start_ns") && json().at("start_ns").canonical() == "0";
    if (!is_lockstep || time_reported_ || row.start_ns == row.tick * out_.manifest.tick_ns) return;
    time_reported_ = true;
    findings_.add_to_manifest("start_ns is 0, as in lock-step, and tick " +
                              std::to_string(row.tick) + " began at " +
                              std::to_string(row.start_ns) + " ns");
  }

  void check_losses(const LossesOfRows& losses) {
    const std::string why =
        losses.why_not(out_.manifest.losses, is_final(), logs_.front().counted());
    if (!why.empty()) findings_.add_to_manifest(why);
  }

  /// The first figure that differs: others follow from the same rows.
  void check_figures() {
    for (std::size_t arm = 0; arm < out_.summaries.size(); ++arm) {
      const std::string name = arm == 0 ? "summary" : "summary_2";
      if (!json().contains(name)) continue;
      const Json of_rows = figures_of(out_.summaries[arm]);
      for (const auto& [key, value] : of_rows.members()) {
        const char* const source = key == "end_reason" ? "end_reason" : "the rows";
        if (!findings_.compare(json().at(name), key, name + "." + key, value, source)) break;
      }
    }
  }

  fs::path folder_;
  TickRange range_;
  Findings findings_;
  CheckedRecording out_;
  SceneFacts scene_;
  std::vector<TickLogReader> logs_;  ///< by arm
  bool is_cut_ = false, time_reported_ = false;
};

}  // namespace

CheckedRecording check_recording(const fs::path& folder, TickRange range, CheckDepth depth) {
  Check check(folder, range);
  check.facts();
  if (depth != CheckDepth::facts) check.rows();
  check.manifest_text();
  if (depth == CheckDepth::files) check.files();
  return std::move(check).result();
}

RecordSummary summarise(const fs::path& folder, TickRange range, std::size_t arm) {
  CheckedRecording checked = check_recording(folder, range);
  require_arm(folder, checked.manifest, arm);
  if (!checked.rows_readable) throw DamagedRecording(checked.problems.back());
  return std::move(checked.summaries[arm]);
}

}  // namespace kerf
