// SPDX-License-Identifier: Apache-2.0
// Encoders and joints, for experts. The geometry of an omega.3 is not public, so the stand-in has
// one of its own, which agrees with itself and with the position alone: each axis of dhd is an
// encoder with counts of 10 um, and a joint with a lever of 0.1 m. Jacobian: 0.1 times identity.

#include <array>
#include <cmath>
#include <cstddef>

#include "standin/dhd/library.hpp"

// NOLINTBEGIN(readability-identifier-naming): names of the interface
using namespace kerf::dhd;  // NOLINT(google-build-using-namespace): the interface is global

namespace {

constexpr double kCountM = 10e-6;
constexpr double kLeverM = 0.1;
constexpr double kTipKg = 0.2;  // of the emulated arm

using Three = std::array<double, 3>;

int count_of(double m) {
  return static_cast<int>(std::lround(m / kCountM));
}

/// With a pose that has just been read, in expert mode: position and velocity in m.
template <class Use>
int with_axes(char id, const Use& use) {
  if (!library().is_expert) return fail(kExpertOnly);
  return with_pose(id, [&](Delta& arm) {
    const auto velocity = arm.velocity().value_or(kerf::DeviceVec<double>{});
    return use(to_dhd(arm.pose().tip_mm * (1 / kMmPerM)), to_dhd(velocity * (1 / kMmPerM)));
  });
}

/// A conversion needs no device of its own kind, but one that is open.
template <class Use>
int convert(char id, const Use& use) {
  if (!library().is_expert) return fail(kExpertOnly);
  return with_arm(id, [&](Delta&) { return use(), kOk; });
}

/// The first three of the eight degrees of freedom; the others are 0. Mask: which are written.
template <class T, class Of>
int give_all(T* out, unsigned mask, const Of& of) {
  if (out == nullptr) return fail(kNullArgument);
  for (std::size_t i = 0; i < kMostDof; ++i) {
    if ((mask >> i) % 2 != 0) out[i] = i < 3 ? of(i) : T{};
  }
  return kOk;
}

void give_jacobian(double* out) {
  for (std::size_t i = 0; out != nullptr && i < 9; ++i) out[i] = i % 4 == 0 ? kLeverM : 0;
}

int set_torques(double a, double b, double c, char id) {
  if (!library().is_expert) return fail(kExpertOnly);
  return with_slot(id, [&](Delta& arm) {
    const int result = arm.set_force(from_dhd(a / kLeverM, b / kLeverM, c / kLeverM));
    return result == kFailed ? fail(kCommunication) : result;
  });
}

constexpr unsigned kAll = 0xFF;

}  // namespace

