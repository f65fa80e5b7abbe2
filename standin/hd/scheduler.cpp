// SPDX-License-Identifier: Apache-2.0
#include "standin/hd/scheduler.hpp"

#include <algorithm>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/threads.hpp"

namespace kerf::hd {

using standin::Row;

bool Scheduler::is_servo_thread() const noexcept {
  return servo_.load(std::memory_order_relaxed) == std::this_thread::get_id();
}

void Scheduler::start(bool lockstep, int rate_hz, int priority) {
  if (is_servo_thread()) return;
  const std::lock_guard lock(starts_);
  if (runs()) return;
  if (thread_.joinable()) thread_.join();  // stopped by a callback of its own
  ends_ = false;
  runs_ = true;
  thread_ = std::thread([this, lockstep, rate_hz, priority] {
    if (!lockstep && priority > 0) static_cast<void>(set_fifo(priority));  // late ticks are counted
    serve(lockstep, rate_hz);
  });
}

void Scheduler::finish_stop() {
  if (is_servo_thread()) return;
  const std::lock_guard lock(starts_);
  if (ends_ && thread_.joinable()) thread_.join();
}

void Scheduler::stop() {
  std::unique_lock starts(starts_, std::defer_lock);
  if (!is_servo_thread()) starts.lock();
  {
    const std::lock_guard lock(mutex_);  // or the servo thread could miss it before it waits
    ends_ = true;
  }
  changed_.notify_all();
  if (starts && thread_.joinable()) thread_.join();
}

void Scheduler::serve(bool lockstep, int rate_hz) {
  servo_ = std::this_thread::get_id();
  const std::int64_t period_ns = kNsPerSecond / rate_hz;
  std::int64_t deadline_ns = monotonic_ns();
  std::int64_t last_ns = 0;
  while (!ends_) {
    if (lockstep) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ends_ || !entries_.empty(); });
      if (ends_) break;
    } else {
      deadline_ns += period_ns;
      sleep_until_ns(deadline_ns);
      const std::int64_t missed =
          std::max<std::int64_t>(monotonic_ns() - deadline_ns, 0) / period_ns;
      ledger_.add(Row::missed_ticks, static_cast<std::uint64_t>(missed));
      deadline_ns += missed * period_ns;
    }
    const std::int64_t now_ns = monotonic_ns();
    if (last_ns != 0 && !lockstep) ledger_.record_period_us((now_ns - last_ns) / 1000);
    last_ns = now_ns;
    tick_began_ns_ = now_ns;
    ledger_.add(Row::ticks);
    tick_.begin();
    run_callbacks();
    tick_.end();
  }
  runs_ = false;
  servo_ = std::thread::id{};
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
}

void Scheduler::run_callbacks() {
  std::unique_lock lock(mutex_);
  // A callback may add and remove others, so the list is walked by handle.
  due_.clear();
  for (const Entry& entry : entries_) due_.push_back(entry.handle);
  for (const Ulong handle : due_) {
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const Entry& entry) { return entry.handle == handle; });
    if (found == entries_.end()) continue;
    const Entry entry = *found;
    running_ = handle;
    lock.unlock();
    const std::int64_t began_ns = monotonic_ns();
    const Uint result = entry.callback(entry.data);
    const std::int64_t took_us = (monotonic_ns() - began_ns) / 1000;
    ledger_.raise_to(Row::longest_us, static_cast<double>(took_us));
    if (took_us > stall_us_) ledger_.add(Row::stalls);
    lock.lock();
    running_ = 0;
    if (result == kDone) erase(handle);
    changed_.notify_all();
  }
}

Ulong Scheduler::add(Callback callback, void* data, std::uint16_t priority) {
  const std::lock_guard lock(mutex_);
  if (entries_.size() >= kMostCallbacks) return 0;
  const auto lower = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.priority < priority; });
  const Ulong handle = next_handle_++;
  entries_.insert(lower, {handle, callback, data, priority});
  changed_.notify_all();
  return handle;
}

void Scheduler::run_here(Callback callback, void* data) {
  const bool in_tick = is_servo_thread();
  for (Uint result = kDone + 1; result != kDone;) {
    if (!in_tick) tick_.begin();
    result = callback(data);
    if (!in_tick) tick_.end();
  }
}

bool Scheduler::run_there(Callback callback, void* data, std::uint16_t priority) {
  const Ulong handle = add(callback, data, priority);
  if (handle == 0) return false;
  std::unique_lock lock(mutex_);
  wait(lock, handle);
  erase(handle);
  return true;
}

bool Scheduler::remove(Ulong handle) {
  std::unique_lock lock(mutex_);
  if (!contains(handle)) return false;
  erase(handle);
  if (!is_servo_thread()) changed_.wait(lock, [&] { return running_ != handle; });
  changed_.notify_all();
  return true;
}

bool Scheduler::has(Ulong handle) {
  const std::lock_guard lock(mutex_);
  return contains(handle);
}

void Scheduler::wait(Ulong handle) {
  std::unique_lock lock(mutex_);
  wait(lock, handle);
}

void Scheduler::wait(std::unique_lock<std::mutex>& lock, Ulong handle) {
  changed_.wait(lock, [&] { return !contains(handle) || !runs(); });
}

double Scheduler::since_tick_s() const noexcept {
  const std::int64_t began_ns = tick_began_ns_;
  return began_ns == 0 ? 0 : static_cast<double>(monotonic_ns() - began_ns) / kNsPerSecond;
}

bool Scheduler::contains(Ulong handle) const noexcept {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.handle == handle; });
}

void Scheduler::erase(Ulong handle) noexcept {
  std::erase_if(entries_, [&](const Entry& entry) { return entry.handle == handle; });
}

}  // namespace kerf::hd
