// SPDX-License-Identifier: Apache-2.0
// A run as another program makes it, with include/kerf alone.
//     face_run SCENE HAND[,HAND] FOLDER TICKS [SETTING...]
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <kerf/hand.hpp>
#include <kerf/log.hpp>
#include <kerf/scene.hpp>
#include <kerf/servo.hpp>

int main(int argc, char** argv) try {
  if (argc < 5) return 2;
  const auto scene = kerf::Scene::load(argv[1], kerf::Settings(argv + 5, argv + argc));
  kerf::Servo servo(scene);
  std::vector<kerf::Hand> hands;
  std::istringstream scripts(argv[2]);
  for (std::string script; std::getline(scripts, script, ',');) {
    hands.emplace_back(scene, script, "", hands.size());
  }
  if (hands.size() != scene.arms()) throw kerf::Error("HAND: give one for each arm");
  kerf::LogWriter log(argv[3], scene);
  std::vector<kerf::DeviceReport> reports(scene.arms());
  for (long tick = 0; tick < std::atol(argv[4]); ++tick) {
    for (std::size_t arm = 0; arm < reports.size(); ++arm) {
      reports[arm] = hands[arm].next(servo.last(arm));
    }
    log.add(servo.step(reports));
  }
  log.close();
  std::printf("%016jx\n", std::uintmax_t{servo.last().output_hash});
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "face_run: %s\n", error.what());
  return 1;
}
