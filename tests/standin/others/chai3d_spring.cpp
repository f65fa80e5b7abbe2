// SPDX-License-Identifier: Apache-2.0
// A spring about the origin by CHAI3D's own classes, for any device that it finds, and what it read
// and sent.
//
//     chai3d_spring SECONDS NEWTONS_PER_METRE
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <chai3d.h>

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::milliseconds turn(1);
  if (argc != 3) return 2;
  const double stiffness = std::atof(argv[2]);
  chai3d::cHapticDeviceHandler handler;
  chai3d::cGenericHapticDevicePtr device;
  if (!handler.getDevice(device, 0) || !device->open()) return 2;
  const auto info = device->getSpecifications();
  std::printf("%s, at most %g N\n", info.m_modelName.c_str(), info.m_maxLinearForce);
  device->calibrate();
  const chai3d::cVector3d none(0, 0, 0);
  chai3d::cVector3d now, last, force = none;
  const auto send = [&] { device->setForceAndTorqueAndGripperForce(force, none, 0.0); };
  // The first frames; a pause of 32 ms without a force would end all forces, by the watchdog that
  // CHAI3D sets.
  for (int i = 0; i < 100; ++i) {
    std::this_thread::sleep_for(turn);
    send();
    device->getPosition(last);
  }
  double work_j = 0, square_seconds = 0;  // by the clock: a turn on a busy machine may be long
  auto due = Clock::now();
  const auto begin = due;
  auto before = begin;
  const std::chrono::duration<double> length(std::atof(argv[1]));
  while (Clock::now() - begin < length) {
    due = std::max(due + turn, Clock::now());
    std::this_thread::sleep_until(due);
    device->getPosition(now);
    work_j += force.dot(now - last);
    const auto at = Clock::now();
    square_seconds += force.lengthsq() * std::chrono::duration<double>(at - before).count();
    before = at;
    last = now;
    force = -stiffness * now;
    send();
  }
  const double seconds = std::chrono::duration<double>(before - begin).count();
  force = none;
  for (int i = 0; i < 2000; ++i) {  // the hand comes to rest
    std::this_thread::sleep_for(turn);
    send();
  }
  device->getPosition(now);
  std::printf("position_mm %g %g %g rms_n %g seconds %g work_mj %g\n", 1000 * now.x(),
              1000 * now.y(), 1000 * now.z(), std::sqrt(square_seconds / seconds), seconds,
              1000 * work_j);
  device->close();
}
