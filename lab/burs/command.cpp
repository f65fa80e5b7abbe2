// SPDX-License-Identifier: Apache-2.0
#include "lab/burs/command.hpp"

#include <ostream>

#include "controller/scene/burs.hpp"
#include "lab/burs/sheet.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/text/format.hpp"

namespace kerf::burs {

Command::Command(Arguments& program)
    : LabCommand(program, "burs", "the burs that a scene can name by their ISO number") {
  app_.option("--svg", svg_, "draw them, at their usual sizes").shown_as("FILE");
}

int Command::run(std::ostream& out) const {
  check_outputs({}, {{"--svg", svg_, ".svg"}});
  for (const BurHead& head : kBurHeads) {
    out << format("%.3s  %-14s %-14s %03d to %03d\n", head.number.data(), head.name.data(),
                  head.shape.data(), kSmallestBur, head.largest);
  }
  if (!svg_.empty()) write_new_file(svg_, sheet_svg());
  return 0;
}

}  // namespace kerf::burs
