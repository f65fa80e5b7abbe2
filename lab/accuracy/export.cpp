// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "lab/accuracy/page.hpp"
#include "shared/text/json.hpp"

namespace kerf::accuracy {

std::string csv(const std::vector<Entry>& entries) {
  std::string text = "knob,value,shape,metric,figure,unit,us_p50,us_p99,us_max\n";
  for (const Entry& entry : entries) {
    char times[64];
    std::snprintf(times, sizeof times, "%.3f,%.3f,%.3f\n", entry.times.p50_ns / 1e3,
                  entry.times.p99_ns / 1e3, entry.times.max_ns / 1e3);
    for (const Figure& figure : entry.figures) {
      char value[32];
      std::snprintf(value, sizeof value, "%.6g", figure.figure);
      text += entry.knob + ',' + entry.value + ',' + figure.shape + ',' + figure.metric + ',' +
              value + ',' + figure.unit + ',' + times;
    }
  }
  return text;
}

std::string json(const std::vector<Entry>& entries, int core) {
  Json report;
  report["core"] = core;
  report["rows"] = Json::List{};
  for (const Entry& entry : entries) {
    for (const Figure& figure : entry.figures) {
      report["rows"].push_back({{"knob", entry.knob},
                                {"value", entry.value},
                                {"shape", figure.shape},
                                {"metric", figure.metric},
                                {"figure", figure.figure},
                                {"unit", figure.unit},
                                {"us_p50", entry.times.p50_ns / 1e3},
                                {"us_p99", entry.times.p99_ns / 1e3},
                                {"us_max", entry.times.max_ns / 1e3}});
    }
  }
  return report.document();
}

}  // namespace kerf::accuracy
