// SPDX-License-Identifier: Apache-2.0
#include "replay/replay.hpp"

int main(int argc, char** argv) {
  return kerf::run_replay_program(argc, argv);
}
