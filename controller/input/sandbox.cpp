// SPDX-License-Identifier: Apache-2.0
#include "controller/input/sandbox.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <exception>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/input/load_error.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/posix/program.hpp"
#include "shared/text/text.hpp"

namespace kerf {

SharedBytes::SharedBytes(int file, std::size_t size) {
  if (size == 0) return;  // nothing can be mapped then
  void* at = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (at == MAP_FAILED) throw std::bad_alloc();
  bytes_ = {static_cast<std::byte*>(at), size};
}

SharedBytes::SharedBytes(SharedBytes&& other) noexcept : bytes_(other.release()) {}

SharedBytes& SharedBytes::operator=(SharedBytes&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  return *this;
}

SharedBytes::~SharedBytes() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

std::span<std::byte> SharedBytes::release() noexcept {
  return std::exchange(bytes_, {});
}

void SandboxReader::say(SandboxWord word, std::string_view text) {
  std::array<char, kLongestSandboxWord> packet;
  packet[0] = static_cast<char>(word);
  const std::size_t length = std::min(text.size(), packet.size() - 1);
  std::copy_n(text.begin(), length, packet.begin() + 1);
  if (::write(channel_, packet.data(), length + 1) < 0) ::_exit(1);  // the parent is gone
}

std::span<std::byte> SandboxReader::offer(std::span<const std::byte> header) {
  if (header.size() >= kLongestSandboxWord) throw std::length_error("a header of that size");
  say(SandboxWord::offer, {reinterpret_cast<const char*>(header.data()), header.size()});
  std::uint64_t size = 0;
  if (::read(channel_, &size, sizeof size) != sizeof size) ::_exit(1);
  return SharedBytes(memory_, size).release();
}

namespace {

constexpr const char* kOtherFile = "; copy the file again, or save it as another kind";

class File {
 public:
  explicit File(int number = -1) : number_(number) {}
  File(File&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~File() { close(); }
  void close() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

std::uint64_t memory_before_offer(const SandboxJob& job) {
  return kSandboxBytes + 2 * job.file_bytes;
}

/// The child process, from fork to exit.
[[noreturn]] void live(const SandboxJob& job, pid_t parent, int channel, int memory,
                       const std::function<void(SandboxReader&)>& read) noexcept {
  SandboxReader reader(channel, memory);
  try {
    drop_inheritance(parent, channel, memory);
    reader = SandboxReader(kSandboxChannel, kSandboxMemory);
    drop_rights(memory_before_offer(job), job.cpu_s);
    read(reader);
    reader.say(SandboxWord::done);
  } catch (const std::bad_alloc&) {
    reader.say(SandboxWord::no_memory);
  } catch (const LoadError& error) {
    reader.say(SandboxWord::refused, error.what());
  } catch (const std::exception& error) {
    reader.say(SandboxWord::refused, job.location + ": " + error.what());
  } catch (...) {
    reader.say(SandboxWord::refused, job.location + ": cannot be read" + kOtherFile);
  }
  ::_exit(0);  // without destructors and buffers, which belong to the parent
}

/// One child process as the parent sees it: forked here, ended with the object at the latest.
class Child {
 public:
  Child(const SandboxJob& job, const std::function<void(SandboxReader&)>& read)
      : job_(job), location_(job.location) {
    std::array<int, 2> ends{-1, -1};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) no_process();
    channel_ = File(ends[0]);
    const File other(ends[1]);
    memory_ = File(::memfd_create("kerf-read", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (memory_.get() < 0) no_process();
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ < 0) no_process();
    if (pid_ == 0) live(job, parent, other.get(), memory_.get(), read);
    last_work_ns_ = began_ns_;
  }
  ~Child() {
    if (pid_ > 0) static_cast<void>(end());
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  SharedBytes result(const std::function<std::size_t(std::span<const std::byte>)>& accept) {
    for (;;) {
      constexpr int kLookMs = 100;
      pollfd wait{channel_.get(), POLLIN, 0};
      if (::poll(&wait, 1, kLookMs) > 0) {
        if (take(accept)) break;
      } else {
        look();
      }
    }
    static_cast<void>(end());  // from here on no other process writes there
    if (!size_) refuse(": the reader of " + job_.kind + " gave nothing" + kOtherFile);
    return SharedBytes(memory_.get(), *size_);
  }

 private:
  [[noreturn]] void refuse(const std::string& text) const { throw LoadError(location_ + text); }

  [[noreturn]] void no_process() const {
    refuse(": no process to read it in (" + std::generic_category().message(errno) +
           "); end other programs, or raise `ulimit -u` and `ulimit -n`");
  }

  /// Ends the child if it still runs; returns the signal that ended it, or 0.
  int end() {
    ::kill(pid_, SIGKILL);
    int status = 0;
    pid_t ended = -1;
    do {
      ended = ::waitpid(pid_, &status, 0);
    } while (ended < 0 && errno == EINTR);
    pid_ = -1;
    return ended > 0 && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }

  /// Handles one packet of the child; true after the last.
  bool take(const std::function<std::size_t(std::span<const std::byte>)>& accept) {
    std::array<std::byte, kLongestSandboxWord> packet;
    const ssize_t got = ::recv(channel_.get(), packet.data(), packet.size(), 0);
    if (got <= 0) ended_early();
    const auto body =
        std::span<const std::byte>(packet).subspan(1, static_cast<std::size_t>(got) - 1);
    const std::string text = escaped({reinterpret_cast<const char*>(body.data()), body.size()});
    switch (static_cast<SandboxWord>(packet[0])) {
      case SandboxWord::at:
        location_ = text;
        return false;
      case SandboxWord::offer:
        if (size_) break;
        grant(accept(body));
        return false;
      case SandboxWord::done:
        return true;
      case SandboxWord::refused:
        throw LoadError(text);
      case SandboxWord::no_memory:
        no_memory();
    }
    refuse(": the reader of " + job_.kind + " says what none says" + kOtherFile);
  }

  /// Gives the memory its size, for good, and sends that to the child.
  void grant(std::size_t size) {
    constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
    if (::ftruncate(memory_.get(), static_cast<off_t>(size)) != 0 ||
        ::fcntl(memory_.get(), F_ADD_SEALS, kSeals) != 0) {
      const int error = errno;
      refuse(": no " + std::to_string((size >> 20) + 1) + " MiB of memory for it (" +
             std::generic_category().message(error) + "); " +
             remedy_for(error, "crop or resample it first"));
    }
    size_ = size;
    raise_memory(pid_, 2 * size);
    const std::uint64_t told = size;
    static_cast<void>(::send(channel_.get(), &told, sizeof told, MSG_NOSIGNAL));  // it may be gone
  }

  [[noreturn]] void no_memory() const {
    const std::uint64_t bytes = memory_before_offer(job_) + 2 * size_.value_or(0);
    refuse(": reading it takes more than " + std::to_string(bytes >> 20) +
           " MiB of memory (the file is broken?)" + kOtherFile);
  }

  [[noreturn]] void ended_early() {
    const int signal = end();
    if (signal == SIGXCPU) {
      refuse(": reading it takes more than " + std::to_string(job_.cpu_s) +
             " s of CPU time (the file is broken?); allow more with --read-seconds");
    }
    const char* name = sigabbrev_np(signal);
    const std::string how = signal == 0       ? "without a word"
                            : name == nullptr ? "with signal " + std::to_string(signal)
                                              : "with SIG" + std::string(name);
    refuse(": the reader of " + job_.kind + " ended " + how + " (the file is broken?)" +
           kOtherFile);
  }

  /// While no packet comes: signals, CPU time, progress.
  void look() {
    end_if_asked(location_);
    const std::int64_t now_ns = monotonic_ns();
    timespec cpu{};
    clockid_t clock{};
    if (::clock_getcpuclockid(pid_, &clock) == 0 && ::clock_gettime(clock, &cpu) == 0) {
      const std::int64_t work_ns = std::int64_t{cpu.tv_sec} * kNsPerSecond + cpu.tv_nsec;
      if (std::exchange(work_ns_, work_ns) != work_ns) last_work_ns_ = now_ns;
    }
    if (now_ns - last_work_ns_ > job_.cpu_s * kNsPerSecond) {
      refuse(": its reader waits for more than " + std::to_string(job_.cpu_s) +
             " s; copy the file to a disk of this machine");
    }
    constexpr std::int64_t kQuickNs = 2 * kNsPerSecond;
    if (now_ns - began_ns_ < kQuickNs) return;
    if (!bar_) bar_.emplace(true);
    bar_->show(share(), "reading " + location_);
  }

  /// Fraction of the memory that was written to, 0..1; negative before there is some.
  [[nodiscard]] double share() const {
    constexpr double kBlockBytes = 512;
    struct stat state {};
    if (!size_ || ::fstat(memory_.get(), &state) != 0) return -1;
    return static_cast<double>(state.st_blocks) * kBlockBytes / static_cast<double>(*size_);
  }

  const SandboxJob& job_;
  std::string location_;
  File channel_, memory_;
  pid_t pid_ = -1;
  std::optional<std::size_t> size_;
  std::optional<ProgressBar> bar_;
  std::int64_t began_ns_ = monotonic_ns(), last_work_ns_ = 0, work_ns_ = -1;
};

}  // namespace

SharedBytes read_in_sandbox(const SandboxJob& job, const std::function<void(SandboxReader&)>& read,
                            const std::function<std::size_t(std::span<const std::byte>)>& accept) {
  return Child(job, read).result(accept);
}

}  // namespace kerf
