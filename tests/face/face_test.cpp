// SPDX-License-Identifier: Apache-2.0
// The interface for other programs, by its headers.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>
#include <kerf/hand.hpp>
#include <kerf/law.hpp>
#include <kerf/log.hpp>
#include <kerf/scene.hpp>
#include <kerf/segment.hpp>
#include <kerf/servo.hpp>
#include <kerf/stability.hpp>
#include <kerf/tick.hpp>

#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::face_test {
namespace {

namespace fs = std::filesystem;
using kerf::test::TemporaryFolder;

const std::string kScenes = KERF_SCENES;

/// The law in the comment of kerf/law.hpp.
template <class N>
class Cubic {
 public:
  static constexpr const char* kName = "cubic";
  static constexpr const char* kMeaning = "K d^3";
  static constexpr std::array<kerf::LawSetting, 1> kSettings{
      {{"stiffness_n_per_mm3", "N/mm^3", 0, 10, 0.1, "K"}}};
  struct State {};
  explicit Cubic(const kerf::LawSetup& setup) : k_(setup["stiffness_n_per_mm3"]) {}
  kerf::DeviceVec<typename N::Real> step(const kerf::ForceInput<N>& in, State&) const noexcept {
    const auto d = norm(in.spring_mm);
    const auto k = k_ * d * d;
    return {k * in.spring_mm.x, k * in.spring_mm.y, k * in.spring_mm.z};
  }

 private:
  typename N::Real k_;
};
KERF_REGISTER_FORCE_LAW(Cubic)

kerf::Scene wall(const kerf::Settings& settings = {}) {
  return kerf::Scene::load(kScenes + "/wall.toml", settings);
}

const fs::path kHand = kScenes + "/hands/touch.toml";

template <class Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const kerf::Error& error) {
    return error.what();
  }
  return "no error";
}

bool same(const kerf::TickRecord& a, const kerf::TickRecord& b) {
  return std::string_view(reinterpret_cast<const char*>(&a), sizeof a) ==
         std::string_view(reinterpret_cast<const char*>(&b), sizeof b);
}

}  // namespace

TEST_CASE("a hand presses on a scene, and the servo answers") {
  const kerf::Scene scene = wall({"force.stiffness_n_per_mm=0.6", "force.damping_ns_per_mm=0"});
  CHECK(scene.arms() == 1);
  CHECK(scene.rate_hz() == 1000);
  CHECK(scene.volumes().size() == 1);
  CHECK(scene.over_budget().empty());
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, kHand);
  CHECK(servo.last().tick == 0);
  int contacts = 0;
  for (int i = 1; i <= 2500; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    CHECK(tick.tick == static_cast<std::uint64_t>(i));
    if ((tick.flags & kerf::kFlagContact) == 0 || (tick.flags & kerf::kFlagClamped) != 0) continue;
    if (tick.phase != static_cast<std::uint16_t>(kerf::Phase::active)) continue;
    const double spring =
        std::hypot(tick.proxy_offset_mm[0], tick.proxy_offset_mm[1], tick.proxy_offset_mm[2]);
    const double force =
        std::hypot(tick.contact_force_n[0], tick.contact_force_n[1], tick.contact_force_n[2]);
    CHECK(force == doctest::Approx(0.6 * spring).epsilon(0.01));
    ++contacts;
  }
  CHECK(contacts > 200);
  // The last command has reached the motors a cycle later: the device's own force is that of the
  // servo.
  const auto motor = hand.motor_force_n();
  CHECK(std::abs(motor[1] - servo.last().commanded_force_n[1]) < 0.05);
}

TEST_CASE("a law of one's own runs in the servo") {
  const kerf::Scene scene = wall({R"(force.law={name="cubic", stiffness_n_per_mm3=2})"});
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, kHand);
  double most = 0;
  for (int i = 0; i < 2500; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    const double d =
        std::hypot(tick.proxy_offset_mm[0], tick.proxy_offset_mm[1], tick.proxy_offset_mm[2]);
    const double force =
        std::hypot(tick.contact_force_n[0], tick.contact_force_n[1], tick.contact_force_n[2]);
    most = std::max(most, force);
    if (tick.phase == static_cast<std::uint16_t>(kerf::Phase::active)) {
      CHECK(force == doctest::Approx(2 * d * d * d).epsilon(0.02).scale(0.01));
    }
  }
  CHECK(most > 0.05);
}

