// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hil/front/inverse3/service_device.hpp"
#include "hil/front/serving.hpp"

namespace kerf {

/// Where the emulated service listens.
struct ServicePlace {
  std::string where = "0";                  ///< [ADDRESS:]PORT; of 127.0.0.1, 0: any free one
  std::optional<std::uint16_t> event_port;  ///< at the same address; none: no events
};

/// What a client did about the first bad sign of the service on its connection: a reply that cannot
/// be read, a closing frame, the end of its side. Times of CLOCK_MONOTONIC in ns; 0: never.
struct ClientRecord {
  std::int64_t failed_ns = 0;
  std::int64_t let_go_ns = 0;  ///< the first message without force since then
  bool pushes_at_end = false;  ///< the last message had a force
};

/// The emulated Inverse Service at a TCP port: HTTP and one WebSocket client at a time, whom a
/// second one does not disturb; and events at another port, for any number of clients.
///
/// The device's time is that of the machine, from the first client on, or in lock-step that of the
/// client's messages. A client that leaves in order (1000) ends the session: the next one gets the
/// device anew. One whose connection is lost may come back to the same device and hand.
class ServiceFront {
 public:
  /// `device` outlives it; `renew` restarts it. Throws `HilError` if it cannot listen.
  ServiceFront(const ServicePlace& place, const ServiceSettings& settings, PacketDevice& device,
               std::function<void()> renew);
  ~ServiceFront();

  [[nodiscard]] std::uint16_t port() const noexcept;
  [[nodiscard]] std::optional<std::uint16_t> event_port() const noexcept;

  /// Of every client of the WebSocket so far. Not while `serve` runs.
  [[nodiscard]] const std::vector<ClientRecord>& records() const noexcept;

  /// Serves until the limit or a stop, and without `stay` until a client has left in order, or none
  /// has come back for 3 s. One thread.
  void serve(const ServeLimits& limits, bool stay, FrontStats& stats);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
