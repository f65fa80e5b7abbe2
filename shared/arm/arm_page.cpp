// SPDX-License-Identifier: Apache-2.0
#include "shared/arm/arm_page.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/seqlock.hpp"

namespace kerf {
namespace {

using namespace arm_page;

constexpr std::uint64_t kMagic = 0x3167706d72616b;  // "karmpg1"
constexpr std::uint32_t kLayout = 2;

constexpr std::size_t kAtMagic = 0, kAtLayout = 8, kAtDevice = 12, kAtRate = 16, kAtLockstep = 20;
constexpr std::size_t kAtSession = 64, kAtProcess = 72, kAtBell = 96, kAtSleeps = 100;
constexpr std::size_t kAtStatus = 128, kAtState = 136, kAtText = 144;
constexpr std::size_t kAtHead = 256;
constexpr std::size_t kAtCommands = 320, kPlaceBytes = 64;
constexpr std::size_t kAtReports = 4096;

struct ReportRecord {
  std::uint64_t version = 0;
  std::int64_t at_ns = 0;
  cartesian::ReportBytes packet{};
  std::array<std::byte, 8> spare{};
};
static_assert(sizeof(ReportRecord) == 64);
static_assert(kAtReports + kReports * sizeof(ReportRecord) == kBytes);

/// A command after the version of its place. Ticket 0: none.
struct CommandRecord {
  std::uint64_t ticket = 0;
  std::int64_t at_ns = 0;
  cartesian::CommandBytes packet{};
};
static_assert(sizeof(CommandRecord) % 8 == 0 && 8 + sizeof(CommandRecord) <= kPlaceBytes);

// Locks of single bytes, which end with the open file, unlike those of a process.
constexpr off_t kAdapterByte = 0, kControllerByte = 1;

struct flock lock_of(off_t byte) noexcept {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = byte;
  lock.l_len = 1;
  return lock;
}

bool take_lock(int file, off_t byte) noexcept {
  struct flock lock = lock_of(byte);
  return fcntl(file, F_OFD_SETLK, &lock) == 0;
}

bool is_locked_by_another(int file, off_t byte) noexcept {
  struct flock lock = lock_of(byte);
  return fcntl(file, F_OFD_GETLK, &lock) != 0 || lock.l_type != F_UNLCK;
}

ArmPageError failure(const std::string& path) {
  const int error = errno;
  return ArmPageError(path + ": " + system_message(error) + "; " +
                      remedy_for(error, "remove the file, or make the folder writable"));
}

// The bell, between processes. The order of all its words is that of one thread: either the
// controller sees that the adapter sleeps, or the kernel that the bell has rung since.

void sleep_at(std::byte* bell, std::uint32_t seen, std::int64_t until_ns) noexcept {
  const timespec until{until_ns / kNsPerSecond, until_ns % kNsPerSecond};
  syscall(SYS_futex, bell, FUTEX_WAIT_BITSET, seen, &until, nullptr, FUTEX_BITSET_MATCH_ANY);
}
void ring(std::byte* bell, std::byte* sleeps) noexcept {
  shared_words::word<std::uint32_t>(bell).fetch_add(1);
  if (shared_words::word<std::uint32_t>(sleeps).load() == 0) return;
  const int error = errno;  // of the code that a signal handler has interrupted
  syscall(SYS_futex, bell, FUTEX_WAKE, 1, nullptr, nullptr, 0);
  errno = error;
}

/// The process of the adapter by the file, which may hold anything.
std::string process_of(int file) {
  std::uint64_t process = 0;
  const bool is_read = pread(file, &process, sizeof process, kAtProcess) == sizeof process;
  return is_read ? std::to_string(process) : "?";
}

}  // namespace

std::string ArmPage::path_of(std::string_view name) {
  try {
    const std::string socket = segment_socket(name);  // checks the name
    return socket.substr(0, socket.rfind('/')) + "/arm-" + std::string(name) + ".page";
  } catch (const SegmentError& error) {
    throw ArmPageError(error.what());
  }
}

std::vector<std::string> running_arms() {
  constexpr std::string_view kBegin = "arm-", kEnd = ".page";
  std::vector<std::string> names;
  std::error_code error;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(segment_folder(), error)) {
      const std::string file = entry.path().filename().string();
      if (!file.starts_with(kBegin) || !file.ends_with(kEnd)) continue;
      const OwnedFd page(open(entry.path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
      if (page.get() < 0 || !is_locked_by_another(page.get(), kAdapterByte)) continue;
      names.push_back(file.substr(kBegin.size(), file.size() - kBegin.size() - kEnd.size()));
    }
  } catch (const SegmentError&) {
    return {};
  }
  std::ranges::sort(names);
  return names;
}

void ArmPage::map() {
  void* const mapped =
      mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file_.get(), 0);
  if (mapped == MAP_FAILED) throw failure(path_);
  bytes_ = static_cast<std::byte*>(mapped);
}

