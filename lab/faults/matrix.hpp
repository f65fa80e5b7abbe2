// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controller/load/loaded_scene.hpp"
#include "hil/devmodel/hand_script.hpp"
#include "hil/script/fault_script.hpp"
#include "lab/faults/fault_run.hpp"
#include "shared/text/json.hpp"

namespace kerf::faults {

/// A script under the name of its file; none: faults at random, other ones for each seed.
struct NamedScript {
  std::string name;
  std::optional<FaultScript> script;
};

/// One device in one scene.
struct Cell {
  LoadedScene scene;
  HandScript hand;
  std::string device, model, numeric;
};

/// A cell, a script, all seeds.
struct Row {
  std::string device, model, numeric, script;
  int rate_hz = 0;
  unsigned runs = 0;
  unsigned pushed_again = 0;         ///< runs with force after the last fault
  unsigned latched = 0;              ///< runs whose reports amounted to a fault
  std::vector<std::string> vacuous;  ///< a line for each run that shows nothing
  std::string latches;               ///< of the script
  Outcome worst;
};

/// Whether this script breaks something that the cell's device has; one that has no faults does.
[[nodiscard]] bool concerns(const NamedScript& named, const Cell& cell);

/// Seeds `seed_base` to `seed_base + seeds - 1`. The same arguments give the same row.
[[nodiscard]] Row run_row(const Cell& cell, const NamedScript& named, std::uint32_t seed_base,
                          unsigned seeds);

/// The first line of a table, and a line for each row.
[[nodiscard]] std::string table_head();
[[nodiscard]] std::string line_of(const Row& row);
[[nodiscard]] Json json_of(const Row& row);

/// The worst figures of a matrix.
class Summary {
 public:
  void add(const Row& row);
  [[nodiscard]] bool held() const noexcept { return broken_ == 0 && vacuous_ == 0; }
  [[nodiscard]] std::string text() const;
  [[nodiscard]] Json json() const;

 private:
  std::uint64_t runs_ = 0, broken_ = 0, vacuous_ = 0;
  Outcome worst_;
  std::map<std::string, double> latch_ms_;  ///< by fault, of scripts that name it
};

}  // namespace kerf::faults
