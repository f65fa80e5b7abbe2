// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>

#include "lab/stability/axes.hpp"
#include "shared/text/command_line.hpp"

namespace kerf::zwidth {

/// The options of a command that name axes: `--rate VALUE` and so on, and `--direction` of a
/// device. It lives as long as the program parses.
struct AxisOptions {
  std::array<std::string, kAxisCount> texts;  ///< as given; empty: not given
  std::string direction;                      ///< of a file of `kerf identify`; empty: worst

  /// Adds the options of these axes to `app`, each with its unit and its standard value.
  void declare(Arguments& app, std::span<const AxisId> axes);

 private:
  std::array<std::string, kAxisCount> names_;  ///< an option keeps only a pointer to its name
};

}  // namespace kerf::zwidth
