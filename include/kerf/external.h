/* SPDX-License-Identifier: Apache-2.0
 *
 * A force of your own under kerf's limits, in C: the page of memory that a controller of a scene
 * with `force.model = "external"` shares with one program. You write what you ask for, kerf does
 * the rest: arming, fading, limits, watchdog, motors off (docs/own-law.md). Linux, GCC or Clang,
 * with -std=gnu99 or later, or -D_GNU_SOURCE.
 *
 *     kerf_external arm;
 *     kerf_report now;
 *     const char* problem = kerf_external_open(&arm, "kerf");
 *     while (!problem && kerf_external_read(&arm, 0, &now)) {
 *       kerf_force up = {.force_n = {0, 0.5, 0}};
 *       kerf_external_give(&arm, 0, &up);   // counts for force.stale_ms: 20 ms
 *       usleep(2000);
 *     }
 *     kerf_external_close(&arm);
 *
 * The controller never waits for the program. The program's reads repeat while the controller
 * writes: for some nanoseconds, or, if it is stopped just there, until it goes on or ends. One
 * program at a time, with at most one thread for each arm; a program that it has forked since
 * shares its place.
 */
#ifndef KERF_EXTERNAL_H
#define KERF_EXTERNAL_H

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#ifndef O_NOFOLLOW
#error "kerf/external.h: compile with -std=gnu99 or later, or with -D_GNU_SOURCE"
#endif

#define KERF_EXTERNAL_MAGIC UINT64_C(0x316c6e747866726b) /* "krfxtnl1" */
#define KERF_EXTERNAL_LAYOUT 1U
#define KERF_EXTERNAL_BYTES 4096U
#define KERF_EXTERNAL_ARMS 2U

/* What a program asks for: force + stiffness (goal - tip) / workspace_scale - damping v, at the
 * device port, along the axes of the scene. Each component of the force at most 255 N, of a goal
 * 10 m; stiffness and damping at most the scene's. Beyond that, or if a number is not finite, it is
 * refused and counted, and the last one goes on. */
typedef struct {
  double force_n[3];
  double goal_mm[3]; /* in the scene; counts with a stiffness alone */
  double stiffness_n_per_mm, damping_ns_per_mm;
} kerf_force;

/* Phases of the safety state machine; motors are on in RAMPING and ACTIVE. */
enum {
  KERF_PHASE_OFF,
  KERF_PHASE_CALIBRATING,
  KERF_PHASE_ARMED,
  KERF_PHASE_RAMPING,
  KERF_PHASE_ACTIVE,
  KERF_PHASE_FAULT
};
/* Some of the flags; all of them, and the faults, are in docs/log.md. */
enum {
  KERF_FLAG_BUTTON1 = 1,
  KERF_FLAG_BUTTON2 = 2,
  KERF_FLAG_MOTORS_ON = 128,
  KERF_FLAG_PARKED = 256
};

/* The last tick of an arm. */
typedef struct {
  uint64_t tick;    /* 0: none yet */
  uint64_t answers; /* number of the newest force that came before the tick, a refused one too */
  uint64_t refused; /* forces that were refused, since the controller's start */
  double position_mm[3];       /* of the tip, in the scene; NaN until the device is calibrated */
  double orientation[4];       /* quaternion x, y, z, w; NaN as the position */
  double velocity_mm_per_s[3]; /* at the device port; NaN until the device is first in hand */
  double force_n[3];           /* sent to the device, after all limits */
  uint32_t phase, fault, flags;
  uint32_t gaps; /* times that a force became stale, since the controller's start */
} kerf_report;

/* One arm's part of the page. A version is odd while the rest of its part is written. */
typedef struct {
  uint64_t report_version;
  kerf_report report;
  uint8_t room[256 - sizeof(uint64_t) - sizeof(kerf_report)];
  uint64_t force_version;
  uint64_t force_number;
  kerf_force force;
  uint8_t more_room[256 - 2 * sizeof(uint64_t) - sizeof(kerf_force)];
} kerf_external_arm;

/* The page: `external-NAME.page` in the folder of the segment (docs/api.md), rights 0600. The
 * controller holds a lock on its first byte, the program on the whole file (flock). */
typedef struct {
  uint64_t magic;
  uint32_t layout, arms, rate_hz, reserved;
  uint64_t session;       /* 0: the controller has ended */
  double workspace_scale; /* mm of the scene for each mm of the device */
  uint8_t room[256 - 5 * sizeof(uint64_t)];
  kerf_external_arm arm[KERF_EXTERNAL_ARMS];
  uint8_t more_room[KERF_EXTERNAL_BYTES - 256 - KERF_EXTERNAL_ARMS * sizeof(kerf_external_arm)];
} kerf_external_page;

/* A program's side. Only the functions below touch it. */
typedef struct {
  kerf_external_page* page; /* null: not open */
  int file;
  uint32_t arms, rate_hz;
  double workspace_scale;
  uint64_t session;
  uint64_t last_tick[KERF_EXTERNAL_ARMS]; /* that was read */
} kerf_external;

/* Whether the controller still has its lock. */
static inline int kerf_external_lives(int file) {
  struct flock lock;
  memset(&lock, 0, sizeof lock);
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_len = 1;
  return fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

/* Copies 64-bit words between the page and `own`, while the other side may write. */
static inline void kerf_external_load(void* own, const void* page, size_t bytes) {
  size_t i;
  for (i = 0; i < bytes; i += 8) {
    const uint64_t word =
        __atomic_load_n((const uint64_t*)(const void*)((const char*)page + i), __ATOMIC_RELAXED);
    memcpy((char*)own + i, &word, 8);
  }
}
static inline void kerf_external_store(void* page, const void* own, size_t bytes) {
  size_t i;
  for (i = 0; i < bytes; i += 8) {
    uint64_t word;
    memcpy(&word, (const char*)own + i, 8);
    __atomic_store_n((uint64_t*)(void*)((char*)page + i), word, __ATOMIC_RELAXED);
  }
}

/* Opens the page of the controller that runs under `name` (its --name; "kerf" if it has none).
 * Returns null, or why not: one line, until the next call in this thread. */
static inline const char* kerf_external_open(kerf_external* out, const char* name) {
  static __thread char why[1024];
  char path[400];
  const char* const runtime = getenv("XDG_RUNTIME_DIR");
  struct stat status;
  memset(out, 0, sizeof *out);
  out->file = -1;
  if (strchr(name, '/') != NULL || strlen(name) > 64) {
    return "name: not that of a controller; use its --name";
  }
  if (runtime != NULL && runtime[0] == '/') {
    snprintf(path, sizeof path, "%s/kerf/external-%s.page", runtime, name);
  } else {
    snprintf(path, sizeof path, "/tmp/kerf-%u/external-%s.page", (unsigned)geteuid(), name);
  }
  out->file = open(path, O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (out->file < 0) {
    snprintf(why, sizeof why,
             "%s: %s; no controller with a scene of force.model = \"external\" runs here as --name "
             "%s; start one, with your user and XDG_RUNTIME_DIR",
             path, strerror(errno), name);
    return why;
  }
  if (fstat(out->file, &status) != 0 || status.st_size < (off_t)KERF_EXTERNAL_BYTES) {
    snprintf(why, sizeof why, "%s: too short for a page; start the controller again", path);
  } else if (!kerf_external_lives(out->file)) {
    snprintf(why, sizeof why, "%s: its controller has ended; start it again", path);
  } else if (flock(out->file, LOCK_EX | LOCK_NB) != 0) {
    snprintf(why, sizeof why,
             "%s: a program has it: another one, this one, or a fork of either; end that first",
             path);
  } else {
    void* const mapped =
        mmap(NULL, KERF_EXTERNAL_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, out->file, 0);
    out->page = mapped == MAP_FAILED ? NULL : (kerf_external_page*)mapped;
    snprintf(why, sizeof why, "%s: cannot be mapped: %s", path, strerror(errno));
  }
  if (out->page != NULL) {
    out->session = __atomic_load_n(&out->page->session, __ATOMIC_ACQUIRE);
    out->arms = out->page->arms;
    out->rate_hz = out->page->rate_hz;
    out->workspace_scale = out->page->workspace_scale;
    if (out->page->magic != KERF_EXTERNAL_MAGIC || out->page->layout != KERF_EXTERNAL_LAYOUT ||
        out->arms < 1 || out->arms > KERF_EXTERNAL_ARMS) {
      snprintf(why, sizeof why,
               "%s: no page of layout %u; compile with the header of that kerf, or start the "
               "controller again",
               path, KERF_EXTERNAL_LAYOUT);
    } else if (out->session == 0) {
      snprintf(why, sizeof why, "%s: its controller has ended; start it again", path);
    } else {
      return NULL;
    }
    munmap(out->page, KERF_EXTERNAL_BYTES);
    out->page = NULL;
  }
  close(out->file);
  out->file = -1;
  return why;
}

/* Gives the device back: the last force counts for force.stale_ms, then fades in 15 ms. A second
 * call does nothing. */
static inline void kerf_external_close(kerf_external* external) {
  if (external->page != NULL) munmap(external->page, KERF_EXTERNAL_BYTES);
  if (external->file >= 0) close(external->file);
  external->page = NULL;
  external->file = -1;
}

/* The newest tick of an arm, 0 or 1; tick 0, in the phase off, before the first one. Returns 0, and
 * does not change `out`, if the controller has ended, and for an arm that it lacks. Of a controller
 * that was killed the last tick can be read once more. It makes no system call, unless the tick is
 * the one that was read last, or the controller is stopped while it writes. */
static inline int kerf_external_read(kerf_external* external, unsigned arm, kerf_report* out) {
  kerf_external_arm* part;
  unsigned tries;
  if (external->page == NULL || arm >= external->arms ||
      __atomic_load_n(&external->page->session, __ATOMIC_ACQUIRE) != external->session) {
    return 0;
  }
  part = &external->page->arm[arm];
  for (tries = 1;; ++tries) { /* a writer that was not interrupted takes some nanoseconds */
    kerf_report report;
    const uint64_t version = __atomic_load_n(&part->report_version, __ATOMIC_ACQUIRE);
    kerf_external_load(&report, &part->report, sizeof report);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (version % 2 == 0 && __atomic_load_n(&part->report_version, __ATOMIC_RELAXED) == version) {
      if (report.tick == external->last_tick[arm] && !kerf_external_lives(external->file)) return 0;
      external->last_tick[arm] = report.tick;
      *out = report;
      return 1;
    }
    if (tries % 1024 == 0 && !kerf_external_lives(external->file)) return 0;
  }
}

/* Asks for a force, from the controller's next tick on. Returns its number, which `answers` of a
 * report will reach; numbers go on from the last program's. Returns 0 if the page is not open, and
 * for an arm that the controller lacks. It does not notice an end: kerf_external_read does. */
static inline uint64_t kerf_external_give(kerf_external* external, unsigned arm,
                                          const kerf_force* force) {
  kerf_external_arm* part;
  uint64_t version, number;
  if (external->page == NULL || arm >= external->arms) return 0;
  part = &external->page->arm[arm];
  version = __atomic_load_n(&part->force_version, __ATOMIC_RELAXED) & ~UINT64_C(1);
  number = __atomic_load_n(&part->force_number, __ATOMIC_RELAXED) + 1;
  __atomic_store_n(&part->force_version, version + 1, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_RELEASE);
  __atomic_store_n(&part->force_number, number, __ATOMIC_RELAXED);
  kerf_external_store(&part->force, force, sizeof *force);
  __atomic_store_n(&part->force_version, version + 2, __ATOMIC_RELEASE);
  return number;
}

#endif
