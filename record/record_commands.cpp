// SPDX-License-Identifier: Apache-2.0
#include "record/record_commands.hpp"

#include <filesystem>
#include <iostream>

#include <CLI/CLI.hpp>

#include "record/export_csv.hpp"
#include "record/manifest.hpp"
#include "record/plot.hpp"
#include "record/summary.hpp"
#include "shared/posix/new_file.hpp"

namespace kerf {

int run_record(int argc, char** argv) {
  CLI::App app{"Looks at what kerf-recorder wrote."};
  app.set_version_flag("--version", KERF_VERSION);
  app.require_subcommand(1);
  std::filesystem::path folder;
  std::filesystem::path report;
  std::filesystem::path svg;
  std::filesystem::path csv;
  const auto add_command = [&](const char* name, const char* what) {
    CLI::App* const command = app.add_subcommand(name, what);
    command->add_option("DIR", folder, "folder of a recording")->required();
    return command;
  };
  CLI::App* const info = add_command("info", "length, losses, forces, removed volume");
  info->add_option("--report", report, "write the figures as JSON");
  CLI::App* const plot = add_command("plot", "forces and penetration over time, as SVG");
  plot->add_option("--out", svg, "the SVG file")->required();
  CLI::App* const table = add_command("export", "every tick as a line of text");
  table->add_option("--csv", csv, "the CSV file")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& done) {
    return app.exit(done);
  } catch (const CLI::ParseError& error) {
    std::cerr << "kerf-record: " << error.what() << "; see --help\n";
    return 2;
  }
  if (info->parsed()) {
    const RecordSummary summary = summarise(folder);
    std::cout << to_text(summary);
    if (!report.empty()) write_new_file(report, to_json(summary));
  }
  if (plot->parsed()) plot_forces(folder, svg);
  if (table->parsed()) export_csv(folder, csv);
  return 0;
}

}  // namespace kerf
