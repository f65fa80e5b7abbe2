// SPDX-License-Identifier: Apache-2.0
// A libHD.so for the tests of kerf-arm, from the documentation of its C interface: one arm, whose
// scheduler runs in real time or, with the word `manual`, when the test calls `kerf_mock_tick`.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include <pthread.h>
#include <sched.h>

#include "tests/arm/mock_script.hpp"

namespace {

using kerf::mock::Behaviour;
using kerf::mock::Pose;
using kerf::mock::Record;

using Callback = std::uint32_t (*)(void*);
struct ErrorInfo {  // of C, as the library's
  std::uint32_t code;
  int internal;
  std::uint32_t device;
};

constexpr std::uint32_t kNoDevice = 0xffffffff;
constexpr std::uint32_t kInvalidEnum = 0x100, kInvalidType = 0x103, kBadHandle = 0x104;
constexpr std::uint32_t kAlreadyOpen = 0x301;
[[maybe_unused]] constexpr std::uint32_t kIllegalBegin = 0x400, kIllegalEnd = 0x401,
                                         kFrameError = 0x402;

struct Entry {
  unsigned long handle = 0;
  Callback callback = nullptr;
  void* data = nullptr;
  std::uint16_t priority = 0;
};

/// The library's one state. Callbacks and frames belong to the servo thread.
struct Library {
  Behaviour behaviour;
  Record record;
  std::vector<Pose> poses = kerf::mock::read_poses({0, -110, -35});
  std::mutex mutex;  ///< of errors and callbacks
  std::vector<ErrorInfo> errors;
  std::vector<Entry> entries;
  unsigned long next_handle = 1;
  std::uint32_t current = kNoDevice;
  bool open = false, force_output = false;
  std::atomic<bool> running{false};
  std::thread servo;
  std::atomic<long> tick{0};
  bool in_frame = false;
  long framed_tick = -1;
  std::array<double, 3> force{}, last_force{};
  bool calibrated = !behaviour.has("needs_update");

  void fail(std::uint32_t code) {
    const std::lock_guard guard(mutex);
    errors.push_back({code, 0, current});
  }
  [[nodiscard]] const Pose& pose() const { return kerf::mock::pose_at(poses, tick); }

  void step() {
    ++tick;
    const long now = tick;
    if (now == behaviour.moment("error")) {
      fail(static_cast<std::uint32_t>(std::stoul(hex_of("error"), nullptr, 16)));
    }
    if (now == behaviour.number("uncalibrated", -1)) calibrated = false;
    std::vector<Entry> due;
    {
      const std::lock_guard guard(mutex);
      due = entries;
    }
    std::ranges::stable_sort(due, std::ranges::greater{}, &Entry::priority);
    for (const Entry& entry : due) {
      if (entry.callback(entry.data) != 0) continue;
      const std::lock_guard guard(mutex);
      std::erase_if(entries, [&](const Entry& one) { return one.handle == entry.handle; });
    }
    if (in_frame) record.add("frame left open");
  }

  /// The servo thread, before the call that started or filled it returns.
  void tick_at_once() {
    if (!behaviour.has("early_ticks")) return;
    std::thread([this] {
      for (int i = 0; i < 8; ++i) step();
    }).join();
  }

  void serve() {
    sched_param high{};
    high.sched_priority = 85;
    static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_FIFO, &high));
    kerf::mock::take_signals(behaviour);
    std::int64_t next_ns = kerf::monotonic_ns();
    const auto first_ms = behaviour.number("late_start", 0);
    next_ns += first_ms * 1'000'000;
    while (running) {
      next_ns = std::max(next_ns + 1'000'000, kerf::monotonic_ns() - 1'000'000);
      kerf::sleep_until_ns(next_ns);
      if (running) step();
    }
  }

 private:
  /// The digits between `name=` and '@'.
  [[nodiscard]] std::string hex_of(const char* name) const {
    const std::string words = std::getenv("KERF_MOCK");
    const auto from = words.find(std::string(name) + '=') + std::strlen(name) + 1;
    return words.substr(from, words.find('@', from) - from);
  }
};

Library& library() {
  static auto& the_library = *new Library;  // the servo thread may outlive the statics
  return the_library;
}

/// Whether an open device has that handle; else an error.
bool knows(std::uint32_t device) {
  Library& hd = library();
  if (hd.open && device == static_cast<std::uint32_t>(hd.behaviour.number("handle", 0))) {
    return true;
  }
  hd.fail(kBadHandle);
  return false;
}

