// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "shared/text/json.hpp"
#include "shared/wire/cartesian.hpp"

/// The emulated Inverse Service without its sockets: an Inverse3 and its handle as messages of
/// JSON, by the vendor's public pages alone. What they leave open is marked in the source.
namespace kerf {

/// Version of the service, and which handles it has. `v3_0` serves no WebSocket here, as its own is
/// at another port.
enum class ServiceProfile : std::uint8_t { v3_4, v3_5, v3_5_wireless, v3_0 };
inline constexpr std::array<std::string_view, 4> kServiceProfileWords{"3.4", "3.5", "3.5-wireless",
                                                                      "3.0"};

/// Faults of the service and its link, beside those of a fault script. None takes a force back:
/// what a real service does with the force of a client that is gone is not known.
enum class ServiceFault : std::uint8_t {
  malformed,      ///< the next reply cannot be read: each time in another way of kMalformedWays
  unreadable,     ///< no reply can be read from now on, in the ways of kMalformedWays
  readable,       ///< they can again
  close,          ///< the service sends a closing frame (1000), and reads until the client's
  going_away,     ///< it sends a closing frame (1001), and reads until the client's
  half_close,     ///< it ends its side of the link (FIN), and reads until the client's end
  fin,            ///< it ends both sides: nothing can be carried any more
  reset,          ///< the connection is reset
  half_open,      ///< the service neither reads nor writes on it any more
  restart,        ///< reset, and the service is back as the other of the versions 3.4 and 3.5
  vanish,         ///< the device is not listed any more
  back,           ///< it is again
  other_id,       ///< it is listed under another id
  second_arm,     ///< another Inverse3 is listed before it, elsewhere and without power
  third_handle,   ///< another wireless handle is listed before the others, its button up
  driven,         ///< another session drives the device, without force: it is never idle
  power_off,      ///< its 24 V supply fails
  power_on,       ///< and is back
  grip_sleep,     ///< the handle sleeps: its orientation stands still
  grip_wake,      ///< and is awake again
  second_client,  ///< another session adds 1 N along X
  reconfigure,    ///< another client has set damping, basis and force_scale
  event,          ///< ebrake_triggered at the event port
};
inline constexpr std::array<std::string_view, 23> kServiceFaultWords{
    "malformed",  "unreadable", "readable",      "close",       "going_away", "half_close",
    "fin",        "reset",      "half_open",     "restart",     "vanish",     "back",
    "other_id",   "second_arm", "third_handle",  "driven",      "power_off",  "power_on",
    "grip_sleep", "grip_wake",  "second_client", "reconfigure", "event"};
inline constexpr int kMalformedWays = 11;
inline constexpr int kMalformedText = 9;  ///< the first so many are text of UTF-8, or binary

/// A fault at a bus cycle (125 us) of the device, from the first client on.
struct ScriptedServiceFault {
  std::int64_t cycle = 0;
  ServiceFault fault = ServiceFault::malformed;
};

struct ServiceSettings {
  ServiceProfile profile = ServiceProfile::v3_5_wireless;
  /// Version that it gives instead of its own: a service whose words changed without notice.
  std::optional<ServiceProfile> claims{};
  bool lockstep = false;
  int rate_hz = 1000;         ///< in lock-step: a message is one period of it
  double position_scale = 1;  ///< 1000: positions are in millimetres, against the pages
  std::vector<ScriptedServiceFault> script{};
  int first_way = 0;  ///< of kMalformedWays, in which a reply cannot be read
};

/// One message or HTTP answer of the service.
struct ServiceMessage {
  std::string text;
  bool is_binary = false;
  bool is_broken = false;  ///< cannot be read
};

/// The device behind the service, for one client. The packets between are those of
/// shared/wire/cartesian.hpp, so that a fault script acts as on any other front; the device answers
/// each command with one. The caller keeps the time. One thread; allocates.
///
/// Commands last one message: one without a force for the device takes the force back. Nothing else
/// does: the force stays for as long as no message comes, on this connection and the next. A
/// member of another version's name is ignored without an error. Forces have steps of 14 mN.
class ServiceDevice {
 public:
  /// `device` outlives it.
  ServiceDevice(const ServiceSettings& settings, PacketDevice& device);

  /// A client has connected: the state of the session begins anew. Returns the list of the devices.
  [[nodiscard]] std::string greet();
  /// A message of the client. In lock-step the device advances by one period, else by one cycle, in
  /// which it takes the command.
  void receive(std::string_view text);
  /// The device's time goes on.
  void advance(int cycles);
  /// The replies that are due now, one by one.
  [[nodiscard]] std::optional<ServiceMessage> next_reply();

  /// Begins a fault now.
  void begin(ServiceFault fault);
  /// A fault of the link that has begun, `close` to `restart`, once each.
  [[nodiscard]] std::optional<ServiceFault> take_link_fault();
  /// A message for the event port.
  [[nodiscard]] std::optional<std::string> take_event();
  [[nodiscard]] bool hung_up() const noexcept { return device_.hung_up(); }
  /// The last message had a force other than zero.
  [[nodiscard]] bool is_pushed() const noexcept { return command_.force_on; }

  /// The body for a GET; empty: there is no such path.
  [[nodiscard]] std::optional<std::string> get(std::string_view path) const;
  [[nodiscard]] bool has_web_socket() const noexcept { return profile_ != ServiceProfile::v3_0; }

  [[nodiscard]] std::int64_t cycles() const noexcept { return cycle_; }

 private:
  [[nodiscard]] bool is_3_5() const noexcept { return profile_ >= ServiceProfile::v3_5; }
  void begin_faults();
  void take_packets();
  void follow(const CartesianReport& report) noexcept;
  void take_command(std::string_view text);
  [[nodiscard]] Json arm_config(const std::string& name) const;
  [[nodiscard]] std::string state_text(bool with_config, double position_scale = 1) const;
  [[nodiscard]] ServiceMessage broken(const std::string& text);

  ServiceSettings settings_;
  PacketDevice& device_;
  ServiceProfile profile_;
  std::int64_t cycle_ = 0;
  std::size_t faults_begun_ = 0;
  int session_ = 0;

  CartesianReport report_;  ///< the newest that the device gave
  std::int64_t report_cycle_ = 0;
  std::array<double, 3> velocity_mm_s_{};  ///< kerf's frame, low-passed
  CartesianCommand command_;               ///< of the last message
  bool is_forced_ = false;                 ///< it had a force
  bool wants_full_state_ = false;
  std::deque<ServiceMessage> replies_;

  int malformed_left_ = 0, malformed_way_ = 0;
  bool is_unreadable_ = false;
  bool is_listed_ = true, has_other_id_ = false, has_second_arm_ = false;
  bool has_third_handle_ = false, is_driven_ = false;
  bool is_powered_ = true, is_awake_ = true;
  bool has_second_client_ = false, is_reconfigured_ = false;
  std::array<std::int16_t, 4> held_orientation_{};
  std::optional<ServiceFault> link_fault_;
  std::deque<std::string> events_;
};

}  // namespace kerf
