// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "shared/wire/inverse3.hpp"

// Messages of the Inverse Service, as the driver reads and writes them: JSON to fixed structs, and
// a force to JSON in a fixed buffer. Units and frame of the service (shared/wire/inverse3.hpp).

namespace kerf::inverse3 {

/// A name or identifier of the service: at most kMost bytes; a longer one is cut, and no longer
/// `is_plain`.
class ShortText {
 public:
  static constexpr std::size_t kMost = 47;

  ShortText() noexcept = default;
  explicit ShortText(std::string_view text) noexcept;
  [[nodiscard]] std::string_view view() const noexcept { return {bytes_.data(), size_}; }
  /// Letters, digits and _ - . : alone, at least one: needs no escapes in JSON or in a message.
  [[nodiscard]] bool is_plain() const noexcept;
  friend bool operator==(const ShortText& a, std::string_view b) noexcept { return a.view() == b; }

 private:
  std::array<char, kMost> bytes_{};
  std::size_t size_ = 0;
  bool is_cut_ = false;
};

/// One entry of the group `inverse3`. A member that the message leaves out is empty.
struct ArmState {
  ShortText id;
  std::array<std::optional<double>, 3> position_m;
  std::array<std::optional<double>, 3> echoed_n;  ///< current_cursor_force
  /// control_mode (3.5) or mode (up to 3.4), and control_domain (3.5).
  ShortText mode, domain;
  std::optional<bool> calibrated, power_supply, ready;

  // Of `config`, which comes first and after a request.
  bool has_config = false;
  ShortText basis;                            ///< permutation, "XYZ"
  std::optional<double> damping, force_gate;  ///< damping.scalar, force_gate.gain
  bool mount_moves = false;                   ///< its transform is not the identity
};

/// A button of a handle. The only one of a wired handle is called `button`.
struct Button {
  ShortText name;
  bool pressed = false;
};

/// One entry of a group of handles.
struct HandleState {
  ShortText id;
  std::size_t group = 0;  ///< in kHandleGroups
  std::array<std::optional<double>, 4> orientation_xyzw;
  std::array<Button, 8> buttons;
  std::size_t button_count = 0;
  std::optional<bool> connected, awake;
};

/// One message: inventory, state or full state.
struct ServiceState {
  static constexpr std::size_t kMostEntries = 8;

  std::array<ArmState, kMostEntries> arms;
  std::size_t arm_count = 0;
  std::array<HandleState, kMostEntries> handles;
  std::size_t handle_count = 0;

  [[nodiscard]] std::span<const ArmState> all_arms() const noexcept {
    return std::span(arms).first(arm_count);
  }
  [[nodiscard]] std::span<const HandleState> all_handles() const noexcept {
    return std::span(handles).first(handle_count);
  }
};

/// Reads a message into `state`, whose earlier content is dropped. False for text that is no JSON
/// object of UTF-8, is longer than kMostMessageBytes or nested deeper than kMostLevels, has more
/// than kMostEntries entries in its groups, or another type where a number, truth value, text, list
/// or object is read. Unknown members are skipped, and of a member that is there twice the last one
/// counts. Does not throw; allocates a little.
[[nodiscard]] bool parse_state(std::string_view text, ServiceState& state);

/// An event of the event port.
struct ServiceEvent {
  ShortText name;         ///< such as device-disconnected
  ShortText device_id;    ///< data.device_id
  ShortText safety_type;  ///< data.safety_type, such as ebrake_triggered
};
/// Reads an event; the rules of `parse_state` hold.
[[nodiscard]] bool parse_event(std::string_view text, ServiceEvent& event);

/// The key of the force in `set_cursor_force`: `vector` since 3.5, `values` before. A service
/// ignores the other one without an error.
enum class ForceKey : unsigned char { values, vector };

/// What goes along with a force.
enum class Extra : unsigned char {
  none,
  profile,     ///< names this program's session; first message, since 3.5
  full_state,  ///< requests the configuration again
};

using MessageBuffer = std::array<char, 384>;
/// A force in N in the service's frame, with four decimals, as one message; a view of `buffer`. A
/// component that is not finite or above 100 N is written as 0, so none ever leaves. `device_id` is
/// plain. Neither allocates nor throws.
[[nodiscard]] std::string_view force_message(const ShortText& device_id, ForceKey key,
                                             const std::array<double, 3>& force_n, Extra extra,
                                             MessageBuffer& buffer) noexcept;

/// A message without a force, by which the device falls idle; as `force_message`.
[[nodiscard]] std::string_view probe_message(const ShortText& device_id,
                                             MessageBuffer& buffer) noexcept;

}  // namespace kerf::inverse3