template <class T>
void get_vector(std::uint32_t what, T* out) {
  Library& hd = library();
  const Pose& pose = hd.pose();
  const bool unset = hd.tick <= hd.behaviour.number("unset", 2);
  if (what == 0x2052) {  // transform, by columns
    std::fill_n(out, 16, T{0});
    if (unset) return;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        out[4 * column + row] = static_cast<T>(pose.rotation[3 * row + column]);
      }
      out[12 + row] = static_cast<T>(pose.position[row]);
    }
    out[15] = 1;
    if (hd.tick == hd.behaviour.number("nan", -1)) out[12] = std::numeric_limits<T>::quiet_NaN();
    if (hd.tick == hd.behaviour.number("hang_callback", -1)) kerf::mock::hang();
  } else if (what == 0x2050) {  // position
    for (std::size_t i = 0; i < 3; ++i) out[i] = unset ? T{0} : static_cast<T>(pose.position[i]);
  } else if (what == 0x2700) {  // force
    const auto& force = hd.in_frame ? hd.force : hd.last_force;
    for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<T>(force[i]);
  } else if (what == 0x2600 || what == 0x2601) {
    out[0] = 1000;
  } else if (what == 0x2603 || what == 0x2604) {  // nominal force, continuous force
    out[0] = static_cast<T>(what == 0x2603 ? 3.3 : 0.88);
  } else {
    hd.fail(kInvalidEnum);
  }
}

template <class T>
void set_vector(std::uint32_t what, const T* in) {
  Library& hd = library();
  if (what != 0x2700) return hd.fail(kInvalidEnum);
  if (!hd.in_frame) return hd.fail(kFrameError);
  for (std::size_t i = 0; i < 3; ++i) hd.force[i] = in[i];
}

}  // namespace

