// SPDX-License-Identifier: Apache-2.0
// OpenIGTLink as 3D Slicer reads it: a client on libopenigtlink, which puts the world together by
// the rules of Slicer's own converter.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlMessageHeader.h>
#include <igtlSensorMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>

#include "bridge/igtl/igtl_messages.hpp"
#include "bridge/igtl/igtl_output.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/segment/server.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/segment/segment_support.hpp"
#include "tests/servo/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::igtl_test {

using namespace kerf::bridge;
using namespace kerf::test;
using std::chrono::milliseconds;

namespace {

using Place = std::array<double, 3>;

/// An image as a client puts it together.
struct Picture {
  VoxelGrid grid;
  std::vector<Density> density;
  std::vector<Label> labels;  ///< of an image of 8 bits
  igtl::Matrix4x4 matrix{};
  std::array<float, 3> spacing{};
  int whole = 0, parts = 0;
  std::size_t part_voxels = 0;  ///< of the largest part

  /// Where Slicer shows a voxel: OpenIGTLink's origin is the middle of the image.
  [[nodiscard]] Place ras_of(double i, double j, double k) const {
    const std::array<double, 3> from_middle{i - (grid.nx - 1) / 2.0, j - (grid.ny - 1) / 2.0,
                                            k - (grid.nz - 1) / 2.0};
    Place place{};
    for (std::size_t row = 0; row < 3; ++row) {
      place[row] = matrix[row][3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[row] += double{matrix[row][axis]} * double{spacing[axis]} * from_middle[axis];
      }
    }
    return place;
  }
};

class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(igtl::ClientSocket::New()) {
    REQUIRE(socket_->ConnectToServer("127.0.0.1", port) == 0);
    socket_->SetReceiveTimeout(20'000);
  }
  ~Client() { socket_->CloseSocket(); }

  /// Takes one message; false at the end of the stream.
  bool take() {
    const igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) !=
        header->GetPackSize()) {
      return false;
    }
    REQUIRE((header->Unpack() & igtl::MessageHeader::UNPACK_HEADER) != 0);
    const std::string type = header->GetDeviceType();
    if (type == "IMAGE") return take_image(header);
    if (type == "TRANSFORM") {
      const auto tool = body<igtl::TransformMessage>(header);
      if (!tool) return false;
      const bool is_first = header->GetDeviceName() == std::string("Tool");
      if (!is_first) REQUIRE(header->GetDeviceName() == std::string("Tool 2"));
      tool->GetMatrix(is_first ? tool_matrix : second_matrix);
      ++(is_first ? poses : second_poses);
      return true;
    }
    REQUIRE(type == "SENSOR");
    const auto sensor = body<igtl::SensorMessage>(header);
    if (!sensor) return false;
    REQUIRE(sensor->GetLength() == 3);
    const bool is_first = header->GetDeviceName() == std::string("Force");
    if (!is_first) REQUIRE(header->GetDeviceName() == std::string("Force 2"));
    for (unsigned int i = 0; i < 3; ++i) {
      (is_first ? force_n : second_force_n)[i] = sensor->GetValue(i);
    }
    const igtl::Unit::Pointer unit = igtl::Unit::New();
    unit->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
    CHECK(sensor->GetUnit() == unit->Pack());
    ++(is_first ? forces : second_forces);
    return true;
  }
  template <class Until>
  void take_until(const Until& until) {
    for (int messages = 0; messages < 5000 && !until(); ++messages) REQUIRE(take());
    CHECK(until());
  }
  void say(const std::string& bytes) {
    socket_->Send(bytes.data(), static_cast<int>(bytes.size()));
  }

  std::map<std::string, Picture> pictures;
  igtl::Matrix4x4 tool_matrix{}, second_matrix{};
  Place force_n{}, second_force_n{};
  int poses = 0, forces = 0, second_poses = 0, second_forces = 0;

 private:
  template <class Message>
  typename Message::Pointer body(const igtl::MessageHeader::Pointer& header) {
    auto message = Message::New();
    const igtl::MessageHeader::Pointer as_it_came = header;
    message->SetMessageHeader(as_it_came);
    message->AllocatePack();
    if (message->GetPackBodySize() !=
        socket_->Receive(message->GetPackBodyPointer(), message->GetPackBodySize())) {
      return nullptr;
    }
    CHECK((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0);  // with its checksum
    return message;
  }

  bool take_image(const igtl::MessageHeader::Pointer& header) {
    const auto image = body<igtl::ImageMessage>(header);
    if (!image) return false;
    Picture& picture = pictures[header->GetDeviceName()];
    int size[3], part[3], at[3];
    image->GetDimensions(size);
    image->GetSubVolume(part, at);
    const bool is_labels = image->GetScalarType() == igtl::ImageMessage::TYPE_UINT8;
    if (!is_labels) REQUIRE(image->GetScalarType() == igtl::ImageMessage::TYPE_UINT16);
    REQUIRE(image->GetEndian() == igtl::ImageMessage::ENDIAN_LITTLE);
    CHECK(image->GetCoordinateSystem() == igtl::ImageMessage::COORDINATE_RAS);
    image->GetMatrix(picture.matrix);
    image->GetSpacing(picture.spacing.data());
    const VoxelGrid grid{size[0], size[1], size[2]};
    const bool whole = part[0] == size[0] && part[1] == size[1] && part[2] == size[2];
    if (!(picture.grid == grid)) {
      REQUIRE(whole);  // else the rest would be what it is
      picture.grid = grid;
      picture.density.assign(grid.voxel_count(), 0);
    }
    (whole ? picture.whole : picture.parts) += 1;
    if (is_labels) {
      REQUIRE(whole);
      const auto* const first = static_cast<const Label*>(image->GetScalarPointer());
      picture.labels.assign(first, first + grid.voxel_count());
      return true;
    }
    const auto voxels = static_cast<std::size_t>(part[0]) * static_cast<std::size_t>(part[1]) *
                        static_cast<std::size_t>(part[2]);
    if (!whole) picture.part_voxels = std::max(picture.part_voxels, voxels);
    const auto* from = static_cast<const char*>(image->GetScalarPointer());
    const std::size_t row = static_cast<std::size_t>(part[0]) * sizeof(Density);
    for (int z = at[2]; z < at[2] + part[2]; ++z) {
      for (int y = at[1]; y < at[1] + part[1]; ++y, from += row) {
        std::memcpy(&picture.density[grid.index(at[0], y, z)], from, row);
      }
    }
    return true;
  }

  igtl::ClientSocket::Pointer socket_;
};

