// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bridge/stream/run_snapshot.hpp"
#include "bridge/stream/stream.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"

namespace kerf::web {

/// Serves the page from the segment of the run in this tab, as `kerf-bridge` serves one viewer,
/// with the same messages (bridge/wire/messages.hpp). One thread.
class TabViewer {
 public:
  /// Takes a command; returns the reply.
  using Answer = std::function<bridge::ReplyMessage(const bridge::CommandMessage&)>;

  /// `writer` outlives it. With `answer` the viewer may send commands.
  explicit TabViewer(SegmentWriter& writer, Answer answer = {})
      : writer_(writer),
        answer_(std::move(answer)),
        reader_(SegmentReader::map(writer.fd())),
        snapshot_(reader_) {
    join();
  }
  TabViewer(const TabViewer&) = delete;
  TabViewer& operator=(const TabViewer&) = delete;

  /// The viewer begins anew: it gets the greeting, and all volumes again.
  void join() { stream_.emplace(snapshot_, answer_ ? bridge::kMayCommand : 0); }

  /// Takes what changed since the last slot, for the next messages. The page's bridge does so
  /// sixty times a second. `ended`: no step follows.
  void slot(bool ended);

  /// The next message to the viewer; false if none is due, or the viewer has yet to acknowledge.
  [[nodiscard]] bool next(std::vector<std::byte>& message);

  /// A message of the viewer: an acknowledgement, or a command, which `next` answers, with a
  /// refusal if there is no `answer`. False if it is neither.
  bool take(std::span<const std::byte> message);

 private:
  SegmentWriter& writer_;
  Answer answer_;
  SegmentReader reader_;
  bridge::RunSnapshot snapshot_;
  std::optional<bridge::Stream> stream_;
  std::deque<bridge::ReplyMessage> replies_;
};

}  // namespace kerf::web
