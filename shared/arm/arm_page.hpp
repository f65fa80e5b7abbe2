// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shared/segment/connection.hpp"
#include "shared/wire/cartesian.hpp"
#include "shared/wire/emulator_link.hpp"
#include "shared/wire/personality.hpp"

/// The page that `kerf-arm` and a controller share: reports of a vendor's library in one direction,
/// commands in the other.
///
/// A small file in the runtime folder (`segment_folder()`), `arm-NAME.page`, rights 0600, mapped by
/// both. Times are CLOCK_MONOTONIC, ns.
///
///        0  u64 magic, u32 layout, u32 device, u32 rate in Hz, u32 lock-step
///       64  u64 session: of one adapter, 0 while it prepares the page
///       72  u64 process of the adapter
///       96  u32 bell: commands so far, u32 whether the adapter sleeps at it
///      128  u64 version, u64 state, 112 bytes of text
///      256  u64 number of the newest report
///      320  4 commands of 64 bytes: u64 version, u64 ticket, i64 time, 16 bytes of the packet
///     4096  64 reports of 64 bytes: u64 version, i64 time, 40 bytes of the packet
///
/// The adapter writes reports, the controller commands; the controller waits for nothing, and no
/// access is a system call, but one: a command wakes an adapter that sleeps until there is one, as
/// that of a device which takes turns with its host (FUTEX_WAKE, which never blocks). Reports are a
/// ring, so that a controller slower than kerf-arm loses none of them. Each of the threads and
/// signal handlers that may send at once has its own slot for a command: one that was interrupted
/// in the middle of its slot does not stop the others, and the highest ticket counts.
///
/// Each side holds a lock on a byte of the file, which ends with its process: one adapter and one
/// controller at a time. The file of a killed adapter is used again, by a new session.
///
/// Each side checks what it reads: no content of the page can do more than send a packet that
/// its decoder accepts or refuses. The file must not be truncated while it is mapped (SIGBUS, as
/// for any mapped file); only its owner can do that.
namespace kerf {

/// A page that cannot be made, taken or trusted. One line: "location: value; remedy".
class ArmPageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// State of an adapter. `closing` and `failed` are the end of its session.
enum class ArmState : std::uint8_t { starting, running, closing, failed };
inline constexpr std::array<std::string_view, 4> kArmStateWords{"starting", "running", "closing",
                                                                "failed"};

namespace arm_page {
inline constexpr std::size_t kBytes = 8192;
inline constexpr std::uint64_t kReports = 64;
inline constexpr std::size_t kCommands = 4;
inline constexpr std::size_t kTextBytes = 112;
}  // namespace arm_page

struct ArmStatus {
  ArmState state = ArmState::starting;
  std::array<char, arm_page::kTextBytes> text{};  ///< ends with 0
};

/// Names of the adapters that run, for lists. Start-up only; a folder that cannot be read has none.
[[nodiscard]] std::vector<std::string> running_arms();

/// A command, when it was written, and its number, from 1 on for each controller.
struct TimedCommand {
  CartesianCommand command;
  std::int64_t at_ns = 0;
  std::uint64_t ticket = 0;
};

/// The mapped file.
class ArmPage {
 public:
  /// The path of adapter `name`: as of a controller, 1 to 64 of letters, digits, '.', '_', '-', no
  /// leading dot. Throws ArmPageError for another name.
  [[nodiscard]] static std::string path_of(std::string_view name);

  ArmPage(const ArmPage&) = delete;
  ArmPage& operator=(const ArmPage&) = delete;
  ~ArmPage();

 protected:
  explicit ArmPage(std::string path) : path_(std::move(path)) {}
  /// Maps `file_`, which holds kBytes.
  void map();
  [[nodiscard]] std::byte* at(std::size_t offset) const noexcept { return bytes_ + offset; }

  std::string path_;
  OwnedFd file_;
  std::byte* bytes_ = nullptr;
};

/// The adapter's side. `publish`, `newest` and `await_command` for one thread, `set_state` for any
/// thread and any signal handler.
class ArmPageAdapter final : public ArmPage {
 public:
  /// Makes the page of `name`, or takes over that of a dead adapter. Throws ArmPageError with one
  /// line if a live adapter has it, or if there is no file.
  ArmPageAdapter(const std::string& name, Personality device, int rate_hz);
  /// Removes the file. (If the process is killed, it stays.)
  ~ArmPageAdapter();

  /// A session that has ended never returns to an earlier state. Text beyond kTextBytes - 1 is
  /// truncated; if two threads write at the same moment, one text is dropped.
  void set_state(ArmState state, std::string_view text) noexcept;
  /// Adds a report; gives it the next number, from 1 on. Wait-free.
  void publish(CartesianReport report, std::int64_t now_ns) noexcept;
  /// The newest whole command on the page. Nothing if there is none, or none that is a packet.
  [[nodiscard]] std::optional<TimedCommand> newest() const noexcept;
  /// Sleeps until the newest command is another one than that of `ticket` (0: none), at most until
  /// `until_ns`. Whether it is.
  bool await_command(std::uint64_t ticket, std::int64_t until_ns) const noexcept;
  /// From now on the device runs in lock-step at this rate: each command is answered by one report,
  /// and a controller begins with the newest report. Before the state `running`.
  void set_lockstep(int rate_hz) noexcept;
  /// Whether a controller has the page. A system call.
  [[nodiscard]] bool has_controller() const noexcept;
  [[nodiscard]] std::uint64_t published() const noexcept { return published_; }

 private:
  std::uint64_t published_ = 0;
  std::atomic_flag writes_text_;
};

/// The controller's side. `take` for one thread; `send` and `over` for any thread and any signal
/// handler.
class ArmPageController final : public ArmPage {
 public:
  /// Why there is no running adapter.
  enum class Absence : std::uint8_t { no_adapter, starting, over };

  /// Opens the page of `name`, takes its lock and leaves no command on it. If no adapter runs, the
  /// result is empty, and `absence` and `text` have the reason. Throws ArmPageError with one line
  /// if another controller has the page, if it is of another device, or if the file is no page.
  [[nodiscard]] static std::unique_ptr<ArmPageController> open(const std::string& name,
                                                               Personality device, Absence& absence,
                                                               std::string& text);

  /// The packet of the oldest report that was not taken yet; those that the ring has lost are
  /// skipped. False if there is none.
  [[nodiscard]] bool take(cartesian::ReportBytes& packet) noexcept;
  /// Whether there is one.
  [[nodiscard]] bool waits() const noexcept;
  /// Reports that were overwritten before they were taken.
  [[nodiscard]] std::uint64_t overrun() const noexcept { return overrun_; }

  /// How the device runs, as it was when the page was opened.
  [[nodiscard]] const LinkHello& hello() const noexcept { return hello_; }

  /// False if all places are in use by other threads. Never blocks; a system call only to wake an
  /// adapter that sleeps.
  bool send(const cartesian::CommandBytes& packet, std::int64_t now_ns) noexcept;

  /// Whether the session has ended, by its state or by another one in its place.
  [[nodiscard]] bool over() const noexcept;
  [[nodiscard]] ArmStatus status() const noexcept;

 private:
  using ArmPage::ArmPage;

  std::uint64_t session_ = 0;
  LinkHello hello_;
  std::uint64_t taken_ = 0;
  std::uint64_t overrun_ = 0;
  std::atomic<std::uint64_t> next_ticket_{1};
};

}  // namespace kerf
