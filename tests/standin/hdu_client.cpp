// SPDX-License-Identifier: Apache-2.0
// A program in C++11 for HD and HDU, in the manner of the ROS nodes for a Touch: it includes the
// headers of the stand-in and links its libraries, and knows nothing else of kerf. Prints what it
// found; exit code 1 if something was not as it must be.
//
//     hdu_client TICKS
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include <HD/hd.h>
#include <HDU/hduError.h>
#include <HDU/hduMatrix.h>
#include <HDU/hduQuaternion.h>
#include <HDU/hduVector.h>

namespace {

int failures = 0;

void expect(bool is_so, const char* what) {
  if (is_so) return;
  std::fprintf(stderr, "hdu_client: not so: %s\n", what);
  ++failures;
}

struct State {
  int ticks = 0, left = 0;
  hduVector3Dd position, before, velocity, joints, gimbal;
  hduQuaternion orientation;
  long encoders[6] = {};
};

HDCallbackCode HDCALLBACK tick(void* data) {
  State& state = *static_cast<State*>(data);
  hdBeginFrame(hdGetCurrentDevice());
  hduMatrix transform;
  hduVector3Dd position;
  hdGetDoublev(HD_CURRENT_TRANSFORM, transform);
  hdGetDoublev(HD_CURRENT_POSITION, position);
  hdGetDoublev(HD_CURRENT_JOINT_ANGLES, state.joints);
  hdGetDoublev(HD_CURRENT_GIMBAL_ANGLES, state.gimbal);
  hdGetLongv(HD_CURRENT_ENCODER_VALUES, state.encoders);
  expect(hduVector3Dd(transform[3][0], transform[3][1], transform[3][2]) == position,
         "the last row is the position");

  hduMatrix rotation(transform), again;
  rotation.getRotationMatrix(rotation);
  state.orientation = hduQuaternion(rotation);
  state.orientation.toRotMatrix(again);
  hduVector3Dd handle, by_rows;
  rotation.multDirMatrix(hduVector3Dd(0, 0, 1), handle);
  again.multDirMatrix(hduVector3Dd(0, 0, 1), by_rows);
  expect(handle.distance(by_rows) < 1e-12, "a quaternion is its matrix");
  // Ry(-j1) Rx(-j3) Ry(g1) Rx(-g2) Rz(-g3) for column vectors: for rows the last comes first.
  const hduVector3Dd &j = state.joints, &g = state.gimbal;
  const hduMatrix chain =
      hduMatrix::createRotationAroundZ(-g[2]) * hduMatrix::createRotationAroundX(-g[1]) *
      hduMatrix::createRotationAroundY(g[0]) * hduMatrix::createRotationAroundX(-j[2]) *
      hduMatrix::createRotationAroundY(-j[0]);
  chain.multDirMatrix(hduVector3Dd(0, 0, 1), by_rows);
  expect(handle.distance(by_rows) < 1e-9, "joints and gimbal lead to the transform");

  state.velocity = (position * 3 - 4 * state.position + state.before) / 0.002;
  state.before = state.position;
  state.position = position;
  hduVector3Dd force;
  hduVecScale(force, position, state.left > 1 ? -0.01 : 0);
  hdSetDoublev(HD_CURRENT_FORCE, force);
  hdEndFrame(hdGetCurrentDevice());
  HDErrorInfo error;
  if (HD_DEVICE_ERROR(error = hdGetError())) {
    hduPrintError(stderr, &error, "in the callback");
    ++failures;
    if (hduIsSchedulerError(&error)) return HD_CALLBACK_DONE;
  }
  ++state.ticks;
  return --state.left > 0 ? HD_CALLBACK_CONTINUE : HD_CALLBACK_DONE;
}

void check_errors() {
  char text[400] = {};
  std::FILE* const file = std::tmpfile();
  hdBeginFrame(4711);
  HDErrorInfo error = hdGetError();
  expect(error.errorCode == HD_BAD_HANDLE && error.hHD == 4711, "a bad handle is named");
  hduPrintError(file, &error, "first words");
  hduPrintError(file, &error, nullptr);
  hduPrintError(nullptr, &error, "");
  hduPrintError(file, nullptr, "nothing");
  std::rewind(file);
  expect(std::fread(text, 1, sizeof text - 1, file) > 0, "there is a text");
  std::fclose(file);
  std::ostringstream said;
  said << error;
  expect(text == "first words: " + said.str() + "\n" + said.str() + "\n",
         "file and stream say the same");
  expect(said.str().find("0x0104") != std::string::npos, "the code is in it");
  const HDerror forces[] = {HD_WARM_MOTORS, HD_EXCEEDED_MAX_FORCE, HD_EXCEEDED_MAX_FORCE_IMPULSE,
                            HD_EXCEEDED_MAX_VELOCITY, HD_FORCE_ERROR};
  const HDerror scheduler[] = {HD_COMM_ERROR, HD_COMM_CONFIG_ERROR, HD_TIMER_ERROR,
                               HD_INVALID_PRIORITY, HD_SCHEDULER_FULL};
  int found = 0;
  for (HDerror code = 0; code < 0x700; ++code) {
    error.errorCode = code;
    found += (hduIsForceError(&error) != 0 ? 1 : 0) + (hduIsSchedulerError(&error) != 0 ? 1 : 0);
  }
  for (const HDerror code : forces) {
    error.errorCode = code;
    expect(hduIsForceError(&error) != 0, "a force error is one");
  }
  for (const HDerror code : scheduler) {
    error.errorCode = code;
    expect(hduIsSchedulerError(&error) != 0, "a scheduler error is one");
  }
  expect(found == 10, "no other error is one of force or scheduler");
}

}  // namespace

int main(int argc, char** argv) {
  State state;
  state.left = argc > 1 ? std::atoi(argv[1]) : 1000;
  const HHD device = hdInitDevice(HD_DEFAULT_DEVICE);
  HDErrorInfo error;
  if (HD_DEVICE_ERROR(error = hdGetError())) {
    hduPrintError(stderr, &error, "no device");
    return 1;
  }
  HDint style = 0;
  hdGetIntegerv(HD_CALIBRATION_STYLE, &style);
  expect((style & HD_CALIBRATION_INKWELL) != 0, "a Touch has an inkwell");
  hdEnable(HD_FORCE_OUTPUT);
  hdStartScheduler();
  expect(hdCheckCalibration() == HD_CALIBRATION_OK, "it is calibrated");
  const HDSchedulerHandle handle = hdScheduleAsynchronous(tick, &state, HD_MAX_SCHEDULER_PRIORITY);
  hdWaitForCompletion(handle, HD_WAIT_INFINITE);
  hdStopScheduler();
  while (HD_DEVICE_ERROR(error = hdGetError())) {
  }
  check_errors();
  hdDisableDevice(device);
  std::printf("%s %d ticks, at %g %g %g mm, encoders %ld %ld %ld\n", hdGetErrorString(HD_SUCCESS),
              state.ticks, state.position[0], state.position[1], state.position[2],
              state.encoders[0], state.encoders[1], state.encoders[2]);
  return failures == 0 ? 0 : 1;
}
