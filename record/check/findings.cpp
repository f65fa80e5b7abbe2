// SPDX-License-Identifier: Apache-2.0
#include "record/check/findings.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "record/log_clock.hpp"
#include "record/packed_npy.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/text.hpp"

namespace kerf {

Findings::Findings(std::filesystem::path folder)
    : folder_(std::move(folder)),
      text_(manifest_text(folder_)),
      seal_(seal_of(text_)),
      manifest_(read_manifest(folder_)),
      json_(Json::parse(text_)) {
  try {
    if (json_.contains("files")) files_ = json_.at("files").members();
  } catch (const JsonError&) {
    add_to_manifest("files is " + shown(json_.at("files")) + ", and has no checksums by name");
  }
}

void Findings::add(const std::filesystem::path& name, const std::string& what,
                   std::string_view remedy) {
  add_line((folder_ / name).string() + ": " + what + std::string(remedy));
}

void Findings::add_to_manifest(const std::string& what) {
  if (seal_ == Seal::whole) return add(kManifestName, what);
  in_manifest_ = true;
  add(kManifestName, what, "; copy the recording again, or kerf record check --repair rebuilds it");
}

bool Findings::compare(const Json& object, std::string_view key, const std::string& shown_key,
                       const Json& wanted, std::string_view source) {
  if (!object.contains(key) || object.at(key).canonical() == wanted.canonical()) return true;
  add_to_manifest(shown_key + " is " + shown(object.at(key)) + ", and " + shown(wanted) + " by " +
                  std::string(source));
  return false;
}

bool Findings::lists(std::string_view name, std::string_view checksum) const {
  const auto listed = std::ranges::find(files_, name, &Json::Member::key);
  return listed != files_.end() && listed->value.canonical() == Json(checksum).canonical();
}

void Findings::compare_file(const std::string& name) {
  const auto listed = std::ranges::find(files_, name, &Json::Member::key);
  if (listed == files_.end()) return;
  require_rights(folder_ / name);
  const std::string is = crc32_of_file(folder_ / name);
  if (is.empty()) {
    add(one_line(name), "cannot be read, and manifest.json has its checksum");
  } else if (listed->value.canonical() != Json(is).canonical()) {
    add(one_line(name),
        "its checksum is " + is + ", and " + shown(listed->value) + " in manifest.json");
  }
}

void Findings::check_manifest_text() {
  if (const auto twice = doubled_key(text_)) {
    add_to_manifest("\"" + one_line(*twice) + "\" stands twice in it");
  }
  if (seal_ == Seal::broken || (seal_ == Seal::none && json_.contains("files"))) {
    add_to_manifest("its checksum is wrong: it was changed after the recorder wrote it");
  }
}

std::string checksum_before_last_row(const std::filesystem::path& folder, const LogClock& clock) {
  const std::span<const ClockPair> rows = clock.pairs();
  if (rows.size() < 2 || text_in(folder / kClockName) != clock_bytes(rows)) return "none";
  return crc32_of_bytes(clock_bytes(rows.first(rows.size() - 1)));
}

}  // namespace kerf
