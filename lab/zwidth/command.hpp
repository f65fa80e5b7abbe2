// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"
#include "lab/zwidth/axes.hpp"
#include "lab/zwidth/part_file.hpp"

namespace kerf::zwidth {

/// The files that a map is written to; `MergeCommand` has the same.
struct OutputPaths {
  std::string csv, json, plot;
  void declare(Arguments& app);
};

/// `kerf-lab zwidth`: which stiffness and damping a device bears, measured, beside the theory.
class Command final : public LabCommand {
 public:
  explicit Command(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] MapSpec spec() const;
  static void try_laws(const MapSpec& map, std::ostream& out);
  [[nodiscard]] Shard shard() const;
  [[nodiscard]] int threads(std::size_t columns) const;
  /// The columns of the shard that `kept` has not; false: interrupted.
  [[nodiscard]] bool measure(const MapSpec& map, const Shard& shard, PartWriter& kept,
                             std::ostream& out) const;
  void draw_portraits(const MapSpec& spec) const;
  void write_page() const;

  std::array<std::string, kAxisCount> axes_, option_names_;
  std::string stiffness_, map_ = "damping,stiffness", shard_ = "1/1", part_, portraits_, page_;
  std::vector<std::string> cells_;
  OutputPaths paths_;
  bool quick_ = false, arm_ = false;
  double seconds_ = 0;
  std::uint32_t seed_ = 1;
  int jobs_ = 0;
};

/// `kerf-lab merge`: the parts of a map's shards as one map.
class MergeCommand final : public LabCommand {
 public:
  explicit MergeCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::vector<std::string> parts_;
  OutputPaths paths_;
};

}  // namespace kerf::zwidth
