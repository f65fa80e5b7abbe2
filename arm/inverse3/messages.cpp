// SPDX-License-Identifier: Apache-2.0
#include "arm/inverse3/messages.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

namespace kerf::inverse3 {

ShortText::ShortText(std::string_view text) noexcept
    : size_(std::min(text.size(), kMost)), is_cut_(text.size() > kMost) {
  std::copy_n(text.begin(), size_, bytes_.begin());
}

bool ShortText::is_plain() const noexcept {
  const auto is_fine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ':';
  };
  return size_ > 0 && !is_cut_ && std::ranges::all_of(view(), is_fine);
}

namespace {

using nlohmann::json;

/// The members that lead to the present value, as "inverse3/state/cursor_position/x": an entry of a
/// list has the path of its list. Longer than the buffer is as good as unknown.
class Path {
 public:
  /// The value that comes next is the member `name` of the object.
  void set_member(std::string_view name) noexcept {
    size_ = starts_[depth_ - 1];
    append(name);
  }
  /// False if it is nested too deep.
  [[nodiscard]] bool enter() noexcept {
    if (depth_ == kMostLevels) return false;
    starts_[depth_++] = size_;
    return true;
  }
  /// The value that ended was an object or a list.
  void leave() noexcept { size_ = starts_[--depth_]; }
  [[nodiscard]] std::string_view view() const noexcept {
    return {bytes_.data(), std::min(size_, bytes_.size())};
  }
  [[nodiscard]] std::size_t depth() const noexcept { return depth_; }

 private:
  void append(std::string_view name) noexcept {
    const auto put = [this](char c) {
      if (size_ < bytes_.size()) bytes_[size_] = c;
      ++size_;
    };
    if (size_ > 0) put('/');
    for (const char c : name) put(c == '/' ? '?' : c);  // one member is never taken for two
  }

  std::array<char, 128> bytes_{};
  std::size_t size_ = 0;
  std::array<std::size_t, kMostLevels> starts_{};
  std::size_t depth_ = 0;
};

/// What a value of JSON may be; `other` is null.
enum class Kind : std::uint8_t { number, truth, text, list, object, other };

struct Value {
  Kind kind = Kind::other;
  double number = 0;
  bool truth = false;
  std::string_view text;
};

/// Calls of nlohmann's parser, passed on as values with their paths. `Take` has
/// `bool begin(path)` for each object and list, with `bool is_list`, and `bool take(path, value)`.
template <class Take>
class Reader {
 public:
  explicit Reader(Take& take) noexcept : take_(take) {}

  // The names are nlohmann's.
  bool null() { return value({}); }
  bool boolean(bool truth) { return value({Kind::truth, 0, truth, {}}); }
  bool number_integer(std::int64_t number) { return of_number(static_cast<double>(number)); }
  bool number_unsigned(std::uint64_t number) { return of_number(static_cast<double>(number)); }
  bool number_float(double number, const std::string&) { return of_number(number); }
  bool string(const std::string& text) { return value({Kind::text, 0, false, text}); }
  bool binary(json::binary_t&) { return false; }
  bool start_object(std::size_t) { return enter(Kind::object); }
  bool start_array(std::size_t) { return enter(Kind::list); }
  bool key(const std::string& name) {
    path_.set_member(name);
    return true;
  }
  bool end_object() {
    path_.leave();
    return true;
  }
  bool end_array() { return end_object(); }
  bool parse_error(std::size_t, const std::string&, const json::exception&) { return false; }

 private:
  bool of_number(double number) { return value({Kind::number, number, false, {}}); }
  bool value(const Value& value) { return path_.depth() > 0 && take_.take(path_.view(), value); }
  bool enter(Kind kind) {
    if (path_.depth() == 0 && kind != Kind::object) return false;
    const bool goes_on = path_.depth() == 0 || take_.take(path_.view(), {kind, 0, false, {}});
    return goes_on && path_.enter();
  }

