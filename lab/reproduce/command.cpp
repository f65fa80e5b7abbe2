// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <memory>
#include <ostream>
#include <string>

#include "controller/input/load_error.hpp"
#include "hil/hil_error.hpp"
#include "lab/reproduce/probes.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"

namespace kerf::reproduce {
namespace {

/// `kerf-lab reproduce`: published numbers beside those of kerf's own runs. lab/report/reproduce.py
/// reads the rows and measures them, with this program for each number.
class ReproduceCommand final : public LabCommand {
 public:
  explicit ReproduceCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] int probe(std::ostream& out) const;

  std::string rows_, only_, page_, report_, probe_;
  int jobs_ = 0;
};

ReproduceCommand::ReproduceCommand(Arguments& program)
    : LabCommand(program, "reproduce", "published numbers, each beside kerf's own") {
  app_.option("--rows", rows_,
              "the rows, in place of those of docs/reality.md (which has their form)")
      .shown_as("FILE");
  app_.option("--only", only_, "only the rows of these sources, by their names").shown_as("A,B");
  app_.option("--jobs", jobs_, "threads [all cores]").within(1, 1024);
  app_.option("--report", report_, "write rows and figures as JSON").shown_as("FILE");
  app_.option("--page", page_, "write docs/reality.md, its pictures in plots/ beside it")
      .shown_as("FILE");
  app_.option(
          "--probe", probe_,
          "print one measurement as JSON, of the figures on the standard input as JSON: contact, "
          "cut, devices (lab/reproduce/probes.hpp)")
      .one_of({"contact", "cut", "devices"})
      .shown_as("NAME");
  app_.footer(
      "All rows take minutes. Exit codes: 0 each miss is explained, 1 one is not, 2 bad input or "
      "set-up.");
}

int ReproduceCommand::probe(std::ostream& out) const {
  Json figures;
  if (probe_ != "devices") {
    constexpr std::size_t kMostBytes = 65'536;
    std::string text(kMostBytes + 1, '\0');
    std::cin.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(std::cin.gcount()));
    if (text.size() > kMostBytes) {
      throw HilError(
          "--probe: the standard input has more than 64 KiB; give such as {\"seconds\": 2}");
    }
    try {
      figures = Json::parse(text);
      static_cast<void>(figures.members());
    } catch (const JsonError& error) {
      throw HilError(std::string("--probe: the standard input is no JSON object (") + error.what() +
                     "); give such as {\"seconds\": 2}");
    }
  }
  try {
    out << (probe_ == "contact" ? contact_energy(figures)
            : probe_ == "cut"   ? cut_rate(figures)
                                : device_table())
               .canonical()
        << '\n';
  } catch (const JsonError& error) {
    throw HilError(std::string("--probe: ") + error.what() + "; give settings as a list of texts");
  }
  return 0;
}

int ReproduceCommand::run(std::ostream& out) const {
  if (!probe_.empty()) {
    if (!rows_.empty() || !only_.empty() || !page_.empty() || !report_.empty() || jobs_ > 0) {
      throw HilError("--probe: measures one thing; leave all other options out");
    }
    return probe(out);
  }
  if (!page_.empty()) {
    if (!rows_.empty() || !only_.empty()) {
      throw HilError("--page: is of all rows; leave --rows and --only out");
    }
    check_can_plot();
  }
  const LabOutput as_report("--report", report_, ".json");
  if (!rows_.empty()) check_outputs({rows_}, {{"--report", report_, ".json"}});
  const LabOutput as_page("--page", page_, ".md");
  const std::string regions = page_plot("--page", page_, ".regions.svg"),
                    energy = page_plot("--page", page_, ".energy.svg");
  const LabOutput as_regions("--page", regions, ".svg"), as_energy("--page", energy, ".svg");
  LabOutput::check_distinct({&as_report, &as_page});
  const Json order{{"program", std::filesystem::read_symlink("/proc/self/exe").string()},
                   {"rows", rows_},
                   {"only", only_},
                   {"plots", !page_.empty()},
                   {"jobs", jobs_},
                   {"provenance", lab_provenance()}};
  const std::string measured = make_report({"reproduce", "measure"}, order.canonical());
  out << make_report({"reproduce", "tables"}, measured);
  as_report.write(measured);
  if (!page_.empty()) {
    as_regions.write_report({"reproduce", "regions"}, measured, out);
    as_energy.write_report({"reproduce", "energy"}, measured, out);
    as_page.write_report({"reproduce", "page", page_link(page_, regions), page_link(page_, energy)},
                         measured, out);
  }
  return Json::parse(measured).at("unexplained").get<int>() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace kerf::reproduce

std::unique_ptr<kerf::LabCommand> kerf::make_reproduce_command(Arguments& program) {
  return std::make_unique<reproduce::ReproduceCommand>(program);
}
