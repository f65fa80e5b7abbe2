// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"
#include "lab/zwidth/map/axes.hpp"
#include "lab/zwidth/map/part_file.hpp"
#include "lab/zwidth/results.hpp"

namespace kerf::zwidth {

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

}  // namespace kerf::zwidth
