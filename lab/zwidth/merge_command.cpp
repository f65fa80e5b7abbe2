// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/merge_command.hpp"

#include "lab/zwidth/picture/map_plot.hpp"

namespace kerf::zwidth {

MergeCommand::MergeCommand(Arguments& program)
    : LabCommand(program, "merge", "the parts of a map (zwidth --shard) as one map") {
  app_.option("parts", parts_, "part files, one of each shard").required().shown_as("FILE...");
  paths_.declare(app_);
}

int MergeCommand::run(std::ostream& out) const {
  const Outputs outputs(paths_, parts_);
  const Part whole = merge_parts(parts_);
  if (!paths_.plot.empty()) check_panels(whole.spec);
  tell(whole, out);
  outputs.write(whole);
  return 0;
}

}  // namespace kerf::zwidth