std::string scene_text(const std::vector<std::string>& names) {
  std::string text = R"({"volumes":[)";
  for (const std::string& name : names) {
    if (text.back() == '}') text += ',';
    text += R"({"name":")" + name + R"("})";
  }
  return text + "]}";
}

IgtlOptions options_for(const char* name) {
  IgtlOptions options;
  options.port = 0;
  options.name = name;
  return options;
}

TickRecord record_at(const Place& mm, const std::array<float, 4>& orientation,
                     const Place& force_n) {
  TickRecord record{};
  for (std::size_t i = 0; i < 3; ++i) {
    record.position_mm[i] = mm[i];
    record.commanded_force_n[i] = static_cast<float>(force_n[i]);
  }
  for (std::size_t i = 0; i < 4; ++i) record.orientation[i] = orientation[i];
  return record;
}

void publish_tick(SegmentWriter& writer, Tick tick, TickRecord record) {
  writer.begin_tick(tick);
  record.tick = tick;
  writer.publish_state(record);
  writer.end_tick(tick * 1'000'000);
}

bool near(const Place& a, const Place& b) {
  return std::abs(a[0] - b[0]) < 1e-4 && std::abs(a[1] - b[1]) < 1e-4 &&
         std::abs(a[2] - b[2]) < 1e-4;
}

}  // namespace

