// SPDX-License-Identifier: Apache-2.0
// A hand presses an Omni on a scene, in lock-step and without a device or a clock, with a force law
// of our own; the run is recorded, read back and replayed.    press SCENE.toml HAND.toml NEW_FOLDER
#include <cmath>
#include <cstdio>

#include <kerf/hand.hpp>
#include <kerf/law.hpp>
#include <kerf/log.hpp>
#include <kerf/servo.hpp>

template <class N>
struct Spring {
  using Real = typename N::Real;
  static constexpr const char *kName = "spring", *kMeaning = "F = K d";
  static constexpr std::array<kerf::LawSetting, 1> kSettings{
      {{"stiffness_n_per_mm", "N/mm", 0, 10, 0.5, "K"}}};
  struct State {};  // no memory
  explicit Spring(const kerf::LawSetup& setup) : k(setup["stiffness_n_per_mm"]) {}
  kerf::DeviceVec<Real> step(const kerf::ForceInput<N>& in, State&) const noexcept {
    return {k * in.spring_mm.x, k * in.spring_mm.y, k * in.spring_mm.z};
  }
  Real k;
};
KERF_REGISTER_FORCE_LAW(Spring)

int main(int argc, char** argv) try {
  if (argc != 4) return std::fprintf(stderr, "press: give SCENE.toml HAND.toml NEW_FOLDER\n"), 2;
  const auto scene = kerf::Scene::load(argv[1], {R"(force.law="spring")"});
  kerf::Servo servo(scene);
  kerf::Hand hand(scene, argv[2]);
  kerf::LogWriter writer(argv[3], scene);
  for (int i = 0; i < 4000; ++i) writer.add(servo.step(hand.next(servo.last())));
  writer.close();
  kerf::Log::open(argv[3]).for_each([](const kerf::TickRecord& t) {
    const auto& [x, y, z] = t.proxy_offset_mm;
    const auto& [fx, fy, fz] = t.contact_force_n;
    if (t.tick % 250 == 0)
      std::printf("%5.3f mm %6.4f N\n", std::hypot(x, y, z), std::hypot(fx, fy, fz));
  });
  return kerf::Log::open(argv[3]).replay().difference ? 1 : 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "press: %s\n", error.what()), 2;
}
