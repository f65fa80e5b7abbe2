// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bridge/stream/pack_choice.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/reader.hpp"

namespace kerf::bridge {

/// The records of one ring, in messages of at most `kMaxRawBytes`, from the newest at the start on.
/// Where the link cannot bear all of them every n-th goes, and always the newest.
class RecordBatches {
 public:
  /// The reader outlives this.
  RecordBatches(const SegmentReader& reader, Ring ring) noexcept : reader_(reader), ring_(ring) {}

  /// Of what was published since, at most `records` (and 1 at least) are to go out until the next
  /// call.
  void plan(std::uint64_t records) noexcept;
  [[nodiscard]] bool waiting() const noexcept { return next_ < end_; }

  /// The next message, packed where that pays on a link of `bytes_per_s`. False, and `out` is
  /// empty, where the records were overwritten meanwhile.
  bool write(double bytes_per_s, std::vector<std::byte>& out);

  /// Raw bytes per packed one.
  [[nodiscard]] double ratio() const noexcept { return pack_choice_.ratio(); }

 private:
  [[nodiscard]] bool read(std::uint64_t index, std::vector<std::byte>& out) const;

  const SegmentReader& reader_;
  Ring ring_;
  bool started_ = false;
  std::uint64_t next_ = 0, end_ = 0;
  std::uint32_t stride_ = 1;
  PackChoice pack_choice_;
  std::vector<std::byte> raw_;
};

}  // namespace kerf::bridge