extern "C" {

// For the tests alone.
void kerf_mock_tick(int ticks) {
  for (int i = 0; i < ticks && library().running; ++i) library().step();
}
int kerf_mock_lines(const char** out, int room) {
  return library().record.give_lines(out, room);
}
void kerf_mock_pose(const double* position, const double* rotation, int buttons, int docked) {
  Pose pose{.tick = library().tick, .buttons = buttons, .docked = docked != 0};
  std::copy_n(position, 3, pose.position.begin());
  std::copy_n(rotation, 9, pose.rotation.begin());
  library().poses.push_back(pose);
}

std::uint32_t hdInitDevice(const char* name) {
  Library& hd = library();
  hd.record.add("hdInitDevice %s", name != nullptr ? name : "NULL");
  kerf::mock::take_signals(hd.behaviour);
  if (hd.behaviour.has("hang_open")) kerf::mock::hang();
  if (hd.behaviour.has("crash_open")) kerf::mock::crash();
  if (hd.behaviour.has("exit_open")) std::exit(0);
  if (hd.behaviour.has("overflow_open")) kerf::mock::overflow();
  if (hd.behaviour.has("garbage_handle")) return 0x5a5a5a5a;
  if (hd.behaviour.has("init_error")) {
    hd.fail(0x300);
    return kNoDevice;
  }
  if (hd.open) {
    hd.fail(kAlreadyOpen);
    return kNoDevice;
  }
  hd.open = true;
  hd.current = static_cast<std::uint32_t>(hd.behaviour.number("handle", 0));
  return hd.current;
}
void hdDisableDevice(std::uint32_t device) {
  Library& hd = library();
  hd.record.add("hdDisableDevice");
  if (hd.behaviour.has("crash_close")) kerf::mock::crash();
  if (hd.behaviour.has("hang_close")) kerf::mock::hang();
  if (knows(device)) hd.open = false;
}
std::uint32_t hdGetCurrentDevice() {
  return library().current;
}
void hdMakeCurrentDevice(std::uint32_t device) {
  if (knows(device)) library().current = device;
}

void hdEnable(std::uint32_t what) {
  library().record.add("hdEnable %x", what);
  if (what < 0x4000 || what > 0x4004) return library().fail(kInvalidEnum);
  if (what == 0x4000) library().force_output = true;
}
void hdDisable(std::uint32_t what) {
  library().record.add("hdDisable %x", what);
  if (what == 0x4000) library().force_output = false;
}
std::uint8_t hdIsEnabled(std::uint32_t what) {
  return what == 0x4000 && library().force_output ? 1 : 0;
}

#ifndef KERF_MOCK_LACKS_FRAMES
void hdBeginFrame(std::uint32_t device) {
  Library& hd = library();
  kerf::mock::end_process(hd.behaviour, hd.tick);
  if (!knows(device)) return;
  if (hd.in_frame || hd.framed_tick == hd.tick) return hd.fail(kIllegalBegin);
  const long gone = hd.behaviour.number("vanish", -1), back = hd.behaviour.number("back", -1);
  if (gone >= 0 && hd.tick >= gone && (back < 0 || hd.tick < back)) return hd.fail(0x302);
  hd.in_frame = true;
  hd.framed_tick = hd.tick;
  hd.force = {};  // zero at the start of each frame
}
void hdEndFrame(std::uint32_t device) {
  Library& hd = library();
  if (!knows(device)) return;
  if (!hd.in_frame || hd.tick <= hd.behaviour.number("unset", 2)) {
    hd.in_frame = false;
    return hd.fail(kIllegalEnd);
  }
  hd.in_frame = false;
  hd.last_force = hd.force_output ? hd.force : std::array<double, 3>{};
  hd.record.add("frame %ld %.6f %.6f %.6f", hd.tick.load(), hd.last_force[0], hd.last_force[1],
                hd.last_force[2]);
}
#endif

void hdGetBooleanv(std::uint32_t what, std::uint8_t* out) {
  if (what != 0x2002) return library().fail(kInvalidType);
  out[0] = library().pose().docked ? 0 : 1;  // 0 = in the inkwell
}
void hdGetIntegerv(std::uint32_t what, int* out) {
  Library& hd = library();
  if (what == 0x2000) {
    out[0] = hd.pose().buttons;
  } else if (what == 0x2555) {
    out[0] = static_cast<int>(hd.behaviour.number("style", 4));
  } else if (what == 0x2600 || what == 0x2601) {
    out[0] = 1000;
  } else {
    hd.fail(kInvalidType);
  }
}
void hdGetFloatv(std::uint32_t what, float* out) {
  get_vector(what, out);
}
void hdGetDoublev(std::uint32_t what, double* out) {
  get_vector(what, out);
}
void hdSetFloatv(std::uint32_t what, const float* in) {
  set_vector(what, in);
}
void hdSetDoublev(std::uint32_t what, const double* in) {
  set_vector(what, in);
}
const char* hdGetString(std::uint32_t what) {
  switch (what) {
    case 0x2500:
      return library().behaviour.has("null_strings") ? nullptr : "mock 3.0";
    case 0x2501:
      return library().behaviour.has("null_strings") ? nullptr : "mock arm";
    case 0x2502:
    case 0x2503:
    case 0x2504:
      return "mock";
    default:
      library().fail(kInvalidEnum);
      return nullptr;
  }
}

const char* hdGetErrorString(std::uint32_t code) {
  return code == 0x302 ? "communication error of the mock" : "error of the mock";
}
ErrorInfo hdGetError() {
  Library& hd = library();
  const std::lock_guard guard(hd.mutex);
  if (hd.errors.empty()) return {};
  const ErrorInfo newest = hd.errors.back();
  hd.errors.pop_back();
  return newest;
}

std::uint32_t hdCheckCalibration() {
  return library().calibrated ? 0x5000 : 0x5001;
}
void hdUpdateCalibration(std::uint32_t style) {
  Library& hd = library();
  hd.record.add("hdUpdateCalibration %u%s", style, hd.pose().docked ? "" : " undocked");
  if (style == 4 && hd.pose().docked && hd.running) hd.calibrated = true;
}

void hdStartScheduler() {
  Library& hd = library();
  hd.record.add("hdStartScheduler");
  if (hd.behaviour.has("hang_start")) kerf::mock::hang();
  if (hd.behaviour.has("start_error")) hd.fail(0x304);
  hd.tick_at_once();
  if (hd.behaviour.has("start_error")) return;
  hd.running = true;
  if (!hd.behaviour.has("manual") && !hd.behaviour.has("no_ticks")) {
    hd.servo = std::thread([&hd] { hd.serve(); });
  }
}
void hdStopScheduler() {
  Library& hd = library();
  hd.record.add("hdStopScheduler");
  if (hd.behaviour.has("hang_stop")) kerf::mock::hang();
  hd.running = false;
  if (hd.servo.joinable()) hd.servo.join();
}
void hdSetSchedulerRate(unsigned long hz) {
  library().record.add("hdSetSchedulerRate %lu", hz);
  if (hz != 500 && hz != 1000 && hz != 1600) library().fail(0x101);
}
unsigned long hdScheduleAsynchronous(Callback callback, void* data, std::uint16_t priority) {
  Library& hd = library();
  hd.record.add("hdScheduleAsynchronous %x", priority);
  {
    const std::lock_guard guard(hd.mutex);
    hd.entries.push_back({hd.next_handle, callback, data, priority});
  }
  if (hd.behaviour.has("schedule_error")) hd.fail(0x501);
  hd.tick_at_once();
  return hd.next_handle++;
}
void hdScheduleSynchronous(Callback callback, void* data, std::uint16_t) {
  while (callback(data) != 0) {
  }
}
void hdUnschedule(unsigned long handle) {
  Library& hd = library();
  hd.record.add("hdUnschedule");
  const std::lock_guard guard(hd.mutex);
  std::erase_if(hd.entries, [&](const Entry& one) { return one.handle == handle; });
}
std::uint8_t hdWaitForCompletion(unsigned long handle, std::uint32_t) {
  Library& hd = library();
  const std::lock_guard guard(hd.mutex);
  return std::ranges::count(hd.entries, handle, &Entry::handle) > 0 ? 1 : 0;
}

}  // extern "C"
