// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/manifest.hpp"
#include "record/manifest_seal.hpp"
#include "shared/text/json.hpp"

namespace kerf {

struct SceneFacts;

/// What is wrong in a recording, as it is found: lines "location: value; remedy". Knows the
/// manifest, with which most is compared.
class Findings {
 public:
  /// Reads manifest.json. Throws `RecordError` as `read_manifest`.
  explicit Findings(std::filesystem::path folder);

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }
  [[nodiscard]] const Json& json() const noexcept { return json_; }  ///< of the manifest
  [[nodiscard]] const Manifest& manifest() const noexcept { return manifest_; }
  [[nodiscard]] const std::vector<std::string>& problems() const noexcept { return problems_; }
  [[nodiscard]] bool in_manifest() const noexcept { return in_manifest_; }

  void add_line(std::string line) { problems_.push_back(std::move(line)); }
  /// Of a file of the folder.
  void add(const std::filesystem::path& name, const std::string& what,
           std::string_view remedy = "; copy the recording again");
  /// The manifest is to blame, unless its own checksum is right: then it is as the recorder wrote
  /// it, what differs from it was changed, and making it anew would hide that.
  void add_to_manifest(const std::string& what);

  /// Compares member `key` of an object of the manifest with what it follows from. True if it is as
  /// it should be, or missing. `shown_key`: with the keys above it.
  bool compare(const Json& object, std::string_view key, const std::string& shown_key,
               const Json& wanted, std::string_view source);

  /// The checksums of the other files, by name; empty in manifests of earlier versions.
  [[nodiscard]] const Json::Members& files() const noexcept { return files_; }
  /// Whether the manifest has this checksum of a file.
  [[nodiscard]] bool lists(std::string_view name, std::string_view checksum) const;
  /// Compares a file with its checksum in the manifest, if that has one.
  void compare_file(const std::string& name);

  /// What is wrong with the manifest's own text: its checksum, names that stand twice. After what
  /// is said of its members, since the checksum covers all of them.
  void check_manifest_text();

 private:
  std::filesystem::path folder_;
  std::string text_;  ///< of the manifest
  Seal seal_;
  Manifest manifest_;
  Json json_;
  Json::Members files_;
  std::vector<std::string> problems_;
  bool in_manifest_ = false;
};

/// The checksum that clock.npy, from which `clock` was read, had before its last row; "none" if
/// that is its first, or the file is not as a recorder writes it.
[[nodiscard]] std::string checksum_before_last_row(const std::filesystem::path& folder,
                                                   const LogClock& clock);

/// Compares the files beside log and scene: those that the manifest lists with their checksums, the
/// volumes of `scene` with their hashes, the inputs of the ticks before the log with their length.
/// Names those that no recording has. `is_final`: a recorder ended it, so the manifest lists all.
/// Returns the files, and folders with files, of which the manifest has no checksum.
[[nodiscard]] std::vector<std::string> check_files(const SceneFacts& scene, std::size_t arms,
                                                   bool is_final, Findings& findings);

}  // namespace kerf
