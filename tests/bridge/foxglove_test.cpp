// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/foxglove/foxglove_session.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"
#include "tests/json.hpp"
#include "tests/segment/segment_support.hpp"

namespace kerf::foxglove_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

constexpr std::uint64_t kStartNs = 5'000'000'000;

/// A controller that publishes ticks, each a millisecond after the one before it.
struct Run {
  explicit Run(std::uint32_t tick_ns = 1'000'000, std::size_t arms = 1)
      : writer(SegmentWriter::create(spec(tick_ns, arms))),
        reader(SegmentReader::map(writer.fd())) {}

  [[nodiscard]] SegmentSpec spec(std::uint32_t tick_ns, std::size_t arms) const {
    SegmentSpec out = spec_of(volume);
    out.arms = arms;
    out.tick_ns = tick_ns;
    return out;
  }
  void tick(double x_mm = 12) {
    TickRecord record{};
    record.tick = ++ticks;
    record.start_ns = kStartNs + ticks * 1'000'000;
    record.position_mm[0] = x_mm;
    record.commanded_force_n[1] = 0.5F;
    record.tip_torque_n_mm[2] = 250;
    writer.begin_tick(ticks);
    if (reader.info().arms > 1) {
      TickRecord second = record;
      second.position_mm[0] = -x_mm;
      writer.publish_state(second, 1);
    }
    writer.publish_state(record);
    writer.end_tick(ticks);
  }
  NoiseVolume volume{{8, 8, 8}};
  SegmentWriter writer;
  SegmentReader reader;
  Tick ticks = 0;
};

/// What a client sees: binary messages by opcode and subscription, and texts.
struct Client {
  FoxgloveSession session{"tooth"};
  std::vector<ReadJson> texts;
  struct Data {
    std::uint32_t id;
    std::uint64_t time_ns, clock_ns;
    std::string payload;
  };
  std::vector<Data> data;
  std::uint64_t clock_ns = 0;
  std::int64_t now_ns = 1;

  void say(const std::string& text) { session.hear(true, text); }
  void take(const Run* run, bool ended = false) {
    FoxgloveMessage message;
    while (session.next(now_ns, run != nullptr ? &run->reader : nullptr, ended, message)) {
      const std::string& bytes = message.bytes;
      const auto number = [&bytes](std::size_t at, auto value) {
        REQUIRE(bytes.size() >= at + sizeof value);
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
      };
      if (message.is_text) {
        texts.emplace_back(Json::parse(bytes));
      } else if (bytes[0] == 2) {
        clock_ns = number(1, std::uint64_t{});
        CHECK(bytes.size() == 9);
      } else {
        REQUIRE(bytes[0] == 1);
        data.push_back(
            {number(1, std::uint32_t{}), number(5, std::uint64_t{}), clock_ns, bytes.substr(13)});
      }
    }
  }
  /// Level and text of the last status.
  [[nodiscard]] std::string status() const {
    const ReadJson last = texts.back();
    if (!(last["op"] == "status")) return "none";
    return std::to_string(last["level"].get<int>()) + " " + last["message"].get<std::string>();
  }
};

constexpr const char* kAll =
    R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":1},{"id":20,"channelId":2},
        {"id":30,"channelId":3}]})";

template <class Number>
Number at_end(const std::string& payload, std::size_t from_end) {
  Number value;
  std::memcpy(&value, payload.data() + payload.size() - from_end, sizeof value);
  return value;
}

}  // namespace

TEST_CASE("the client's first sub-protocol that is known is chosen") {
  CHECK(foxglove_protocol("foxglove.sdk.v1") == "foxglove.sdk.v1");
  CHECK(foxglove_protocol("foxglove.websocket.v1, foxglove.sdk.v1") == "foxglove.websocket.v1");
  CHECK(foxglove_protocol("foxglove.sdk.v2 ,\tfoxglove.sdk.v1\t,x") == "foxglove.sdk.v1");
  for (const char* none :
       {"", ",", " , ,", "foxglove.sdk", "Foxglove.sdk.v1", "foxglove.sdk.v1x"}) {
    CHECK(foxglove_protocol(none).empty());
  }
}

