// SPDX-License-Identifier: Apache-2.0
#include "record/export/live_json.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <iostream>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>

#include <sys/socket.h>

#include "record/recorder.hpp"
#include "record/tick_text.hpp"
#include "shared/posix/sockets.hpp"
#include "shared/segment/connection.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr std::array<std::string_view, 4> kNoQuantities = {"seq", "volume_hash", "output_hash",
                                                           "crc32c"};

/// Sends ticks; a datagram that cannot be sent is counted.
class UdpSink final : public TickSink {
 public:
  UdpSink(const UdpAddress& to, const LiveOptions& options)
      : every_(options.every), socket_(socket(to.get()->sa_family, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    if (socket_.get() >= 0 && connect(socket_.get(), to.get(), to.bytes) == 0) return;
    throw UsageError("--udp " + one_line(options.udp) + ": " +
                     std::generic_category().message(errno) + "; give another address");
  }

  void append_second(const TickRecord& record) override { second_ = record; }
  void append(const TickRecord& record) override {
    if (record.tick % every_ != 0) return;
    const std::string text = tick_json(record, second_ ? &*second_ : nullptr);
    if (send_now(text)) return;
    // Refused was the datagram before; this one has not been sent yet.
    if (errno == ECONNREFUSED) {
      --sent_, ++lost_;
      if (send_now(text)) return;
    }
    ++lost_;
  }

  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  bool send_now(const std::string& text) {
    const bool sent = send(socket_.get(), text.data(), text.size(), MSG_DONTWAIT) >= 0;
    sent_ += sent ? 1 : 0;
    return sent;
  }

  std::uint32_t every_;
  OwnedFd socket_;
  std::optional<TickRecord> second_;  // of the tick that comes
  std::uint64_t sent_ = 0, lost_ = 0;
};

void append_columns(const TickRecord& record, std::string& text) {
  for_each_column([&](const LayoutField& field) {
    if (std::ranges::find(kNoQuantities, field.name) != kNoQuantities.end()) return;
    for (std::uint32_t i = 0; i < field.count; ++i) {
      if (!is_finite(record, field, i)) return;
    }
    text += '"';
    text += field.name;
    text += field.count > 1 ? "\":[" : "\":";
    for (std::uint32_t i = 0; i < field.count; ++i) {
      append_number(record, field, i, text);
      text += ',';
    }
    if (field.count > 1) {
      text.back() = ']';
      text += ',';
    }
  });
  text.back() = '}';  // the last comma
}

}  // namespace

std::string tick_json(const TickRecord& record, const TickRecord* second) {
  std::string text = R"({"timestamp":)";
  append_number(static_cast<double>(record.start_ns) * 1e-9, text);
  text += R"(,"kerf":{)";
  append_columns(record, text);
  if (second != nullptr) {
    text += R"(,"kerf_2":{)";
    append_columns(*second, text);
  }
  return text + '}';
}

int send_live(const LiveOptions& options, const std::atomic<bool>& stop) {
  const UdpAddress to = resolve_udp(options.udp);
  const bool no_port = options.udp == "0" || options.udp.ends_with(":0");
  const std::string why = no_port ? "port 0 receives nothing" : to.error;
  if (!why.empty()) {
    throw UsageError("--udp " + one_line(options.udp) + ": " + why + "; give [ADDRESS:]PORT");
  }
  const SegmentConnection connection = connect_segment(options.name);
  const SegmentReader& reader = connection.reader();
  UdpSink sink(to, options);
  Recorder recorder(reader, sink, reader.state_head(), {});
  std::cout << "sends to " << one_line(options.udp) << std::endl;
  for (bool ended = false; !ended;) {
    ended = stop || has_ended(connection);
    recorder.poll();
    if (!ended) std::this_thread::sleep_for(kPollPeriod);
  }
  std::cout << ticks_text(sink.sent()) << " sent, " << sink.lost() << " not taken, "
            << recorder.losses().lost << " lost\n";
  return 0;
}

}  // namespace kerf