TEST_CASE("volumes, tool and force lie in RAS as they lie in the scene" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  NoiseVolume first({12, 9, 7}), second({8, 8, 8}, 2);
  SegmentSpec spec = spec_of(first);
  spec.volumes.push_back(second.spec());
  spec.scene_json = scene_text({"tooth", "bone"});
  // A quarter turn about z: x goes to y.
  const auto half = static_cast<float>(std::sqrt(0.5));
  spec.volumes[0].orientation = {0, 0, half, half};
  spec.volumes[0].spacing_mm = {0.5, 0.25, 2};
  spec.volumes[0].origin_mm = {10, 20, 30};
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentServer server("igtl", writer);
  publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, half, half}, {0.5, 0.25, -1}));
  const IgtlOutput output(options_for("igtl"));
  Client client(output.port());
  client.take_until([&] { return client.pictures.size() == 2 && client.poses > 0; });

  const Picture& tooth = client.pictures.at("tooth");
  CHECK(tooth.density == first.density);
  CHECK(client.pictures.at("bone").density == second.density);
  // World (x, y, z) is RAS (-x, -y, z); a step along i is a step along the world's y.
  CHECK(near(tooth.ras_of(0, 0, 0), {-10, -20, 30}));
  CHECK(near(tooth.ras_of(1, 0, 0), {-10, -20.5, 30}));
  CHECK(near(tooth.ras_of(0, 1, 0), {-10 + 0.25, -20, 30}));
  CHECK(near(tooth.ras_of(11, 8, 6), {-10 + 8 * 0.25, -20 - 11 * 0.5, 30 + 6 * 2}));

  const igtl::Matrix4x4& m = client.tool_matrix;
  CHECK(near({m[0][3], m[1][3], m[2][3]}, {-1, -2, 3}));
  CHECK(near({m[0][0], m[1][0], m[2][0]}, {0, -1, 0}));  // the tool's x along the world's y
  CHECK(near({m[0][1], m[1][1], m[2][1]}, {1, 0, 0}));
  CHECK(near({m[0][2], m[1][2], m[2][2]}, {0, 0, 1}));
  CHECK(client.force_n == Place{-0.5, -0.25, -1});
}

TEST_CASE("a second arm has a tool and a force of its own name" * doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentSpec spec = spec_of(volume);
  SUBCASE("two arms") {
    spec.arms = 2;
  }
  SUBCASE("one arm") {
    spec.arms = 1;
  }
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentServer server("igtl", writer);
  writer.begin_tick(1);
  if (spec.arms == 2) {
    writer.publish_state(record_at({-4, 5, 6}, {0, 0, 0, 1}, {0, 2, 0}), 1);
  }
  writer.publish_state(record_at({1, 2, 3}, {0, 0, 0, 1}, {0.5, 0.25, -1}));
  writer.end_tick(1'000'000);
  const IgtlOutput output(options_for("igtl"));
  Client client(output.port());
  client.take_until([&] { return client.poses > 3 && client.forces > 3; });
  CHECK(near({client.tool_matrix[0][3], client.tool_matrix[1][3], client.tool_matrix[2][3]},
             {-1, -2, 3}));
  CHECK(client.force_n == Place{-0.5, -0.25, -1});
  if (spec.arms == 1) {
    CHECK(client.second_poses + client.second_forces == 0);
    return;
  }
  client.take_until([&] { return client.second_poses > 2 && client.second_forces > 2; });
  CHECK(near({client.second_matrix[0][3], client.second_matrix[1][3], client.second_matrix[2][3]},
             {4, -5, 6}));
  CHECK(client.second_force_n == Place{0, -2, 0});
}

TEST_CASE("an arm that is nowhere yet has no tool, the other one has, whichever it is" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentSpec spec = spec_of(volume);
  spec.arms = 2;
  for (const std::size_t lost : {0U, 1U}) {
    CAPTURE(lost);
    SegmentWriter writer = SegmentWriter::create(spec);
    const SegmentServer server("igtl", writer);
    writer.begin_tick(1);
    for (const std::size_t arm : {1U, 0U}) {
      const double x = arm == lost ? std::numeric_limits<double>::quiet_NaN() : 4;
      writer.publish_state(record_at({x, 5, 6}, {0, 0, 0, 1}, {0, 2, 0}), arm);
    }
    writer.end_tick(1'000'000);
    const IgtlOutput output(options_for("igtl"));
    Client client(output.port());
    client.take_until([&] { return client.forces > 3 && client.second_forces > 3; });
    CHECK((client.poses > 0) == (lost == 1));
    CHECK((client.second_poses > 0) == (lost == 0));
  }
}