TEST_CASE("a client is greeted with the channels of the log's export") {
  const Run run;
  Client client;
  client.take(&run);
  REQUIRE(client.texts.size() == 2);
  const ReadJson &info = client.texts[0], &channels = client.texts[1];
  CHECK(info["op"] == "serverInfo");
  CHECK(info["name"] == "kerf tooth");
  CHECK(info["capabilities"] == ReadJson(Json::parse(R"(["time"])")));
  CHECK(channels["op"] == "advertise");
  REQUIRE(channels["channels"].size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const ReadJson one = channels["channels"][i];
    CHECK(one["id"] == i + 1);
    CHECK(one["topic"] == ros_channels()[i].topic);
    CHECK(one["schema"] == ros_channels()[i].definition);
    CHECK(one["encoding"] == "cdr");
    CHECK(one["schemaEncoding"] == "ros2msg");
  }
}

TEST_CASE("a subscription gets every tick from then on, with the servo's time before it") {
  Run run;
  Client client;
  run.tick();
  client.take(&run);
  client.say(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})");
  for (int i = 0; i < 30; ++i) run.tick();
  client.take(&run);
  REQUIRE(client.data.size() == 30);
  RosMessages messages(1'000'000);
  TickRecord record;
  for (std::size_t i = 0; i < 30; ++i) {
    CAPTURE(i);
    REQUIRE(run.reader.state_at(i + 1, record) == ReadState::ok);
    CHECK(client.data[i].id == 7);
    CHECK(client.data[i].time_ns == kStartNs + (i + 2) * 1'000'000);
    CHECK(client.data[i].clock_ns == client.data[i].time_ns);
    CHECK(client.data[i].payload == messages.message(ros_tick, record));
  }
}

TEST_CASE("a second arm's channels come with its run, and its messages with each tick") {
  Run one;
  Run two(1'000'000, 2);
  Client client;
  client.take(&one);
  CHECK(client.texts.size() == 2);
  client.say(R"({"op":"subscribe","subscriptions":[{"id":4,"channelId":4}]})");
  client.take(&one);
  CHECK(client.status() ==
        "2 subscribe: id 4, channelId 4: no such channel; 1 to 3 are advertised");
  client.take(&two);
  const ReadJson channels = client.texts.back();
  CHECK(channels["op"] == "advertise");
  REQUIRE(channels["channels"].size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(channels["channels"][i]["id"] == i + 4);
    CHECK(channels["channels"][i]["topic"] == ros_channels(1)[i].topic);
    CHECK(ros_channels(1)[i].topic != ros_channels(0)[i].topic);
  }
  client.say(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":4,"channelId":4},
                {"id":6,"channelId":6}]})");
  for (int i = 0; i < 10; ++i) two.tick();
  client.take(&two);
  CHECK(client.data.size() == 21);
  RosMessages messages(1'000'000);
  TickRecord first, second;
  REQUIRE(two.reader.state_at(9, first) == ReadState::ok);
  REQUIRE(two.reader.state_at(9, second, 1) == ReadState::ok);
  const auto* const last = &client.data[18];  // of the tenth tick
  CHECK(last[0].id == 1);
  CHECK(last[0].payload == messages.message(ros_tick, first));
  CHECK(last[1].id == 4);
  CHECK(last[1].payload == messages.message(ros_tick, second, 1));
  CHECK(last[2].id == 6);
  CHECK(last[2].payload == messages.message(ros_force, second, 1));
  CHECK(last[2].payload.find("device_2") != std::string::npos);
  CHECK(last[2].clock_ns == last[0].clock_ns);
  client.take(&one);  // the next run has one arm: its channels are those that were there
  one.tick();
  client.take(&one);
  CHECK(client.data.size() == 22);
  CHECK(client.data.back().id == 1);
  const auto advertised = [&] {
    return std::ranges::count_if(client.texts,
                                 [](const ReadJson& text) { return text["op"] == "advertise"; });
  };
  CHECK(advertised() == 2);
  client.take(&two);  // nor does one with two have to say them again
  two.tick();
  client.take(&two);
  CHECK(client.data.size() == 24);
  CHECK(advertised() == 2);
}

