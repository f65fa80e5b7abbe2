// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "record/run/tick_window.hpp"
#include "shared/segment/connection.hpp"

// How a flight recorder is found by others: its notice, the names of its folders, and the request
// to keep its window.

namespace kerf {

/// Where a flight recorder says that it runs, and into which folder it writes. One per controller:
/// throws if there is another.
class FlightNotice {
 public:
  FlightNotice(const std::string& name, const std::filesystem::path& out);
  ~FlightNotice();
  FlightNotice(const FlightNotice&) = delete;
  FlightNotice& operator=(const FlightNotice&) = delete;

 private:
  NameLock lock_;
  std::filesystem::path path_;
};

/// Name of the recording of `event`, TICK-REASON: they sort by time.
[[nodiscard]] std::string flight_folder(const TickWindow::Event& event);

/// Name of the folder that has the start of the run of controller `name` while its flight recorder
/// runs.
[[nodiscard]] std::string run_folder(const std::string& name);

/// Asks the flight recorder of controller `name` to keep its window, by a mark in the run. Returns
/// the folder of the recording, once that is whole. Throws `SegmentError` if no controller or no
/// flight recorder of that name runs, or if 10 s pass in which it writes none.
[[nodiscard]] std::filesystem::path grab(const std::string& name);

}  // namespace kerf
