// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "bridge/stream/run_snapshot.hpp"
#include "bridge/stream/stream.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"

namespace kerf::web {

/// The page's side of a run in this tab: what a bridge would send to its one viewer, out of the
/// run's own segment. Messages are those of bridge/wire/messages.hpp.
class TabViewer {
 public:
  /// `writer` outlives it. `flags`: of the greeting.
  TabViewer(SegmentWriter& writer, std::uint32_t flags)
      : writer_(writer),
        flags_(flags),
        reader_(SegmentReader::map(writer.fd())),
        snapshot_(reader_) {
    join();
  }

  /// The viewer begins anew: it gets the greeting, and all volumes again.
  void join() { stream_.emplace(snapshot_, flags_); }

  /// Takes what changed since the last slot, for the next messages. The page's bridge does so
  /// sixty times a second. `ended`: no step follows.
  void slot(bool ended);

  /// The next message to the viewer; false if none is due, or the viewer has yet to acknowledge.
  [[nodiscard]] bool next(std::vector<std::byte>& message);

  /// A message of the viewer: an acknowledgement, or a command, which is refused. False if it is
  /// neither.
  bool take(std::span<const std::byte> message);

 private:
  SegmentWriter& writer_;
  std::uint32_t flags_;
  SegmentReader reader_;
  bridge::RunSnapshot snapshot_;
  std::optional<bridge::Stream> stream_;
  std::deque<bridge::ReplyMessage> replies_;
};

}  // namespace kerf::web