TEST_CASE("tip and force come a hundred times a second, the tip from docking on") {
  Run run;
  Client client;
  client.take(&run);
  client.say(kAll);
  for (int i = 0; i < 50; ++i) run.tick(std::numeric_limits<double>::quiet_NaN());
  for (int i = 0; i < 50; ++i) run.tick();
  client.take(&run);
  std::vector<Client::Data> tips, forces;
  for (const auto& one : client.data) {
    if (one.id == 20) tips.push_back(one);
    if (one.id == 30) forces.push_back(one);
  }
  REQUIRE(tips.size() == 5);
  REQUIRE(forces.size() == 10);
  CHECK(client.data.size() == 115);
  CHECK(at_end<double>(tips[0].payload, 56) == 0.012);  // x of the position, in metres
  CHECK(at_end<double>(forces[0].payload, 40) == 0.5);  // y of the force
  CHECK(at_end<double>(forces[0].payload, 8) == 0.25);  // z of the torque, in N m
}

TEST_CASE("an unsubscribed channel sends nothing, and its id is free again") {
  Run run;
  Client client;
  client.take(&run);
  client.say(kAll);
  run.tick();
  client.take(&run);
  client.say(R"({"op":"unsubscribe","subscriptionIds":[10,20,30]})");
  for (int i = 0; i < 10; ++i) run.tick();
  client.take(&run);
  CHECK(client.data.size() == 1);
  client.say(R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":3}]})");
  for (int i = 0; i < 10; ++i) run.tick();
  client.take(&run);
  REQUIRE(client.data.size() == 2);
  CHECK(client.data.back().id == 10);
  CHECK(client.texts.size() == 2);  // no status
}

