// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "record/earlier_inputs.hpp"
#include "record/starting_volumes.hpp"

namespace kerf {

/// The start of the run, for recordings of its end: volumes and inputs, in a hidden folder that
/// lasts as long as the flight recorder.
class RunStart {
 public:
  /// Of controller `name` with `arms` devices, in a new folder `folder`.
  RunStart(const std::string& name, const std::filesystem::path& folder, std::size_t arms);
  ~RunStart();
  RunStart(const RunStart&) = delete;
  RunStart& operator=(const RunStart&) = delete;

  void add_second(const TickRecord& record) { second_inputs_->add(record); }
  void add(const TickRecord& record) { inputs_.add(record); }

  /// Whether the volumes are on the disk, or will not be.
  [[nodiscard]] bool has_volumes() const noexcept { return volumes_.done(); }

  /// Puts the inputs up to tick `last` into the recording in `folder`. Returns why it cannot be
  /// replayed; empty: it can. Throws FileError.
  [[nodiscard]] std::string keep_inputs(const std::filesystem::path& folder, Tick last);

  /// Puts the volumes into the recording in `folder`, after `has_volumes`. Returns what a replay
  /// lacks.
  [[nodiscard]] std::string keep_volumes(const std::filesystem::path& folder);

 private:
  std::filesystem::path folder_;
  StartingVolumes volumes_;
  EarlierInputs inputs_;
  std::optional<EarlierInputs> second_inputs_;
};

}  // namespace kerf