  Take& take_;
  Path path_;
};

template <class Take>
bool read(std::string_view text, Take& take) {
  if (text.size() > kMostMessageBytes) return false;
  Reader<Take> reader(take);
  return json::sax_parse(text, &reader);
}

bool put(const Value& value, std::optional<double>& number) noexcept {
  if (value.kind != Kind::number || !std::isfinite(value.number)) return false;
  number = value.number;
  return true;
}
bool put(const Value& value, std::optional<bool>& truth) noexcept {
  if (value.kind != Kind::truth) return false;
  truth = value.truth;
  return true;
}
bool put(const Value& value, ShortText& text) noexcept {
  if (value.kind != Kind::text) return false;
  text = ShortText(value.text);
  return true;
}

/// Index of the component that `name` is, "x" to "z" or "w".
std::optional<std::size_t> component(std::string_view name) noexcept {
  constexpr std::string_view kNames = "xyzw";
  if (name.size() != 1 || kNames.find(name[0]) == std::string_view::npos) return std::nullopt;
  return kNames.find(name[0]);
}

/// Removes `front` and a slash from `path`; false if it does not begin so.
bool strip(std::string_view& path, std::string_view front) noexcept {
  if (!path.starts_with(front) || path.size() <= front.size() || path[front.size()] != '/') {
    return false;
  }
  path.remove_prefix(front.size() + 1);
  return true;
}

template <std::size_t N>
bool take_vector(std::string_view name, const Value& value,
                 std::array<std::optional<double>, N>& vector) noexcept {
  const auto at = component(name);
  return !at || *at >= N || put(value, vector[*at]);
}

/// An object begins anew if its member is there twice.
template <class T>
bool begin_object(const Value& value, T& what) noexcept {
  if (value.kind != Kind::object) return false;
  what = {};
  return true;
}

bool take_arm_state(std::string_view path, const Value& value, ArmState& arm) noexcept {
  if (path == "cursor_position") return begin_object(value, arm.position_m);
  if (path == "current_cursor_force") return begin_object(value, arm.echoed_n);
  if (path == "control_mode" || path == "mode") return put(value, arm.mode);
  if (path == "control_domain") return put(value, arm.domain);
  if (strip(path, "cursor_position")) return take_vector(path, value, arm.position_m);
  if (strip(path, "current_cursor_force")) return take_vector(path, value, arm.echoed_n);
  return true;
}

bool take_arm_config(std::string_view path, const Value& value, ArmState& arm) noexcept {
  if (path == "basis/permutation") return put(value, arm.basis);
  if (path == "filters/damping/scalar") return put(value, arm.damping);
  if (path == "filters/force_gate/gain") return put(value, arm.force_gate);
  // Flat when read, nested in `transform` when sent: take both.
  if (!strip(path, "mount")) return true;
  static_cast<void>(strip(path, "transform"));
  std::optional<double> number;
  const auto differs_from = [&](double identity) {
    if (!put(value, number)) return false;
    arm.mount_moves = arm.mount_moves || std::abs(*number - identity) > 1e-6;
    return true;
  };
  if (strip(path, "position")) return !component(path) || differs_from(0);
  if (strip(path, "scale")) return !component(path) || differs_from(1);
  if (strip(path, "rotation")) return !component(path) || path == "w" || differs_from(0);
  return true;
}

bool take_arm(std::string_view path, const Value& value, ArmState& arm) noexcept {
  if (path == "device_id") return put(value, arm.id);
  if (path == "state" || path == "status") return value.kind == Kind::object;
  if (path == "config") {
    arm.has_config = true;
    arm.mount_moves = false;
    return value.kind == Kind::object;
  }
  if (path == "status/calibrated") return put(value, arm.calibrated);
  if (path == "status/power_supply") return put(value, arm.power_supply);
  if (path == "status/ready") return put(value, arm.ready);
  if (strip(path, "state")) return take_arm_state(path, value, arm);
  if (strip(path, "config")) return take_arm_config(path, value, arm);
  return true;
}

bool take_handle(std::string_view path, const Value& value, HandleState& handle) noexcept {
  if (path == "device_id") return put(value, handle.id);
  if (path == "status/connected") return put(value, handle.connected);
  if (path == "status/awake") return put(value, handle.awake);
  if (path == "state") {
    handle.button_count = 0;
    return value.kind == Kind::object;
  }
  if (path == "status") return value.kind == Kind::object;
  if (!strip(path, "state")) return true;
  if (path == "orientation") return begin_object(value, handle.orientation_xyzw);
  if (strip(path, "orientation")) return take_vector(path, value, handle.orientation_xyzw);
  if (path == "buttons") return value.kind == Kind::object;
  const bool is_button = path == "button" || strip(path, "buttons");
  if (!is_button) return true;
  std::optional<bool> pressed;
  if (!put(value, pressed)) return false;
  const auto known = std::span(handle.buttons).first(handle.button_count);
  const auto same = std::ranges::find_if(known, [&](const Button& b) { return b.name == path; });
  if (same != known.end()) {
    same->pressed = *pressed;
  } else if (handle.button_count < handle.buttons.size()) {
    handle.buttons[handle.button_count++] = {ShortText(path), *pressed};
  }
  return true;
}

struct StateTaker {
  ServiceState& state;