ArmPage::~ArmPage() {
  if (bytes_ != nullptr) munmap(bytes_, kBytes);
}

// The adapter's side.

ArmPageAdapter::ArmPageAdapter(const std::string& name, Personality device, int rate_hz)
    : ArmPage(path_of(name)) {
  for (;;) {
    file_ = OwnedFd(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (file_.get() < 0) throw failure(path_);
    if (!take_lock(file_.get(), kAdapterByte)) {
      throw ArmPageError("--name " + name + ": in use by process " + process_of(file_.get()) +
                         "; stop that kerf-arm, or choose another name");
    }
    // The last adapter may have removed the file between our open and our lock.
    struct stat ours {};
    struct stat named {};
    if (fstat(file_.get(), &ours) == 0 && stat(path_.c_str(), &named) == 0 &&
        ours.st_ino == named.st_ino && ours.st_dev == named.st_dev) {
      break;
    }
  }
  // A full disk is an error here, in place of a SIGBUS at the first report.
  errno = posix_fallocate(file_.get(), 0, kBytes);
  if (errno != 0) throw failure(path_);
  map();
  // For a controller that still has the page of a dead adapter, its session ends here.
  using shared_words::word;
  word(at(kAtSession)).store(0);
  const std::array<std::byte, kBytes> zeros{};
  shared_words::store(at(kAtProcess), zeros.data(), kBytes - kAtProcess);
  word(at(kAtMagic)).store(kMagic);
  word<std::uint32_t>(at(kAtLayout)).store(kLayout);
  word<std::uint32_t>(at(kAtDevice)).store(static_cast<std::uint32_t>(device));
  word<std::uint32_t>(at(kAtRate)).store(static_cast<std::uint32_t>(rate_hz));
  word(at(kAtProcess)).store(static_cast<std::uint64_t>(getpid()));
  word(at(kAtSession)).store(random_session_id());
}

ArmPageAdapter::~ArmPageAdapter() {
  set_state(ArmState::closing, "kerf-arm has ended");
  unlink(path_.c_str());
}

void ArmPageAdapter::set_state(ArmState state, std::string_view text) noexcept {
  const auto word = shared_words::word(at(kAtState));
  std::uint64_t before = word.load();
  do {
    if (before >= static_cast<std::uint64_t>(ArmState::closing) &&
        before >= static_cast<std::uint64_t>(state)) {
      return;
    }
  } while (!word.compare_exchange_weak(before, static_cast<std::uint64_t>(state)));
  if (writes_text_.test_and_set()) return;
  std::array<char, kTextBytes> line{};
  std::copy_n(text.begin(), std::min(text.size(), line.size() - 1), line.begin());
  std::byte* const version = at(kAtStatus);
  const std::uint64_t even = shared_words::word(version).load();
  shared_words::open(version, even + 1);
  shared_words::store(at(kAtText), line.data(), line.size());
  shared_words::close(version, even + 2);
  writes_text_.clear();
}

void ArmPageAdapter::publish(CartesianReport report, std::int64_t now_ns) noexcept {
  report.number = static_cast<std::uint32_t>(published_ + 1);
  ReportRecord record;
  record.at_ns = now_ns;
  record.packet = encode(report);
  std::byte* const slot = at(kAtReports + published_ % kReports * sizeof(ReportRecord));
  shared_words::open(slot, 2 * published_ + 1);
  shared_words::store(slot + 8, reinterpret_cast<const std::byte*>(&record) + 8, sizeof record - 8);
  shared_words::close(slot, 2 * published_ + 2);
  shared_words::word(at(kAtHead)).store(++published_, std::memory_order_release);
}

std::optional<TimedCommand> ArmPageAdapter::newest() const noexcept {
  constexpr int kTries = 4;
  CommandRecord newest;
  for (std::size_t place = 0; place < kCommands; ++place) {
    std::byte* const version = at(kAtCommands + place * kPlaceBytes);
    for (int tries = 0; tries < kTries; ++tries) {
      const std::uint64_t seen = shared_words::word(version).load(std::memory_order_acquire);
      if (seen % 2 != 0) break;  // in hand: the command before it lies in another place
      CommandRecord record;
      shared_words::load(&record, version + 8, sizeof record);
      if (!shared_words::unchanged(version, seen)) continue;
      if (record.ticket > newest.ticket) newest = record;
      break;
    }
  }
  if (newest.ticket == 0) return std::nullopt;
  const auto command = decode_cartesian_command(newest.packet);
  if (!command) return std::nullopt;
  return TimedCommand{*command, newest.at_ns, newest.ticket};
}

bool ArmPageAdapter::await_command(std::uint64_t ticket, std::int64_t until_ns) const noexcept {
  const auto has_come = [&] {
    const auto command = newest();
    return (command ? command->ticket : 0) != ticket;
  };
  using shared_words::word;
  for (;;) {
    const std::uint32_t seen = word<std::uint32_t>(at(kAtBell)).load();
    if (has_come()) return true;
    if (monotonic_ns() >= until_ns) return false;
    word<std::uint32_t>(at(kAtSleeps)).store(1);
    sleep_at(at(kAtBell), seen, until_ns);
    word<std::uint32_t>(at(kAtSleeps)).store(0);
  }
}

void ArmPageAdapter::set_lockstep(int rate_hz) noexcept {
  using shared_words::word;
  word<std::uint32_t>(at(kAtRate)).store(static_cast<std::uint32_t>(rate_hz));
  word<std::uint32_t>(at(kAtLockstep)).store(1);
}

bool ArmPageAdapter::has_controller() const noexcept {
  return is_locked_by_another(file_.get(), kControllerByte);
}

// The controller's side.

namespace {

/// Throws ArmPageError if the page has another layout or belongs to another device.
void check_session(std::byte* page, const std::string& path, const std::string& name,
                   Personality device) {
  using shared_words::word;
  const auto found = word<std::uint32_t>(page + kAtDevice).load();
  if (word(page + kAtMagic).load() != kMagic ||
      word<std::uint32_t>(page + kAtLayout).load() != kLayout ||
      found >= kPersonalityWords.size()) {
    throw ArmPageError(path + ": of another version; start the kerf-arm of this one");
  }
  if (found == static_cast<std::uint32_t>(device)) return;
  const std::string theirs(kPersonalityWords[found]);
  throw ArmPageError("the kerf-arm named " + name + " is of a " + theirs +
                     ", and the controller wants a " + std::string(word_of(device)) +
                     "; take --device " + theirs + ", or another name");
}

/// Clears all commands, also half-written ones, that a killed controller left.
void empty_commands(std::byte* commands) noexcept {
  const CommandRecord none;
  for (std::size_t place = 0; place < kCommands; ++place) {
    std::byte* const version = commands + place * kPlaceBytes;
    const std::uint64_t odd = (shared_words::word(version).load() | 1) + 2;
    shared_words::open(version, odd);
    shared_words::store(version + 8, &none, sizeof none);
    shared_words::close(version, odd + 1);
  }
}

}  // namespace

std::unique_ptr<ArmPageController> ArmPageController::open(const std::string& name,
                                                           Personality device, Absence& absence,
                                                           std::string& text) {
  std::unique_ptr<ArmPageController> page(new ArmPageController(path_of(name)));
  absence = Absence::no_adapter;
  text.clear();
  page->file_ = OwnedFd(::open(page->path_.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
  if (page->file_.get() < 0) {
    if (errno == ENOENT) return nullptr;
    throw failure(page->path_);
  }
  struct stat status {};
  if (fstat(page->file_.get(), &status) != 0) throw failure(page->path_);
  if (!S_ISREG(status.st_mode) || status.st_uid != geteuid()) {
    throw ArmPageError(page->path_ + ": not a file of yours; remove it");
  }
  if (status.st_size < static_cast<off_t>(kBytes) ||
      !is_locked_by_another(page->file_.get(), kAdapterByte)) {
    return nullptr;
  }
  page->map();
  using shared_words::word;
  page->session_ = word(page->at(kAtSession)).load();
  absence = Absence::starting;
  if (page->session_ == 0) return nullptr;
  check_session(page->at(0), page->path_, name, device);
  const ArmStatus now = page->status();
  text = now.text.data();
  if (now.state == ArmState::starting) return nullptr;
  absence = Absence::over;
  if (page->over()) return nullptr;
  if (!take_lock(page->file_.get(), kControllerByte)) {
    throw ArmPageError("the kerf-arm named " + name +
                       " serves another controller; stop that one, or name another");
  }
  empty_commands(page->at(kAtCommands));
  page->hello_ = {device, word<std::uint32_t>(page->at(kAtLockstep)).load() != 0,
                  static_cast<int>(word<std::uint32_t>(page->at(kAtRate)).load())};
  page->taken_ = word(page->at(kAtHead)).load(std::memory_order_acquire);
  // In lock-step none comes before a command, and the first tick needs one.
  if (page->hello_.lockstep && page->taken_ > 0) --page->taken_;
  return page;
}

bool ArmPageController::waits() const noexcept {
  return shared_words::word(at(kAtHead)).load(std::memory_order_acquire) != taken_;
}

bool ArmPageController::take(cartesian::ReportBytes& packet) noexcept {
  // One less than the ring holds: the adapter may be writing over the oldest.
  constexpr std::uint64_t kMost = kReports - 1;
  const std::uint64_t head = shared_words::word(at(kAtHead)).load(std::memory_order_acquire);
  if (head < taken_) taken_ = head;
  if (head - taken_ > kMost) {
    overrun_ += head - taken_ - kMost;
    taken_ = head - kMost;
  }
  while (taken_ < head) {
    std::byte* const slot = at(kAtReports + taken_ % kReports * sizeof(ReportRecord));
    const std::uint64_t wanted = 2 * taken_ + 2;
    ++taken_;
    if (shared_words::word(slot).load(std::memory_order_acquire) == wanted) {
      ReportRecord record;
      shared_words::load(reinterpret_cast<std::byte*>(&record) + 8, slot + 8, sizeof record - 8);
      if (shared_words::unchanged(slot, wanted)) {
        packet = record.packet;
        return true;
      }
    }
    ++overrun_;
  }
  return false;
}

bool ArmPageController::send(const cartesian::CommandBytes& packet, std::int64_t now_ns) noexcept {
  // Taken first: what was decided later has the higher ticket, whoever writes faster.
  const std::uint64_t ticket = next_ticket_.fetch_add(1);
  const CommandRecord record{ticket, now_ns, packet};
  for (std::size_t tries = 0; tries < kCommands; ++tries) {
    std::byte* const version = at(kAtCommands + (ticket + tries) % kCommands * kPlaceBytes);
    const auto word = shared_words::word(version);
    std::uint64_t seen = word.load(std::memory_order_relaxed);
    if (seen % 2 != 0 || !word.compare_exchange_strong(seen, seen + 1, std::memory_order_acquire)) {
      continue;
    }
    shared_words::fence(std::memory_order_release);
    // An interrupted thread may come here late, where a newer command lies by now.
    const bool is_newest = shared_words::word(version + 8).load() < ticket;
    if (is_newest) shared_words::store(version + 8, &record, sizeof record);
    shared_words::close(version, seen + 2);
    ring(at(kAtBell), at(kAtSleeps));
    return true;
  }
  return false;
}

bool ArmPageController::over() const noexcept {
  return shared_words::word(at(kAtSession)).load(std::memory_order_relaxed) != session_ ||
         shared_words::word(at(kAtState)).load(std::memory_order_relaxed) >=
             static_cast<std::uint64_t>(ArmState::closing);
}

ArmStatus ArmPageController::status() const noexcept {
  constexpr int kTries = 4;
  ArmStatus status;
  const std::uint64_t state = shared_words::word(at(kAtState)).load();
  status.state = state < kArmStateWords.size() ? static_cast<ArmState>(state) : ArmState::failed;
  for (int tries = 0; tries < kTries; ++tries) {
    const std::uint64_t seen = shared_words::word(at(kAtStatus)).load(std::memory_order_acquire);
    if (seen % 2 != 0) continue;
    shared_words::load(status.text.data(), at(kAtText), status.text.size());
    if (shared_words::unchanged(at(kAtStatus), seen)) break;
  }
  status.text.back() = 0;
  return status;
}

}  // namespace kerf