TEST_CASE("what is wrong or refused is answered with a status, and the rest goes on") {
  Run run;
  Client client;
  client.take(&run);
  client.say(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})");
  struct Wrong {
    const char *message, *answer;
  };
  const Wrong all[] = {
      {"{", "2 no JSON at character 2 in \"{\"; kerf understands subscribe and unsubscribe"},
      {"", "2 no JSON at character 1 in \"\"; kerf understands subscribe and unsubscribe"},
      {"[1]", "2 not an object in \"[1]\"; kerf understands subscribe and unsubscribe"},
      {"{}", "2 \"op\" is missing in \"{}\"; kerf understands subscribe and unsubscribe"},
      {R"({"op":1})", R"(2 not a text in "{"op":1}"; kerf understands subscribe and unsubscribe)"},
      {R"({"op":"subscribe"})",
       R"(2 "subscriptions" is missing in "{"op":"subscribe"}"; kerf understands subscribe and )"
       "unsubscribe"},
      {R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":4}]})",
       "2 subscribe: id 2, channelId 4: no such channel; 1 to 3 are advertised"},
      {R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":0}]})",
       "2 subscribe: id 2, channelId 0: no such channel; 1 to 3 are advertised"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]})",
       "2 subscribe: id 1, channelId 2: the id is in use; take another one"},
      {R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":1}]})",
       "2 subscribe: id 2, channelId 1: subscribed already, by id 1; unsubscribe that first"},
      {R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
       R"(2 above 4294967295 in "{"op":"subscribe","subscriptions":[{"id"..."; kerf understands )"
       "subscribe and unsubscribe"},
      {R"({"op":"unsubscribe","subscriptionIds":[9]})",
       "1 unsubscribe: 9 is no id of a subscription"},
      {R"({"op":"advertise","channels":[]})",
       "2 advertise is refused: kerf only sends, and has its three channels alone"},
      {R"({"op":"setParameters","parameters":[]})",
       "2 setParameters is refused: kerf only sends, and has its three channels alone"},
      {R"({"op":"dance"})",
       R"(1 op "dance" is not known; kerf understands subscribe and unsubscribe)"},
  };
  for (const Wrong& one : all) {
    client.say(one.message);
    client.take(&run);
    CHECK(client.status() == one.answer);
  }
  client.session.hear(false, std::string("\1\0\0\0\0data", 9));
  client.take(&run);
  CHECK(client.status() == "2 a binary message is refused: kerf only sends, it takes no data");
  client.say(std::string(4096, '['));
  client.take(&run);
  CHECK(client.status().starts_with("2 no JSON at character 4097 in \"[[[["));
  run.tick();
  client.take(&run);
  CHECK(client.data.size() == 1);
}

TEST_CASE("answers that a client does not take are bounded") {
  const Run run;
  Client client;
  for (int i = 0; i < 1000; ++i) client.say("{");
  client.take(&run);
  CHECK(client.texts.size() == FoxgloveSession::kMostAnswers + 2);
}

TEST_CASE("what a client that falls behind lacks is left out, and it is told so at times") {
  Run run;
  Client client;
  client.now_ns = 10 * FoxgloveSession::kToldNs;
  client.take(&run);
  client.say(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})");
  for (int i = 0; i < 133; ++i) run.tick();
  client.take(&run);
  CHECK(client.data.size() == 133);
  CHECK(client.texts.size() == 2);
  for (int i = 0; i < 134; ++i) run.tick();
  client.take(&run);
  REQUIRE(client.data.size() == 2 * 133);
  CHECK(client.data[133].time_ns == kStartNs + 135 * 1'000'000);
  CHECK(client.data.back().time_ns == kStartNs + 267 * 1'000'000);
  CHECK(client.status() == "1 ticks left out: 1; the link or this program is too slow");
  for (int i = 0; i < 100'000; ++i) run.tick();  // far more than the ring has
  client.take(&run);
  CHECK(client.data.size() == 3 * 133);
  CHECK(client.texts.size() == 3);
  client.now_ns += FoxgloveSession::kToldNs;
  run.tick();
  client.take(&run);
  CHECK(client.data.size() == 3 * 133 + 1);
  CHECK(client.status() == "1 ticks left out: 99867; the link or this program is too slow");
}

TEST_CASE("of a servo that is faster than 1 kHz a thousand ticks a second remain") {
  Run run(250'000);
  Client client;
  client.take(&run);
  client.say(kAll);
  for (int i = 0; i < 400; ++i) run.tick();
  client.take(&run);
  CHECK(client.data.size() == 100 + 10 + 10);
}

TEST_CASE("a client may come before the controller, and stays when another run follows") {
  Client client;
  client.take(nullptr);
  REQUIRE(client.texts.size() == 3);
  CHECK(client.status() == "1 no controller \"tooth\" yet; its ticks come when it runs");
  client.say(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})");
  client.take(nullptr);
  CHECK(client.texts.size() == 3);
  std::string session;
  for (int i = 0; i < 2; ++i) {
    Run run;
    run.tick();
    client.take(&run);
    REQUIRE(client.texts.back()["op"] == "serverInfo");
    const auto its = client.texts.back()["sessionId"].get<std::string>();
    CHECK(its != session);
    session = its;
    run.tick();
    client.take(&run, true);
    client.take(&run, true);
    CHECK(client.data.size() == static_cast<std::size_t>(i) + 1);
    CHECK(client.status() == "1 controller \"tooth\" has ended; the next run follows");
  }
  CHECK(client.texts.size() == 3 + 2 * 2);
}

}  // namespace kerf::foxglove_test
