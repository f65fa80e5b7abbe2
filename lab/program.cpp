// SPDX-License-Identifier: Apache-2.0
#include "lab/program.hpp"

#include <array>
#include <ostream>

#include "lab/accuracy/command.hpp"
#include "lab/bench/bench_command.hpp"
#include "lab/bridge/command.hpp"
#include "lab/bridge/demo_command.hpp"
#include "lab/burs/command.hpp"
#include "lab/energy/command.hpp"
#include "lab/extremes/command.hpp"
#include "lab/faults/command.hpp"
#include "lab/law/command.hpp"
#include "lab/ranges/command.hpp"
#include "lab/sweep/command.hpp"
#include "lab/zwidth/command.hpp"
#include "lab/zwidth/merge_command.hpp"
#include "shared/posix/failure.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {

int run_lab(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CommandLine app("Measures kerf without a device.", "kerf-lab", "kerf-lab " KERF_VERSION);
  app.footer("Exit codes: 0 fine, 1 a check failed, 2 bad input or set-up.");
  const BenchCommand bench(app);
  const accuracy::Command accuracy(app);
  const two_machines::Command bridge(app);
  const two_machines::DemoCommand demo(app);
  const burs::Command burs(app);
  const energy::Command energy(app);
  const extremes::Command extremes(app);
  const faults::Command faults(app);
  const laws::Command laws(app);
  const ranges::Command ranges(app);
  const sweep::Command sweep(app);
  const zwidth::Command zwidth(app);
  const zwidth::MergeCommand merge(app);
  const std::array<const LabCommand*, 13> commands{&bench,  &accuracy, &bridge, &demo, &burs,
                                                   &energy, &extremes, &faults, &laws, &ranges,
                                                   &sweep,  &zwidth,   &merge};
  try {
    int code = 0;
    if (app.parse(argc, argv, out)) {
      for (const LabCommand* command : commands) {
        if (command->chosen()) code = command->run(out);
      }
    }
    return code;
  } catch (...) {
    err << "kerf-lab: " << failure_text() << '\n';
    return 2;
  }
}

}  // namespace kerf