TEST_CASE("labels come once a client and a run, beside their volume and where it lies" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  NoiseVolume tooth({12, 9, 7}), bare({8, 8, 8}, 2);
  for (std::size_t i = 0; i < tooth.density.size(); ++i) {
    tooth.labels.push_back(static_cast<Label>(i * 7 % 256));
  }
  const IgtlOutput output(options_for("igtl"));
  Client early(output.port());
  for (int life = 0; life < 2; ++life) {
    SegmentSpec spec = spec_of(tooth);
    spec.volumes.push_back(bare.spec());
    spec.volumes[0].spacing_mm = {0.5, 0.25, 2};
    spec.scene_json = scene_text({"tooth", "bone"});
    SegmentWriter writer = SegmentWriter::create(spec);
    const SegmentServer server("igtl", writer);
    publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, 0, 1}, {0, 0, 0}));
    early.take_until([&] { return early.pictures["tooth labels"].whole == life + 1; });
    Client late(output.port());  // of this run alone
    for (Client* const client : {&early, &late}) {
      const int runs = client == &early ? life + 1 : 1;
      client->take_until([&] { return client->pictures["tooth labels"].whole == runs; });
      const Picture& labels = client->pictures.at("tooth labels");
      CHECK(labels.labels == tooth.labels);
      const Picture& density = client->pictures.at("tooth");
      CHECK(density.density == tooth.density);
      CHECK(near(labels.ras_of(1, 2, 3), density.ras_of(1, 2, 3)));
      CHECK(labels.spacing == density.spacing);
    }
    tooth.cut({{2, 2, 2}, {5, 6, 7}});
    writer.begin_tick(2);
    writer.publish_box(0, tooth.density, tooth.grid.box(), 1);
    writer.end_tick(2'000'000);
    for (Client* const client : {&early, &late}) {
      client->take_until([&] { return client->pictures.at("tooth").density == tooth.density; });
      CHECK(client->pictures.at("tooth labels").whole == (client == &early ? life + 1 : 1));
      client->take_until([&] { return client->pictures.count("bone") == 1; });
      CHECK(client->pictures.count("bone labels") == 0);
    }
    writer.set_lifecycle(Lifecycle::clean_end);
  }
}

TEST_CASE("an unknown pose is not sent, and the force is" * doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("igtl", writer);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  publish_tick(writer, 1, record_at({nan, nan, nan}, {0, 0, 0, 1}, {0, 0, 0}));
  const IgtlOutput output(options_for("igtl"));
  Client client(output.port());
  client.take_until([&] { return client.forces > 5; });
  CHECK(client.poses == 0);
}

TEST_CASE("a client rebuilds what is milled and what is reset, from parts, equal by hash" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  LoadedScene scene = half_space_scene(64);
  scene.cut.model = CutModel::preston;
  scene.cut.machinability_mm3_per_s_n = 8;
  SegmentSpec spec;
  const auto first = scene.volumes[0].image.density;
  spec.volumes = {{.grid = scene.volumes[0].image.grid, .density = first, .labels = {}}};
  spec.scene_json = scene_text({"tooth"});
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentServer server("igtl", writer);
  const IgtlOutput output(options_for("igtl"));
  Client client(output.port());
  client.take_until([&] { return client.pictures.count("tooth") == 1; });
  Picture& tooth = client.pictures.at("tooth");
  CHECK(tooth.density == first);

  ArmedServo armed(scene, {0, 5, 0});
  Tick tick = 0;
  const auto step = [&](double x_mm, double y_mm) {
    const ServoOutput out = armed.step(x_mm, y_mm, 0);
    writer.begin_tick(++tick);
    if (!out.changed[0].empty()) {
      writer.publish_box(0, armed.servo->density(0), out.changed[0],
                         static_cast<std::uint32_t>(out.removed_steps));
    }
    writer.publish_state(record_at({x_mm, y_mm, 0}, {0, 0, 0, 1}, out.commanded_force_n));
    writer.end_tick(tick * 1'000'000);
    if (tick % 20 == 0) REQUIRE(client.take());
  };
  for (int ms = 0; ms < 1200; ++ms) step(-2 + 0.003 * ms, std::max(-0.5, 5 - 0.02 * ms));
  const std::uint64_t milled = density_hash(armed.servo->density(0));
  REQUIRE(milled != density_hash(first));
  client.take_until([&] { return density_hash(tooth.density) == milled; });
  CHECK(tooth.whole == 1);
  CHECK(tooth.parts > 0);
  CHECK(tooth.part_voxels < first.size() / 4);

  for (int ms = 0; ms < 300; ++ms) step(1.6, -0.5 + 0.02 * ms);
  CHECK(armed.servo->apply({.kind = ServoCommand::Kind::reset}));
  for (int ms = 0; ms < 300; ++ms) step(1.6, 5.5);
  client.take_until([&] { return tooth.density == first; });
}

