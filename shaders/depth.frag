// SPDX-License-Identifier: Apache-2.0
#version 450 core
// True depth, so that everything hides everything as it should.

// The paper's equation (1): 0 at the near plane, 1 at the far plane.
float window_depth(float eye_mm, float near_mm, float far_mm) {
  float f = far_mm;
  float n = near_mm;
  return ((f + n) / (f - n) - 2.0 * f * n / ((f - n) * eye_mm) + 1.0) / 2.0;
}

// Its inverse.
float eye_distance(float window_depth, float near_mm, float far_mm) {
  float f = far_mm;
  float n = near_mm;
  return 2.0 * f * n / (f + n - (2.0 * window_depth - 1.0) * (f - n));
}
