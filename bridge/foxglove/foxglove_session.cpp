// SPDX-License-Identifier: Apache-2.0
#include "bridge/foxglove/foxglove_session.hpp"

#include <algorithm>
#include <utility>

#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::bridge {
namespace {

constexpr std::array<std::string_view, 2> kProtocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr std::uint8_t kMessageData = 1, kTime = 2;  // opcodes of binary messages
constexpr std::uint64_t kLeastTickNs = 1'000'000;    // between two ticks that are sent

// Operations of capabilities that this server does not have.
constexpr std::array<std::string_view, 10> kRefused{"advertise",
                                                    "unadvertise",
                                                    "getParameters",
                                                    "setParameters",
                                                    "subscribeParameterUpdates",
                                                    "unsubscribeParameterUpdates",
                                                    "subscribeConnectionGraph",
                                                    "unsubscribeConnectionGraph",
                                                    "fetchAsset",
                                                    "playbackControl"};

/// The id of a channel in messages: 1 + its index among the channels of the first arm, then of the
/// second.
constexpr std::uint32_t id_of(std::size_t channel) noexcept {
  return static_cast<std::uint32_t>(channel + 1);
}

Json advertisement(std::size_t arm) {
  Json list;
  std::size_t channel = arm * kRosTopics;
  for (const RosChannel& one : ros_channels(arm)) {
    list.push_back({{"id", id_of(channel++)},
                    {"topic", one.topic},
                    {"encoding", kRosEncoding},
                    {"schemaName", one.schema},
                    {"schemaEncoding", kRosSchemaEncoding},
                    {"schema", one.definition}});
  }
  return {{"op", "advertise"}, {"channels", std::move(list)}};
}

template <class Number>
void put(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// At most the first 40 bytes of `text`, in quotes and on one line.
std::string quoted_start(std::string_view text) {
  constexpr std::size_t kMost = 40;
  return '"' + escaped(text.substr(0, kMost)) + (text.size() > kMost ? "...\"" : "\"");
}

}  // namespace

std::string_view foxglove_protocol(std::string_view offered) noexcept {
  constexpr std::string_view kBlanks = " \t";
  while (!offered.empty()) {
    const std::size_t comma = std::min(offered.find(','), offered.size());
    std::string_view one = offered.substr(0, comma);
    one.remove_prefix(std::min(one.find_first_not_of(kBlanks), one.size()));
    one = one.substr(0, one.find_last_not_of(kBlanks) + 1);
    const auto* const known = std::ranges::find(kProtocols, one);
    if (known != kProtocols.end()) return *known;
    offered.remove_prefix(std::min(comma + 1, offered.size()));
  }
  return {};
}

FoxgloveSession::FoxgloveSession(std::string controller) : controller_(std::move(controller)) {}

void FoxgloveSession::answer(Level level, const std::string& text) {
  if (texts_.size() >= kMostAnswers) return;  // the client does not read them
  const Json status{
      {"op", "status"}, {"level", static_cast<std::uint8_t>(level)}, {"message", text}};
  texts_.push_back(status.canonical());
}

void FoxgloveSession::hear(bool is_text, std::string_view message) {
  if (!is_text) {
    return answer(Level::error, "a binary message is refused: kerf only sends, it takes no data");
  }
  try {
    obey(message);
  } catch (const JsonError& error) {
    answer(Level::error, std::string(error.what()) + " in " + quoted_start(message) +
                             "; kerf understands subscribe and unsubscribe");
  }
}

void FoxgloveSession::obey(std::string_view text) {
  const Json message = Json::parse(text);
  const auto op = message.at("op").get<std::string>();
  if (op == "subscribe") {
    for (const Json& one : message.at("subscriptions")) {
      subscribe(one.at("id").get<std::uint32_t>(), one.at("channelId").get<std::uint32_t>());
    }
  } else if (op == "unsubscribe") {
    for (const Json& id : message.at("subscriptionIds")) unsubscribe(id.get<std::uint32_t>());
  } else if (std::ranges::find(kRefused, op) != kRefused.end()) {
    answer(Level::error, op + " is refused: kerf only sends, and has its " +
                             (arms_ == 1 ? "three" : "six") + " channels alone");
  } else {
    answer(Level::warning,
           "op " + quoted_start(op) + " is not known; kerf understands subscribe and unsubscribe");
  }
}

void FoxgloveSession::subscribe(std::uint32_t id, std::uint32_t channel) {
  const std::string what =
      "subscribe: id " + std::to_string(id) + ", channelId " + std::to_string(channel) + ": ";
  if (channel < id_of(0) || channel > id_of(channels() - 1)) {
    return answer(Level::error,
                  what + "no such channel; 1 to " + std::to_string(channels()) + " are advertised");
  }
  if (std::ranges::find(subscriptions_, id) != subscriptions_.end()) {
    return answer(Level::error, what + "the id is in use; take another one");
  }
  std::optional<std::uint32_t>& own = subscriptions_[channel - id_of(0)];
  if (own) {
    return answer(Level::error, what + "subscribed already, by id " + std::to_string(*own) +
                                    "; unsubscribe that first");
  }
  own = id;
}

void FoxgloveSession::unsubscribe(std::uint32_t id) {
  const auto own = std::ranges::find(subscriptions_, id);
  if (own == subscriptions_.end()) {
    return answer(Level::warning,
                  "unsubscribe: " + std::to_string(id) + " is no id of a subscription");
  }
  own->reset();
}

void FoxgloveSession::greet(const SegmentReader* run) {
  Json metadata{{"kerf", KERF_VERSION}};
  if (run != nullptr) metadata["build"] = run->info().build_id;
  const Json info{{"op", "serverInfo"},
                  {"name", "kerf " + controller_},
                  {"capabilities", Json::List{"time"}},
                  {"sessionId", session_ ? hex64(*session_) : "none"},
                  {"metadata", std::move(metadata)}};
  texts_.push_back(info.canonical());
}

void FoxgloveSession::follow(const SegmentReader* run, bool ended) {
  const bool is_new = run != nullptr && session_ != run->info().session_id;
  const bool is_first = said_ == Said::nothing;
  if (is_new) {
    const SegmentInfo& info = run->info();
    session_ = info.session_id;
    messages_ = RosMessages(info.tick_ns);
    stride_ = std::max<std::uint64_t>(1, kLeastTickNs / info.tick_ns);
    most_behind_ = std::max<std::uint64_t>(
        1, std::min<std::uint64_t>(kBehindNs / info.tick_ns, info.state_slots / 2));
    index_ = run->state_head();
    part_ = kParts;
    left_out_ = 0;
    said_ = Said::runs;
  }
  if (is_new || is_first) greet(run);
  if (is_first) texts_.push_back(advertisement(0).canonical());
  if (is_new && run->info().arms > arms_) {
    arms_ = run->info().arms;
    texts_.push_back(advertisement(1).canonical());
  }
  if (run == nullptr && said_ == Said::nothing) {
    said_ = Said::waits;
    answer(Level::warning,
           "no controller \"" + controller_ + "\" yet; its ticks come when it runs");
  }
  if (run != nullptr && ended && said_ == Said::runs && index_ >= run->state_head()) {
    said_ = Said::ended;
    answer(Level::warning, "controller \"" + controller_ + "\" has ended; the next run follows");
  }
}

bool FoxgloveSession::is_wanted(std::size_t channel) const noexcept {
  const auto& record = records_[channel / kRosTopics];
  const auto topic = static_cast<RosTopic>(channel % kRosTopics);
  return subscriptions_[channel] && record && messages_.has(topic, *record);
}

bool FoxgloveSession::next(std::int64_t now_ns, const SegmentReader* run, bool ended,
                           FoxgloveMessage& out) {
  follow(run, ended);
  for (;;) {
    if (!texts_.empty()) {
      out = {true, std::move(texts_.front())};
      texts_.pop_front();
      return true;
    }
    if (next_of_tick(out)) return true;
    if (run == nullptr || !take_tick(now_ns, *run)) return false;
  }
}

bool FoxgloveSession::next_of_tick(FoxgloveMessage& out) {
  while (part_ < kParts) {
    const std::size_t part = part_++;
    if (part == 0) {
      bool any = false;
      for (std::size_t i = 0; i < kMostChannels; ++i) any = any || is_wanted(i);
      if (!any) continue;
      out = {false, {}};
      put(out.bytes, kTime);
      put(out.bytes, records_[0]->start_ns);
      return true;
    }
    const std::size_t channel = part - 1;
    if (!is_wanted(channel)) continue;
    const std::size_t arm = channel / kRosTopics;
    out = {false, {}};
    put(out.bytes, kMessageData);
    put(out.bytes, *subscriptions_[channel]);
    put(out.bytes, records_[arm]->start_ns);
    out.bytes +=
        messages_.message(static_cast<RosTopic>(channel % kRosTopics), *records_[arm], arm);
    return true;
  }
  return false;
}

bool FoxgloveSession::take_tick(std::int64_t now_ns, const SegmentReader& run) {
  const std::uint64_t head = run.state_head();
  if (std::ranges::none_of(subscriptions_, [](const auto& id) { return id.has_value(); })) {
    index_ = head;  // a subscription starts with the next tick
    return false;
  }
  if (index_ + most_behind_ < head) {
    left_out_ += head - most_behind_ - index_;
    index_ = head - most_behind_;
  }
  while (index_ < head) {
    TickRecord record;
    const ReadState state = run.state_at(index_, record);
    if (state == ReadState::not_yet) return false;
    ++index_;
    if (state != ReadState::ok) {
      ++left_out_;
    } else if (record.tick % stride_ == 0) {
      records_ = {record, run.second_of(record)};
      part_ = 0;
      break;
    }
  }
  if (left_out_ != 0 && now_ns - told_ns_ >= kToldNs) {
    told_ns_ = now_ns;
    answer(Level::warning, "ticks left out: " + std::to_string(std::exchange(left_out_, 0)) +
                               "; the link or this program is too slow");
  }
  return part_ == 0 || !texts_.empty();
}

}  // namespace kerf::bridge