TEST_CASE("a client that reads nothing is dropped, and one that chatters is not heard" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({208, 208, 208});  // more than sockets hold
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("igtl", writer);
  publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, 0, 1}, {0, 0, 0}));
  IgtlOptions options = options_for("igtl");
  options.patience = milliseconds(300);
  const IgtlOutput output(options);
  Client deaf(output.port()), chatty(output.port());
  std::string noise(200'000, '\xff');
  noise.replace(0, 10, "\0\2GET_IMAGE", 10);
  chatty.say(noise);
  chatty.take_until([&] { return chatty.pictures.size() == 1; });
  CHECK(density_hash(chatty.pictures.at("volume 1").density) == density_hash(volume.density));
  const int before = chatty.forces;
  chatty.take_until([&] { return chatty.forces > before + 60; });  // a second; it goes on
  int messages = 0;
  while (deaf.take()) ++messages;  // what its socket still held, at most
  CHECK(messages < 20);
  CHECK(deaf.pictures.empty());
}

TEST_CASE("one client too many is let out again" * doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("igtl", writer);
  publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, 0, 1}, {0, 0, 0}));
  const IgtlOutput output(options_for("igtl"));
  std::vector<std::unique_ptr<Client>> clients;
  for (std::size_t i = 0; i < IgtlOutput::kMaxClients; ++i) {
    clients.push_back(std::make_unique<Client>(output.port()));
    clients.back()->take_until([&] { return clients.back()->pictures.size() == 1; });
  }
  Client late(output.port());
  CHECK_FALSE(late.take());
  clients.pop_back();
  for (;;) {  // until it is noticed
    Client next(output.port());
    if (!next.take()) continue;
    break;
  }
  for (auto& client : clients) CHECK(client->take());
}

TEST_CASE("a controller may come late, go, and come again with other volumes" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const IgtlOutput output(options_for("igtl"));
  Client client(output.port());
  for (const std::int32_t edge : {8, 16, 8}) {
    const NoiseVolume volume({edge, edge, edge}, static_cast<std::uint32_t>(edge));
    SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer server("igtl", writer);
    publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, 0, 1}, {0, 0, 0}));
    client.take_until([&] { return client.pictures["volume 1"].density == volume.density; });
    writer.set_lifecycle(Lifecycle::clean_end);
  }
}

TEST_CASE("the port is free again at once, and one in use is one line" *
          doctest::test_suite("network")) {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("igtl", writer);
  publish_tick(writer, 1, record_at({1, 2, 3}, {0, 0, 0, 1}, {0, 0, 0}));
  IgtlOptions options = options_for("igtl");
  for (int life = 0; life < 3; ++life) {
    const IgtlOutput output(options);
    options.port = output.port();
    Client client(options.port);  // the output closes first: its end waits in TIME_WAIT
    REQUIRE(client.take());
    try {
      const IgtlOutput second(options);
      FAIL("a second one listens");
    } catch (const std::runtime_error& error) {
      CHECK(std::string(error.what()).find("Address already in use; name another port") !=
            std::string::npos);
    }
  }
  options.host = "192.0.2.1";  // of no machine
  CHECK_THROWS_AS(IgtlOutput{options}, std::runtime_error);
  options.host = "no such host";
  CHECK_THROWS_AS(IgtlOutput{options}, std::runtime_error);
}

TEST_CASE("device names are the scene's, at most 20 bytes, and no two alike") {
  SegmentInfo segment;
  segment.volumes.resize(5);
  segment.scene_json = scene_text({"tooth", "tooth", "a molar of the upper jaw",
                                   "a molar of the upper lip", "häääääääääääääääää"});
  const auto names = device_names(segment);
  CHECK(names == std::vector<std::string>{"tooth", "tooth 2", "a molar of the upper",
                                          "a molar of the upp 4", "häääääääää"});
  CHECK(label_names(names) == std::vector<std::string>{"tooth labels", "tooth 2 labels",
                                                       "a molar of th labels",
                                                       "a molar of  4 labels", "hääääää labels"});
  CHECK(label_names({"a", "a labels"}) ==
        std::vector<std::string>{"a 1 labels", "a labels labels"});
  segment.scene_json = "{";
  CHECK(device_names(segment)[4] == "volume 5");
}

}  // namespace kerf::igtl_test
