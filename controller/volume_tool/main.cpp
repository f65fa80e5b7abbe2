// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "controller/volume_tool/volume_commands.hpp"

int main(int argc, char** argv) {
  return kerf::run_volume_tool(argc, argv, std::cout, std::cerr);
}
