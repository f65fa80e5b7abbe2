// SPDX-License-Identifier: Apache-2.0
#include "record/run/recorder_options.hpp"

#include <charconv>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>

#include "shared/posix/tick_lead.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"

namespace kerf {

double split_s(const std::string& text) {
  constexpr double kDay = 86400;
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [unit, fault] = std::from_chars(text.data(), end, value);
  const std::string_view rest(unit, end);
  const double factor = rest == "s" ? 1 : rest == "m" ? 60 : rest == "h" ? 3600 : 0;
  const double seconds = value * factor;
  if (fault != std::errc() || !(seconds >= 1 && seconds <= kDay)) {
    throw UsageError("--split " + one_line(text) +
                     ": no time from 1s to 24h; give one as 90s, 10m or 2h");
  }
  return seconds;
}

bool parse_options(int argc, char** argv, RecorderOptions& options) {
  CommandLine app("Logs every tick of a running kerf-controller into a folder.", "kerf-recorder",
                  KERF_VERSION);
  app.option("--name", options.name, "name of the controller").shows_default();
  app.option("--out", options.out, "folder for ticks, scene, manifest and volumes").required();
  app.option("--wait", options.wait_s, "seconds to wait for the controller")
      .within(0, 86400)
      .shows_default();
  app.flag("--resume", options.resume,
           "go on with the recording of the same run in --out, after its recorder was killed");
  app.option(
         "--flight", options.flight_s,
         "keep only the last SECONDS, in memory; each fault, SIGUSR1, kerf-record grab and key f "
         "of the window write them as a recording into --out, with what a replay needs")
      .within(1, kMostFlightS)
      .shown_as("SECONDS");
  app.option("--split", options.split,
             "a new file of the log after so much of the run, as 10m; read as one")
      .shown_as("TIME");
  app.option("--lead", options.lead,
             "lead a controller in lock-step (its --until), so that no tick is lost")
      .shown_as("FIFO");
  app.flag("--strict", options.strict, "exit 1 if ticks were lost");
  app.option("--report", options.report, "write the figures as JSON");
  if (!app.parse(argc, argv, std::cout)) return false;
  if (options.resume && options.flight_s > 0) {
    throw UsageError(
        "--resume: a flight recorder has nothing to go on with; leave one of both out");
  }
  if (options.flight_s > 0 && (options.strict || !options.report.empty())) {
    throw UsageError("--strict, --report: are of a whole run; leave them out beside --flight");
  }
  if (!options.split.empty() && options.flight_s > 0) {
    throw UsageError("--split: a flight recorder writes short logs; leave one of both out");
  }
  if (!options.split.empty()) static_cast<void>(split_s(options.split));
  if (!options.lead.empty()) {
    if (const std::string why = TickLead::problem_with(options.lead); !why.empty()) {
      throw UsageError(why);
    }
  }
  return true;
}

}  // namespace kerf
