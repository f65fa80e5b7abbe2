/* SPDX-License-Identifier: Apache-2.0
 * A floor at y = 0 that a program renders at 200 Hz: it says where the surface is, and the servo
 * pulls the tip there at its own rate. Ends with the controller, or after so many seconds.
 *
 *     ./kerf demo --scene external --name mine --seconds 20 &
 *     floor mine 5
 */
#include <kerf/external.h>
#include <math.h>
#include <time.h>

int main(int count, char** words) {
  kerf_external device;
  kerf_report now;
  const struct timespec period = {0, 5000000};
  const double seconds = count > 2 ? atof(words[2]) : 1e9;
  const char* const problem = kerf_external_open(&device, count > 1 ? words[1] : "kerf");
  double deepest_mm = 0, most_n = 0;
  int was_above = 0; /* the tip begins in its dock, which may lie below */
  long turns = 0;
  if (problem != NULL) {
    fprintf(stderr, "floor: %s\n", problem);
    return 1;
  }
  while ((double)turns < 200 * seconds) {
    kerf_force force = {.damping_ns_per_mm = 0};
    nanosleep(&period, NULL);
    if (!kerf_external_read(&device, 0, &now)) break;
    ++turns;
    if (isnan(now.position_mm[1])) continue; /* not calibrated yet */
    was_above = was_above || now.position_mm[1] > 0;
    if (was_above && now.position_mm[1] < 0) {
      memcpy(force.goal_mm, now.position_mm, sizeof force.goal_mm);
      force.goal_mm[1] = 0;
      force.stiffness_n_per_mm = 0.4;
      force.damping_ns_per_mm = 0.001;
      deepest_mm = fmax(deepest_mm, -now.position_mm[1]);
    }
    kerf_external_give(&device, 0, &force); /* in air 0 N, which is a force, too */
    most_n = fmax(most_n, now.force_n[1]);
  }
  printf("%ld turns, %.2f mm deep, %.2f N\n", turns, deepest_mm, most_n);
  kerf_external_close(&device);
  return 0;
}