TEST_CASE("a state that was kept continues to the same bits, in another servo too") {
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/phantom.toml");
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, kScenes + "/hands/cut_cavity.toml");
  std::vector<kerf::DeviceReport> reports;
  for (int i = 0; i < 1500; ++i) {
    reports.push_back(hand.next(servo.last()));
    servo.step(reports.back());
  }
  const auto kept = servo.keep();
  const auto go_on = [&](kerf::Servo& of) {
    for (int i = 0; i < 800; ++i) of.step(reports[static_cast<std::size_t>(700 + i)]);
    return of.last();
  };
  const kerf::TickRecord first = go_on(servo);
  const std::uint64_t hash = servo.volume_hash();
  servo.restore(kept);
  CHECK(servo.last().tick == 1500);
  CHECK(same(go_on(servo), first));
  kerf::Servo other(scene);
  other.restore(kept);
  CHECK(same(go_on(other), first));
  CHECK(other.volume_hash() == hash);
  kerf::Servo stranger(wall());
  CHECK(error_of([&] { stranger.restore(kept); }) ==
        "restore: the state is of another scene; keep one of this scene");
}

TEST_CASE("a recording is checked, read and replayed, and what was changed in it is found") {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/phantom.toml");
  std::vector<kerf::TickRecord> ticks;
  std::uint64_t output_hash = 0;
  {
    kerf::Servo servo(scene);
    kerf::Hand hand(scene, kScenes + "/hands/cut_cavity.toml");
    kerf::LogWriter log(run, scene);
    CHECK(error_of([&] { kerf::LogWriter again(run, scene); }).starts_with(run.string()));
    for (int i = 0; i < 2000; ++i) {
      if (i == 1500) CHECK(servo.apply({kerf::ServoCommand::Kind::mark}));
      log.add(ticks.emplace_back(servo.step(hand.next(servo.last()))));
    }
    log.close();
    log.close();
    output_hash = servo.last().output_hash;
  }
  kerf::Log log = kerf::Log::open(run);
  CHECK(log.rows() == 2000);
  CHECK(log.arms() == 1);
  CHECK(log.period_s() == doctest::Approx(0.001));
  CHECK(log.check() == std::vector<std::string>{});
  std::size_t row = 0;
  bool equal = true;
  log.for_each([&](const kerf::TickRecord& tick) { equal = equal && same(tick, ticks[row++]); });
  CHECK(equal);
  CHECK(row == 2000);
  std::vector<kerf::TickRecord> few(5);
  CHECK(log.read(1998, few) == 2);
  CHECK(log.read(2000, few) == 0);
  CHECK(error_of([&] { static_cast<void>(log.read(0, few, 1)); }).find("arm 1") !=
        std::string::npos);

  const kerf::ReplayOutcome replay = log.replay();
  CHECK_FALSE(replay.difference.has_value());
  CHECK(replay.ticks == 2000);
  CHECK(replay.output_hash == output_hash);
  CHECK(replay.cut_short.empty());
  int visited = 0;
  const auto stiffer =
      log.replay({"force.stiffness_n_per_mm=0.3"},
                 [&](const kerf::TickRecord&, const kerf::TickRecord&) { ++visited; });
  REQUIRE(stiffer.difference.has_value());
  CHECK(stiffer.ticks == 2000);
  CHECK(visited == 2000);
  CHECK(error_of([&] { static_cast<void>(log.replay({"force.nosuch=1"})); }).find("force.nosuch") !=
        std::string::npos);

  std::fstream damaged(run / "ticks.npy", std::ios::in | std::ios::out | std::ios::binary);
  damaged.seekp(4096 + 496 * 100 + 200);
  damaged.put('x').flush();
  CHECK(log.check().size() >= 1);
  CHECK(error_of([&] {
          kerf::Log::open(run).for_each([](const kerf::TickRecord&) {});
        }).find("row 100") != std::string::npos);
  CHECK(error_of([&] { static_cast<void>(kerf::Log::open(folder.path())); }) != "no error");
}

