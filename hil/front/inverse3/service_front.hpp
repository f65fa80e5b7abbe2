// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "hil/front/inverse3/service_device.hpp"
#include "hil/front/serving.hpp"

namespace kerf {

/// Where the emulated service listens.
struct ServicePlace {
  std::string where = "0";                  ///< [ADDRESS:]PORT; of 127.0.0.1, 0: any free one
  std::optional<std::uint16_t> event_port;  ///< at the same address; none: no events
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

  /// Serves until the limit or a stop, and without `stay` until a client has left in order, or none
  /// has come back for 3 s. One thread.
  void serve(const ServeLimits& limits, bool stay, FrontStats& stats);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf
