// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "shared/segment/reader.hpp"
#include "shared/segment/ros_messages.hpp"

namespace kerf::bridge {

inline constexpr const char* kFoxglovePath = "/foxglove";     ///< of its WebSocket
inline constexpr std::size_t kMaxFoxgloveUpBytes = 4 * 1024;  ///< client to server

/// The first sub-protocol of the client's list (`Sec-WebSocket-Protocol`, with commas between) that
/// a `FoxgloveSession` speaks: foxglove.sdk.v1 and foxglove.websocket.v1, which are one protocol
/// under two names. Empty: none of them.
[[nodiscard]] std::string_view foxglove_protocol(std::string_view offered) noexcept;

/// A whole WebSocket message to a client.
struct FoxgloveMessage {
  bool is_text = false;  ///< JSON; else binary
  std::string bytes;
};

/// The Foxglove WebSocket protocol towards one client
/// (https://github.com/foxglove/ws-protocol): the channels of `ros_channels`, with the clock of the
/// servo (capability `time`). Those of a second arm are advertised when the first run that has one
/// comes, and stay. It only sends: a request that would change something is answered with a status
/// of level 2. It uses no network: the caller takes the next message whenever it can send one.
///
/// Texts (status, server info, lists of channels) are queued; a status is dropped while
/// `kMostAnswers` texts wait. Ticks are read from the segment when they are sent: those more than
/// `kBehindNs` behind the newest are left out, and a status reports their number, at most every
/// `kToldNs`. So over a slow link the client gets evenly fewer ticks, a little late. Of a servo
/// above 1 kHz every n-th tick is sent, at least 1,000 a second.
///
/// One thread.
class FoxgloveSession {
 public:
  static constexpr std::uint64_t kBehindNs = 133'000'000;  ///< of the run, not of this machine
  static constexpr std::int64_t kToldNs = 5'000'000'000;
  static constexpr std::size_t kMostAnswers = 16;

  /// `controller`: its name, as the client shows it.
  explicit FoxgloveSession(std::string controller);

  /// A message of the client, at most `kMaxFoxgloveUpBytes`. Errors in it are answered with a
  /// status, unless `kMostAnswers` wait already.
  void hear(bool is_text, std::string_view message);

  /// The next message, if there is one. `run`: nullptr while there is no controller; the same for
  /// all of a run. `ended`: the controller has gone.
  bool next(std::int64_t now_ns, const SegmentReader* run, bool ended, FoxgloveMessage& out);

 private:
  enum class Level : std::uint8_t { info, warning, error };
  enum class Said : std::uint8_t { nothing, waits, runs, ended };

  void obey(std::string_view text);
  void subscribe(std::uint32_t id, std::uint32_t channel);
  void unsubscribe(std::uint32_t id);
  void answer(Level level, const std::string& text);
  void greet(const SegmentReader* run);
  /// Sends once what the run is doing.
  void follow(const SegmentReader* run, bool ended);
  /// Whether the client has subscribed to a channel, by its index among those of all arms, and the
  /// tick has a message of it.
  [[nodiscard]] bool is_wanted(std::size_t channel) const noexcept;
  [[nodiscard]] std::size_t channels() const noexcept { return arms_ * kRosTopics; }
  [[nodiscard]] bool next_of_tick(FoxgloveMessage& out);
  [[nodiscard]] bool take_tick(std::int64_t now_ns, const SegmentReader& run);

  std::string controller_;
  std::deque<std::string> texts_;
  static constexpr std::size_t kMostChannels = kMaxArms * kRosTopics;
  std::size_t arms_ = 1;  // whose channels are advertised
  std::array<std::optional<std::uint32_t>, kMostChannels> subscriptions_;  // their ids by channel
  std::optional<std::uint64_t> session_;                                   // of the run
  Said said_ = Said::nothing;
  RosMessages messages_{1};
  std::uint64_t stride_ = 1, most_behind_ = 1;
  std::uint64_t index_ = 0;     // of the next tick in the ring
  std::uint64_t left_out_ = 0;  // ticks, in no status yet
  std::int64_t told_ns_ = 0;
  std::array<std::optional<TickRecord>, kMaxArms> records_{};  // are being sent, of one tick
  std::size_t part_ = kParts;  // of them: the time, then each channel
  static constexpr std::size_t kParts = 1 + kMostChannels;
};

}  // namespace kerf::bridge
