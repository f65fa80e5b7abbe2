// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kerf/scene.hpp"
#include "kerf/servo.hpp"
#include "kerf/tick.hpp"

namespace kerf {

/// Writes a recording of a servo that a program steps itself: ticks, scene, volumes and manifest
/// with checksums, as `kerf-recorder` does of a controller. `kerf-record`, `kerf-replay` and the
/// Python reader take it; with a law of your own, a `kerf-replay` that has it (docs/own-law.md).
///
///     kerf::LogWriter log("run", scene);
///     for (int i = 0; i < 4000; ++i) log.add(servo.step(hand.next(servo.last())));
///     log.close();
///
/// One thread.
class LogWriter {
 public:
  /// Makes the folder; throws Error if it has a recording already.
  LogWriter(const std::filesystem::path& folder, const Scene& scene);
  /// Closes it, if `close` was not called; an error is lost then. An assignment does so first.
  ~LogWriter();
  LogWriter(LogWriter&&) noexcept;
  LogWriter& operator=(LogWriter&&) noexcept;

  /// The next tick of a scene with one arm, or of all arms, from tick 1 on: a recording is of one
  /// run, so a servo that was restored needs another one. Throws Error for another tick, after
  /// `close`, and on a full disk. Ticks of another scene are not noticed here, but by a replay.
  void add(const TickRecord& tick);
  void add(std::span<const TickRecord> arms);
  /// Writes figures and checksums. Throws Error.
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The first difference of a replay.
struct ReplayDifference {
  Tick tick = 0;
  std::size_t arm = 0;
  std::string stage;  ///< pose, safety, contact, force, cut, energy or output
  std::string field;  ///< with its element: "contact_force_n[1]"
  std::string recorded, replayed;
};

struct ReplayOutcome {
  std::uint64_t ticks = 0;                     ///< that were stepped
  std::uint64_t output_hash = 0;               ///< of the first arm, after them
  std::optional<ReplayDifference> difference;  ///< none: each tick is equal to the last bit
  /// Why the recording ends before its run did; empty if it does not, or if the replay stopped at a
  /// difference before that.
  std::string cut_short;
};

/// A recording. If its run goes on, it has the ticks that were in the files when it was opened; a
/// recorder writes some ticks at a time.
///
///     auto log = kerf::Log::open("run");
///     for (const std::string& problem : log.check()) std::puts(problem.c_str());
///     log.for_each([](const kerf::TickRecord& tick) { std::printf("%g N\n", tick.press_n); });
///     if (!log.replay().difference) std::puts("each tick equal");
///
/// One thread. What a visitor throws comes out as it is.
class Log {
 public:
  /// Throws Error for a folder that holds no recording, or one that cannot be read.
  [[nodiscard]] static Log open(const std::filesystem::path& folder);
  ~Log();
  Log(Log&&) noexcept;
  Log& operator=(Log&&) noexcept;

  [[nodiscard]] std::uint64_t rows() const noexcept;
  [[nodiscard]] std::size_t arms() const noexcept;
  [[nodiscard]] double period_s() const noexcept;

  /// What is inconsistent in the recording, by all of its checksums, one line each; empty: intact.
  /// Whether its ticks follow from its scene, `replay` alone finds. Throws Error if nothing can be
  /// compared.
  [[nodiscard]] std::vector<std::string> check() const;

  /// Rows `first` and following into `rows`; returns how many there are, less at the end. Throws
  /// Error for a damaged row.
  std::size_t read(std::uint64_t first, std::span<TickRecord> rows, std::size_t arm = 0);
  /// Calls `visit` for each row in order. Throws as `read`.
  void for_each(const std::function<void(const TickRecord&)>& visit, std::size_t arm = 0);

  /// Steps the recorded run again from its inputs, with these settings in place of the recorded
  /// ones, and compares each tick of all arms. Without settings it stops at the first difference;
  /// with settings it runs to the end. `visit` gets both records of the first arm. Throws Error for
  /// a run that cannot be repeated.
  using Visit = std::function<void(const TickRecord& recorded, const TickRecord& replayed)>;
  [[nodiscard]] ReplayOutcome replay(const Settings& settings = {}, const Visit& visit = {}) const;

 private:
  struct Parts;
  explicit Log(std::unique_ptr<Parts> parts) noexcept;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kerf