  bool take(std::string_view path, const Value& value) noexcept {
    constexpr std::string_view kArms = "inverse3";
    if (path == kArms) {
      if (value.kind == Kind::list) return state.arm_count = 0, true;
      return value.kind == Kind::object && next(state.arms, state.arm_count);
    }
    if (strip(path, kArms)) {
      return state.arm_count > 0 && take_arm(path, value, state.arms[state.arm_count - 1]);
    }
    for (std::size_t group = 0; group < kHandleGroups.size(); ++group) {
      if (path == kHandleGroups[group]) return begin_handle(group, value);
      if (!strip(path, kHandleGroups[group])) continue;
      return state.handle_count > 0 &&
             take_handle(path, value, state.handles[state.handle_count - 1]);
    }
    return true;
  }

 private:
  template <class T>
  static bool next(T& entries, std::size_t& count) noexcept {
    if (count == entries.size()) return false;
    entries[count++] = {};
    return true;
  }
  bool begin_handle(std::size_t group, const Value& value) noexcept {
    if (value.kind == Kind::list) {
      // Twice the same group: its first list is dropped.
      const auto all = std::span(state.handles).first(state.handle_count);
      const auto same = [group](const HandleState& handle) { return handle.group == group; };
      state.handle_count -= std::ranges::remove_if(all, same).size();
      return true;
    }
    if (value.kind != Kind::object || !next(state.handles, state.handle_count)) return false;
    state.handles[state.handle_count - 1].group = group;
    return true;
  }
};

struct EventTaker {
  ServiceEvent& event;

  bool take(std::string_view path, const Value& value) noexcept {
    if (path == "name") return put(value, event.name);
    if (path == "data/device_id") return put(value, event.device_id);
    if (path == "data/safety_type") return put(value, event.safety_type);
    return true;
  }
};

}  // namespace

bool parse_state(std::string_view text, ServiceState& state) {
  state.arm_count = 0;
  state.handle_count = 0;
  StateTaker taker{state};
  return read(text, taker);
}

bool parse_event(std::string_view text, ServiceEvent& event) {
  event = {};
  EventTaker taker{event};
  return read(text, taker);
}

namespace {

/// Text that grows in a fixed buffer, whose size its callers have counted.
class Writer {
 public:
  explicit Writer(MessageBuffer& buffer) noexcept : buffer_(buffer) {}

  Writer& operator<<(std::string_view text) noexcept {
    const std::size_t size = std::min(text.size(), buffer_.size() - size_);
    std::copy_n(text.begin(), size, buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += size;
    return *this;
  }
  Writer& operator<<(double force_n) noexcept {
    constexpr double kMostN = 100;
    constexpr int kDecimals = 4;
    const double sent = std::abs(force_n) <= kMostN ? force_n : 0;  // not finite: 0
    const auto [end, error] = std::to_chars(buffer_.data() + size_, buffer_.data() + buffer_.size(),
                                            sent, std::chars_format::fixed, kDecimals);
    size_ = static_cast<std::size_t>(end - buffer_.data());
    return *this;
  }
  [[nodiscard]] std::string_view text() const noexcept { return {buffer_.data(), size_}; }

 private:
  MessageBuffer& buffer_;
  std::size_t size_ = 0;
};

constexpr std::string_view kProfile =
    R"("session":{"configure":{"profile":{"name":"org.kerf:servo"}}},)";
constexpr std::string_view kFullState = R"("session":{"force_render_full_state":{}},)";

}  // namespace

std::string_view force_message(const ShortText& device_id, ForceKey key,
                               const std::array<double, 3>& force_n, Extra extra,
                               MessageBuffer& buffer) noexcept {
  Writer out(buffer);
  out << "{";
  if (extra == Extra::profile) out << kProfile;
  if (extra == Extra::full_state) out << kFullState;
  out << R"("inverse3":[{"device_id":")" << device_id.view()
      << R"(","commands":{"set_cursor_force":{")" << (key == ForceKey::vector ? "vector" : "values")
      << R"(":{"x":)" << force_n[0] << R"(,"y":)" << force_n[1] << R"(,"z":)" << force_n[2]
      << "}}}}]}";
  return out.text();
}

std::string_view probe_message(const ShortText& device_id, MessageBuffer& buffer) noexcept {
  Writer out(buffer);
  out << R"({"inverse3":[{"device_id":")" << device_id.view()
      << R"(","commands":{"probe_position":{}}}]})";
  return out.text();
}

}  // namespace kerf::inverse3