TEST_CASE("a recording has each tick from the first on, once") {
  const TemporaryFolder folder;
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/two_arms.toml");
  REQUIRE(scene.arms() == 2);
  kerf::Servo servo(scene);
  kerf::LogWriter log(folder.path() / "run", scene);
  const std::string place = (folder.path() / "run").string() + ": ";
  std::vector<kerf::TickRecord> first;
  for (const kerf::TickRecord& tick : servo.step(std::vector<kerf::DeviceReport>(1)))
    first.push_back(tick);
  CHECK(first.size() == 2);
  CHECK(first[1].stale == 1);
  CHECK(error_of([&] { log.add(first[0]); }) ==
        place + "a tick of 1 arms, and the scene has 2; add all of them");
  log.add(first);
  const std::string again =
      place + "tick 1, and tick 2 comes next; add each tick of one run once, from the first on";
  CHECK(error_of([&] { log.add(first); }) == again);
  log.close();
  CHECK(error_of([&] { log.add(first); }) == place + "is closed; write another recording");
  servo.step(std::vector<kerf::DeviceReport>(5));
  CHECK(servo.last(1).tick == 2);
  CHECK(servo.last(7).tick == 2);
}

TEST_CASE(
    "an assignment ends the recording that was there, and a close that failed can be repeated") {
  const TemporaryFolder folder;
  const kerf::Scene scene = wall();
  kerf::Servo servo(scene);
  kerf::LogWriter log(folder.path() / "a", scene);
  for (int i = 0; i < 10; ++i) log.add(servo.step(kerf::DeviceReport{}));
  log = kerf::LogWriter(folder.path() / "b", scene);
  CHECK(kerf::Log::open(folder.path() / "a").rows() == 10);
  CHECK(kerf::Log::open(folder.path() / "a").check() == std::vector<std::string>{});
  fs::rename(folder.path() / "b", folder.path() / "c");
  CHECK(error_of([&] { log.close(); }) != "no error");
  fs::rename(folder.path() / "c", folder.path() / "b");
  log.close();
  CHECK(kerf::Log::open(folder.path() / "b").check() == std::vector<std::string>{});
}

TEST_CASE("what a visitor throws comes out as it is") {
  struct Mine {};
  const TemporaryFolder folder;
  const kerf::Scene scene = wall();
  kerf::Servo servo(scene);
  kerf::LogWriter writer(folder.path() / "run", scene);
  for (int i = 0; i < 2000; ++i) writer.add(servo.step(kerf::DeviceReport{}));
  writer.close();
  kerf::Log log = kerf::Log::open(folder.path() / "run");
  int visited = 0;
  const auto third = [&] {
    if (++visited == 3) throw Mine();
  };
  CHECK_THROWS_AS(log.for_each([&](const kerf::TickRecord&) { third(); }), Mine);
  CHECK(visited == 3);
  visited = 0;
  CHECK_THROWS_AS(static_cast<void>(log.replay(
                      {}, [&](const kerf::TickRecord&, const kerf::TickRecord&) { third(); })),
                  Mine);
  CHECK(visited == 3);
  log.for_each({});
}

TEST_CASE("a hand is that of the scene, and its motors those of the emulated device") {
  const kerf::Scene scene = kerf::Scene::load(kScenes + "/phantom.toml");
  kerf::Servo own(scene), given(scene);
  kerf::Hand of_scene(scene), of_file(scene, kScenes + "/hands/cut_cavity.toml");
  for (int i = 0; i < 1200; ++i) {
    own.step(of_scene.next(own.last()));
    given.step(of_file.next(given.last()));
  }
  CHECK(own.last().output_hash == given.last().output_hash);
  CHECK(error_of([] { kerf::Hand hand(wall({"device.torque_scale=[0.9, 0.9, 0.9]"}), kHand); }) ==
        "device.torque_scale = [0.9, 0.9, 0.9]: the emulated motors have [0.342, 0.342, 0.342]; "
        "leave it out");
}

