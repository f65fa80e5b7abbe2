// SPDX-License-Identifier: Apache-2.0
#include "standin/ledger.hpp"

#include <algorithm>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace kerf::standin {
namespace {

constexpr std::array<std::string_view, kRows> kNames{
    "opened",        "closed",           "ticks",          "missed_ticks", "commands",
    "frames",        "frames_not_ended", "begins_refused", "ends_refused", "set_outside_frame",
    "bad_handles",   "bad_schedules",    "not_finite",     "output_off",   "before_enable",
    "after_trip",    "not_cleared",      "stalls",         "excess",       "impulses",
    "too_fast",      "lost_link",        "watchdog",       "in_use",       "warm",
    "square_sum_n2", "peak_n",           "last_n",         "longest_us",   "longest_period_us"};

constexpr bool is_number(Row row) noexcept {
  return row >= Row::square_sum_n2;
}

/// Maps the file with at least `bytes`; nothing if the system refuses.
void* mapped(const std::string& path, std::size_t bytes) noexcept {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return nullptr;
  struct stat status {};
  const bool has_room = fstat(fd, &status) == 0 && (status.st_size >= static_cast<off_t>(bytes) ||
                                                    ftruncate(fd, static_cast<off_t>(bytes)) == 0);
  void* page =
      has_room ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
  close(fd);
  return page == MAP_FAILED ? nullptr : page;
}

}  // namespace

std::string_view name_of(Row row) noexcept {
  return kNames[static_cast<std::size_t>(row)];
}

Ledger::Ledger(const std::string& path) noexcept {
  if (!path.empty()) {
    if (void* page = mapped(path, sizeof(Page))) page_ = static_cast<Page*>(page);
  }
  // Two programs that begin at once write the same bytes here.
  constexpr std::string_view kMagic = "kerfldg1";
  std::copy(kMagic.begin(), kMagic.end(), page_->magic.begin());
  page_->rows = static_cast<std::uint32_t>(kRows);
  page_->buckets = static_cast<std::uint32_t>(kBuckets);
  for (std::size_t i = 0; i < kRows; ++i) {
    std::copy(kNames[i].begin(), kNames[i].end(), page_->lines[i].name.begin());
    page_->lines[i].kind = is_number(static_cast<Row>(i)) ? 'd' : 'u';
  }
}

void Ledger::sum(Row row, double value) noexcept {
  const auto sum = word(row);
  std::uint64_t old = sum.load(std::memory_order_relaxed);
  while (!sum.compare_exchange_weak(
      old, std::bit_cast<std::uint64_t>(std::bit_cast<double>(old) + value),
      std::memory_order_relaxed)) {
  }
}

void Ledger::raise_to(Row row, double value) noexcept {
  const auto most = word(row);
  std::uint64_t old = most.load(std::memory_order_relaxed);
  while (std::bit_cast<double>(old) < value &&
         !most.compare_exchange_weak(old, std::bit_cast<std::uint64_t>(value),
                                     std::memory_order_relaxed)) {
  }
}

void Ledger::record_period_us(std::int64_t us) noexcept {
  const auto bucket =
      std::min(static_cast<std::size_t>(std::max<std::int64_t>(us, 0) / kBucketUs), kBuckets - 1);
  std::atomic_ref(page_->periods[bucket]).fetch_add(1, std::memory_order_relaxed);
  raise_to(Row::longest_period_us, static_cast<double>(us));
}

void Ledger::record_force_n(double force_n) noexcept {
  add(Row::commands);
  sum(Row::square_sum_n2, force_n * force_n);
  raise_to(Row::peak_n, force_n);
}

std::uint64_t Ledger::count(Row row) const noexcept {
  return word(row).load(std::memory_order_relaxed);
}

}  // namespace kerf::standin
