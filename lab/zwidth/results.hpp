// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "lab/rig/lab_command.hpp"
#include "lab/rig/lab_run.hpp"
#include "lab/zwidth/map/part_file.hpp"

namespace kerf::zwidth {

/// A picture that cannot be drawn is told before hours of measuring. Throws HilError.
void require_gnuplot();

/// The files that a map is written to.
struct OutputPaths {
  std::string csv, json, plot;
  void declare(Arguments& app);
};

/// The same, checked before the map is measured: none is one of the parts, which are read. Throws
/// HilError, or FileError.
class Outputs {
 public:
  Outputs(const OutputPaths& paths, const std::vector<std::string>& parts);
  void write(const Part& part) const;

 private:
  bool draws_;
  LabOutput csv_, json_, plot_;
};

/// One line for each column: what it is, and where it stops.
void tell(const Part& part, std::ostream& out);

}  // namespace kerf::zwidth