// Encoders.
KERF_STAND_IN_EXPORT int dhdUpdateEncoders(char id) {
  return with_axes(id, [](const Three&, const Three&) { return kOk; });
}
KERF_STAND_IN_EXPORT int dhdGetDeltaEncoders(int* a, int* b, int* c, char id) {
  return with_axes(id, [&](const Three& p, const Three&) {
    give(a, count_of(p[0]));
    give(b, count_of(p[1]));
    give(c, count_of(p[2]));
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetEnc(int* counts, unsigned char mask, char id) {
  return with_axes(id, [&](const Three& p, const Three&) {
    return give_all(counts, mask, [&](std::size_t i) { return count_of(p[i]); });
  });
}
/// The count itself; kFailed for an axis that is not there.
KERF_STAND_IN_EXPORT int dhdGetEncoder(int index, char id) {
  if (index < 0 || index >= 3) return fail(kBadIndex);
  int count = kFailed;
  static_cast<void>(with_axes(id, [&](const Three& p, const Three&) {
    count = count_of(p[static_cast<std::size_t>(index)]);
    return kOk;
  }));
  return count;
}
KERF_STAND_IN_EXPORT int dhdGetEncVelocities(double* counts_per_s, char id) {
  return with_axes(id, [&](const Three&, const Three& v) {
    return give_all(counts_per_s, kAll, [&](std::size_t i) { return v[i] / kCountM; });
  });
}
KERF_STAND_IN_EXPORT int dhdDeltaEncoderToPosition(int a, int b, int c, double* x, double* y,
                                                   double* z, char id) {
  return convert(id, [&] { give({a * kCountM, b * kCountM, c * kCountM}, x, y, z); });
}
KERF_STAND_IN_EXPORT int dhdDeltaPositionToEncoder(double x, double y, double z, int* a, int* b,
                                                   int* c, char id) {
  if (!(std::abs(x) < 1 && std::abs(y) < 1 && std::abs(z) < 1)) return fail(kGeometry);
  return convert(id, [&] {
    give(a, count_of(x));
    give(b, count_of(y));
    give(c, count_of(z));
  });
}

// Joints.
KERF_STAND_IN_EXPORT int dhdGetDeltaJointAngles(double* a, double* b, double* c, char id) {
  return with_axes(id, [&](const Three& p, const Three&) {
    give({p[0] / kLeverM, p[1] / kLeverM, p[2] / kLeverM}, a, b, c);
    return kOk;
  });
}
KERF_STAND_IN_EXPORT int dhdGetJointAngles(double* angles, char id) {
  return with_axes(id, [&](const Three& p, const Three&) {
    return give_all(angles, kAll, [&](std::size_t i) { return p[i] / kLeverM; });
  });
}
KERF_STAND_IN_EXPORT int dhdGetJointVelocities(double* rates, char id) {
  return with_axes(id, [&](const Three&, const Three& v) {
    return give_all(rates, kAll, [&](std::size_t i) { return v[i] / kLeverM; });
  });
}
KERF_STAND_IN_EXPORT int dhdDeltaEncodersToJointAngles(int a, int b, int c, double* j0, double* j1,
                                                       double* j2, char id) {
  constexpr double kScale = kCountM / kLeverM;
  return convert(id, [&] { give({a * kScale, b * kScale, c * kScale}, j0, j1, j2); });
}
KERF_STAND_IN_EXPORT int dhdDeltaJointAnglesToEncoders(double j0, double j1, double j2, int* a,
                                                       int* b, int* c, char id) {
  return dhdDeltaPositionToEncoder(j0 * kLeverM, j1 * kLeverM, j2 * kLeverM, a, b, c, id);
}
KERF_STAND_IN_EXPORT int dhdGetDeltaJacobian(double* jacobian, char id) {
  return convert(id, [&] { give_jacobian(jacobian); });
}
KERF_STAND_IN_EXPORT int dhdDeltaJointAnglesToJacobian(double /*j0*/, double /*j1*/, double /*j2*/,
                                                       double* jacobian, char id) {
  return convert(id, [&] { give_jacobian(jacobian); });
}
KERF_STAND_IN_EXPORT int dhdSetDeltaJointTorques(double a, double b, double c, char id) {
  return set_torques(a, b, c, id);
}
KERF_STAND_IN_EXPORT int dhdSetJointTorques(double* torques, unsigned char mask, char id) {
  if (torques == nullptr) return fail(kNullArgument);
  const auto of = [&](unsigned i) { return (mask >> i) % 2 != 0 ? torques[i] : 0.0; };
  return set_torques(of(0), of(1), of(2), id);
}
KERF_STAND_IN_EXPORT int dhdJointAnglesToInertiaMatrix(double* /*angles*/, double* inertia,
                                                       char id) {
  return convert(id, [&] {
    for (std::size_t i = 0; inertia != nullptr && i < 36; ++i) {
      inertia[i] = i % 7 == 0 && i < 18 ? kTipKg : 0;
    }
  });
}
/// None: the emulated weight counts as balanced.
KERF_STAND_IN_EXPORT int dhdJointAnglesToGravityJointTorques(double* /*angles*/, double* torques,
                                                             unsigned char mask, char id) {
  return convert(id, [&] { give_all(torques, mask, [](std::size_t) { return 0.0; }); });
}
// NOLINTEND(readability-identifier-naming)