TEST_CASE("a running controller is read and asked") {
  const kerf::test::RuntimeFolder folder;
  std::vector<kerf::Density> density(16 * 16 * 16, 7);
  kerf::SegmentSpec spec;
  spec.scene_json = "{}";
  spec.volumes.push_back(
      {.grid = {16, 16, 16}, .spacing_mm = {0.1, 0.2, 0.3}, .density = density, .labels = {}});
  auto writer = kerf::SegmentWriter::create(spec, true);
  std::optional<kerf::SegmentServer> server;
  server.emplace("face", writer, kerf::CommandLimits{.tools = 2});
  kerf::Segment running = kerf::Segment::open("face");
  CHECK(running.alive());
  CHECK(running.arms() == 1);
  CHECK(running.period_s() == doctest::Approx(0.001));
  CHECK(running.scene_json() == "{}");
  CHECK_FALSE(running.latest().has_value());
  CHECK(running.count() == 0);
  std::size_t bricks = 0;
  kerf::VoxelView view = running.volume(0, &bricks);
  CHECK(bricks == 8);
  CHECK(view.size == std::array<int, 3>{16, 16, 16});
  CHECK(view.spacing_mm == std::array<double, 3>{0.1, 0.2, 0.3});
  CHECK(std::ranges::equal(view.density, density));

  for (kerf::Tick tick = 1; tick <= 5000; ++tick) {  // more than its ring holds
    writer.begin_tick(tick);
    if (tick == 4999) {
      density[0] = 3;
      static_cast<void>(writer.publish_box(0, density, {{0, 0, 0}, {1, 1, 1}}, 4));
    }
    kerf::TickRecord record{};
    record.tick = tick;
    writer.publish_state(record);
    writer.end_tick(tick);
  }
  CHECK(running.count() == 5000);
  REQUIRE(running.latest().has_value());
  CHECK(running.latest()->tick == 5000);
  CHECK_FALSE(running.latest(1).has_value());
  std::vector<kerf::TickRecord> ticks;
  CHECK(running.since(4990, ticks) == 0);
  CHECK(ticks.size() == 10);
  CHECK(ticks.front().tick == 4991);
  CHECK(running.since(5000, ticks) == 0);
  CHECK(running.since(9999, ticks) == 0);
  CHECK(ticks.size() == 10);
  ticks.clear();
  CHECK(running.since(0, ticks) + ticks.size() == 5000);
  CHECK(ticks.size() > 4000);
  view = running.volume(0, &bricks);
  CHECK(bricks == 1);
  CHECK(view.density[0] == 3);
  CHECK(error_of([&] { running.volume(1); }) ==
        "volume 1: the controller has 1; they count from 0");

  using Kind = kerf::ServoCommand::Kind;
  CHECK(running.send({Kind::select_tool, 1}) == 1);
  CHECK(running.send({Kind::select_tool, 2}) == 0);
  CHECK(running.send({Kind::missed, 1}) == 0);
  CHECK(running.send({Kind::mark}) == 2);
  const auto taken = server->take_command();
  REQUIRE(taken.has_value());
  CHECK(taken->kind == kerf::CommandKind::select_tool);
  server.reset();
  CHECK_FALSE(running.alive());
  CHECK(running.latest()->tick == 5000);
  CHECK(error_of([&] { running.send({Kind::mark}); }) != "no error");
}

TEST_CASE("a scene of voxels from memory") {
  std::vector<std::uint16_t> density(40 * 30 * 20, 0);
  for (int z = 3; z < 17; ++z) {
    for (int y = 3; y < 15; ++y) {  // a block in air
      for (int x = 3; x < 37; ++x) density[static_cast<std::size_t>((z * 30 + y) * 40 + x)] = 40000;
    }
  }
  constexpr std::string_view kText =
      "[[volume]]\nfile = \"block\"\ncrop = false\n[[tool]]\nshape = "
      "\"ball\"\n"
      "radius_mm = 0.5\n[force]\nstiffness_n_per_mm = 0.4\n[cut]\nmodel = \"none\"\n";
  const kerf::Voxels voxels{{40, 30, 20}, {0.2, 0.2, 0.2}, density};
  const kerf::Scene scene = kerf::Scene::of_voxels(voxels, kText);
  kerf::Servo servo(scene);
  const kerf::VoxelView view = servo.voxels(0);
  CHECK(view.size == std::array<int, 3>{40, 30, 20});
  CHECK(view.spacing_mm == std::array<double, 3>{0.2, 0.2, 0.2});
  // Its middle is the world's, and its z axis is up.
  CHECK(view.origin_mm[0] == doctest::Approx(-0.1 * 39));
  CHECK(view.origin_mm[1] == doctest::Approx(-0.1 * 19));
  CHECK(view.origin_mm[2] == doctest::Approx(0.1 * 29));
  CHECK(std::ranges::equal(view.density, density));
  CHECK(servo.voxels(1).density.empty());

  for (const char* const key : {"window = [0, 65535]", "spacing_mm = [1, 1, 1]"}) {
    std::string text(kText);
    text.insert(text.find("crop"), std::string(key) + "\n");
    CHECK(error_of([&] {
            static_cast<void>(kerf::Scene::of_voxels(voxels, text));
          }).ends_with("is of files, and these voxels come from memory; leave it out"));
  }
  kerf::Voxels few = voxels;
  few.density = few.density.first(10);
  CHECK(error_of([&] { static_cast<void>(kerf::Scene::of_voxels(few, kText)); }) ==
        "voxels: 10 densities, and 40 x 30 x 20 voxels; give one for each");
  for (const auto& size :
       {std::array{0, 30, 20}, std::array{-1, 30, 20}, std::array{100000, 30, 20}}) {
    few.size = size;
    CHECK(error_of([&] {
            static_cast<void>(kerf::Scene::of_voxels(few, kText));
          }).starts_with("voxels"));
  }
  few = voxels;
  few.spacing_mm[1] = NAN;
  CHECK(error_of([&] {
          static_cast<void>(kerf::Scene::of_voxels(few, kText));
        }).starts_with("voxels"));
}

TEST_CASE("what cannot be loaded is an Error of one line") {
  for (const std::string& said :
       {error_of([] { static_cast<void>(kerf::Scene::load("nosuch.toml")); }),
        error_of([] { static_cast<void>(wall({"force.stifness=1"})); }),
        error_of([] { static_cast<void>(wall({"nonsense"})); }),
        error_of([] { static_cast<void>(kerf::Scene::parse("[[", ".")); }),
        error_of([] { static_cast<void>(kerf::Scene::parse("", ".")); }),
        error_of([] { kerf::Hand hand(wall(), "nosuch.toml"); }),
        error_of([] { kerf::Hand hand(wall(), kHand, "nosuch.toml"); }),
        error_of([] { kerf::Hand hand(wall(), kHand, "", 1); }),
        error_of([] { kerf::Hand hand(wall({"servo.rate_hz=3000"}), kHand); }),
        error_of([] { static_cast<void>(kerf::Segment::open("nobody-of-this-name")); }),
        error_of([] { static_cast<void>(kerf::Segment::open("no/name")); }),
        error_of([] { static_cast<void>(kerf::Log::open("nosuch")); }),
        error_of([] { static_cast<void>(kerf::device_loop("omnj", 1000)); }),
        error_of([] { static_cast<void>(kerf::device_loop("omni", 0)); }), error_of([] {
          static_cast<void>(kerf::stability_map("1", {{"damping", "x"}}));
        }),
        error_of([] {
          static_cast<void>(kerf::stability_map("1", {{"dampin", "0"}}));
        }),
        error_of([] { static_cast<void>(kerf::run_on_wall({.loop = {}, .law = "none such"})); }),
        error_of(
            [] { static_cast<void>(kerf::run_on_wall({.loop = {}, .estimator = "none"})); })}) {
    CAPTURE(said);
    CHECK(said != "no error");
    CHECK(said.find('\n') == std::string::npos);
  }
}

TEST_CASE("faults of an emulated device reach the servo") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "silence.toml")
      << "[[fault]]\nkind = \"silence\"\nat_s = 0.3\nfor_s = 0.3\n";
  const kerf::Scene scene = wall();
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, kHand, folder.path() / "silence.toml");
  bool stale = false;
  for (int i = 0; i < 3000; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    stale = stale || tick.fault == static_cast<std::uint32_t>(kerf::Fault::stale_input);
  }
  CHECK(stale);
}

TEST_CASE("faults come with the scene's own hand, too") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "silence.toml")
      << "[[fault]]\nkind = \"silence\"\nat_s = 0.3\nfor_s = 0.3\n";
  const kerf::Scene scene =
      kerf::Scene::load(fs::path(KERF_SCENES) / "touch.toml", {"servo.numeric=\"double\""});
  kerf::Servo servo(scene), other(scene);
  kerf::Hand hand = kerf::Hand::with_faults(scene, folder.path() / "silence.toml");
  kerf::Hand well = kerf::Hand::with_faults(scene, {});
  kerf::Hand own(scene);
  bool stale = false;
  for (int i = 0; i < 2000; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    stale = stale || tick.fault == static_cast<std::uint32_t>(kerf::Fault::stale_input);
    const kerf::DeviceReport report = own.next(other.last());
    CHECK(well.next(other.last()).counts == report.counts);
    other.step(report);
  }
  CHECK(stale);
  CHECK(error_of([&] {
          static_cast<void>(kerf::Hand::with_faults(scene, "nosuch.toml"));
        }).find("nosuch.toml") != std::string::npos);
}

TEST_CASE("a hand without a script is led") {
  const kerf::Scene scene = wall();
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, fs::path());
  std::array<double, 3> aim{};
  for (int i = 0; i < 3000; ++i) {
    const kerf::TickRecord& tick = servo.step(hand.next(servo.last()));
    if (!hand.ended()) continue;
    if (aim == std::array<double, 3>{})
      aim = {tick.position_mm[0] + 2, tick.position_mm[1] + 1, tick.position_mm[2]};
    hand.lead(aim);
  }
  CHECK(std::abs(hand.tip_mm()[0] - aim[0]) < 0.3);
  CHECK(std::abs(hand.tip_mm()[1] - aim[1]) < 0.3);
  CHECK(std::abs(servo.last().position_mm[0] - hand.tip_mm()[0]) < 0.1);
}

TEST_CASE("a loop or a map that means nothing has no verdict") {
  kerf::SampledLoop loop = kerf::device_loop("falcon", 1000);
  CHECK(kerf::problem_in(loop).empty());
  for (double kerf::SampledLoop::*const member :
       {&kerf::SampledLoop::mass_kg, &kerf::SampledLoop::period_s, &kerf::SampledLoop::delay_s,
        &kerf::SampledLoop::quantum_mm, &kerf::SampledLoop::coulomb_n,
        &kerf::SampledLoop::velocity_filter_s, &kerf::SampledLoop::viscous_ns_per_mm}) {
    for (const double wrong : {-1.0, std::nan(""), HUGE_VAL}) {
      kerf::SampledLoop bad = loop;
      bad.*member = wrong;
      CHECK_FALSE(kerf::problem_in(bad).empty());
      CHECK(error_of([&] { static_cast<void>(kerf::run_on_wall({.loop = bad})); }) ==
            kerf::problem_in(bad));
    }
  }
  for (double kerf::WallRun::*const member :
       {&kerf::WallRun::stiffness_n_per_mm, &kerf::WallRun::damping_ns_per_mm,
        &kerf::WallRun::push_n, &kerf::WallRun::hit_mm_per_s, &kerf::WallRun::seconds}) {
    for (const double wrong : {-1.0, std::nan(""), 1e300}) {
      kerf::WallRun run{.loop = loop};
      run.*member = wrong;
      CHECK(error_of([&] { static_cast<void>(kerf::run_on_wall(run)); }).find(": give one from") !=
            std::string::npos);
    }
  }
  const auto map = [](const std::vector<kerf::MapAxis>& axes, const kerf::MapOptions& options) {
    return error_of([&] { static_cast<void>(kerf::stability_map("1,2", axes, options)); });
  };
  CHECK(map({{"damping", "0"}, {"damping", "0.1"}}, {}) == "axis damping: given twice");
  CHECK(map({}, {.seeds = 0}) == "seeds = 0: give one from 1 to 200");
  CHECK(map({}, {.seconds = std::nan("")}).starts_with("seconds = nan"));
  CHECK(map({{"stiffness", "1"}}, {}) == "axis stiffness: it is the first argument");
}

TEST_CASE("boundary, run and map agree") {
  kerf::SampledLoop loop = kerf::device_loop("omni", 1000);
  loop.delay_s = 0.001;
  const double linear = kerf::highest_stiffness(loop, 0.002);
  CHECK(kerf::is_stable(loop, 0.99 * linear, 0.002));
  CHECK_FALSE(kerf::is_stable(loop, 1.01 * linear, 0.002));
  kerf::SampledLoop ideal = loop;
  ideal.coulomb_n = ideal.quantum_mm = 0;
  kerf::WallRun run{.loop = ideal,
                    .damping_ns_per_mm = 0.002,
                    .seed = 0,
                    .law = "two_sided",
                    .estimator = "difference",
                    .fixed_point = false,
                    .limits = false};
  run.stiffness_n_per_mm = 0.9 * linear;
  CHECK(kerf::run_on_wall(run).rests());
  run.stiffness_n_per_mm = 1.1 * linear;
  CHECK(kerf::run_on_wall(run).swings);

  const kerf::StabilityMap map = kerf::stability_map(
      "0.2:20:6", {{"loop", "ideal"}, {"damping", "0.002,2"}, {"delay", "1"}}, {.threads = 1});
  REQUIRE(map.columns.size() == 2);
  REQUIRE(map.stiffness_n_per_mm.size() == 6);
  CHECK(map.columns[0].values == std::vector<std::string>{"ideal", "0.002", "1"});
  CHECK(map.columns[0].cells.size() == 6);
  CHECK(map.columns[0].first_swing_n_per_mm > 0);
  CHECK(map.columns[0].first_swing_n_per_mm < 20);
  CHECK(map.columns[1].cells.empty());
  CHECK(map.columns[1].impossible.starts_with("damping 2 N s/mm is above"));
}

TEST_CASE("a run on a wall shows each tick, and a map each seed") {
  const std::vector<kerf::MapAxis> axes{{"device", "falcon"},
                                        {"damping", "0.002"},
                                        {"push", "0.5"},
                                        {"hit", "200"},
                                        {"start", "0.1"}};
  const kerf::StabilityMap map = kerf::stability_map("5:10:3", axes, {.seeds = 3});
  const std::vector<double>& seeds = map.columns[0].swing_by_seed_n_per_mm;
  REQUIRE(seeds.size() == 3);
  CHECK(std::ranges::min(seeds) == map.columns[0].first_swing_n_per_mm);
  CHECK(map.columns[0].energy_by_seed_n_per_mm.size() == 3);

  // On both sides of the crossing of the second seed, by the loop of the column: those of the map.
  kerf::WallRun run{.loop = kerf::column_loop(axes), .damping_ns_per_mm = 0.002};
  const auto swings = [&](double stiffness_n_per_mm) {
    run.stiffness_n_per_mm = stiffness_n_per_mm;
    run.hit_mm_per_s = 200;
    run.seed = std::uint64_t{2} << 32U;
    return kerf::run_on_wall(run).swings;
  };
  CHECK(swings(seeds[1]));
  CHECK_FALSE(swings(seeds[1] / 1.02));

  std::vector<double> tips_mm;
  run.hit_mm_per_s = 50;
  const kerf::LimitCycle watched = kerf::run_on_wall(run, [&](double tip_mm, double mm_per_s) {
    if (tips_mm.empty()) CHECK(mm_per_s == doctest::Approx(-50).epsilon(0.2));
    tips_mm.push_back(tip_mm);
  });
  CHECK(watched.travel_mm == kerf::run_on_wall(run).travel_mm);
  CHECK(tips_mm.front() < 0.1);
  CHECK(tips_mm.back() == doctest::Approx(-(0.5 + 0.3) / run.stiffness_n_per_mm).epsilon(0.2));
  struct Enough {};
  CHECK_THROWS_AS(static_cast<void>(kerf::run_on_wall(run, [](double, double) { throw Enough(); })),
                  Enough);

  const std::atomic<bool> stop{true};
  const kerf::StabilityMap none = kerf::stability_map("5:10:3", axes, {.stop = &stop});
  CHECK(none.columns[0].cells.empty());
  CHECK(none.columns[0].impossible.empty());
  CHECK(error_of([] {
          static_cast<void>(kerf::column_loop({{"damping", "0,1"}}));
        }) == "axes: 2 columns; give each axis one value");
}

}  // namespace kerf::face_test
