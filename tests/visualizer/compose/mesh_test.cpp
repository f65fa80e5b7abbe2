// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include <doctest/doctest.h>

#include "visualizer/compose/tool_painter.hpp"

namespace kerf::mesh_test {
namespace {

std::vector<ProfilePoint> circle_profile(double radius_mm) {
  std::vector<ProfilePoint> profile;
  for (int i = 0; i <= 64; ++i) {
    const double angle = std::numbers::pi * i / 64;
    profile.push_back({-radius_mm * std::cos(angle), radius_mm * std::sin(angle)});
  }
  return profile;
}

/// By the divergence theorem; positive only where the triangles turn outwards.
double volume_mm3(const Mesh& mesh) {
  double sum = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      return glm::dvec3(mesh.vertices[mesh.triangles[i + k]].position);
    };
    sum += glm::dot(at(0), glm::cross(at(1), at(2))) / 6.0;
  }
  return sum;
}

/// Edges, by position, that do not belong to exactly two triangles with area.
int open_edges(const Mesh& mesh) {
  using Place = std::tuple<long, long, long>;
  const auto place = [&](std::uint32_t index) {
    const glm::vec3 p = mesh.vertices[index].position;
    const auto whole = [](float v) { return std::lround(static_cast<double>(v) * 1e5); };
    return Place{whole(p.x), whole(p.y), whole(p.z)};
  };
  std::map<std::pair<Place, Place>, int> directed;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Place from = place(mesh.triangles[i + k]);
      const Place to = place(mesh.triangles[i + (k + 1) % 3]);
      if (from != to) ++directed[{from, to}];
    }
  }
  int open = 0;
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    open += back == directed.end() || back->second != count ? 1 : 0;
  }
  return open;
}

}  // namespace

TEST_CASE("a turned half circle is a closed ball with radial normals") {
  const Mesh mesh = lathe(circle_profile(2.0));
  CHECK(open_edges(mesh) == 0);
  CHECK(volume_mm3(mesh) == doctest::Approx(4.0 / 3.0 * std::numbers::pi * 8.0).epsilon(0.01));
  float worst = 1.0F;
  for (const Mesh::Vertex& vertex : mesh.vertices) {
    worst = std::min(worst, glm::dot(vertex.normal, glm::normalize(vertex.position)));
  }
  CHECK(worst > 0.999F);
}

TEST_CASE("a cylinder is closed by lids and keeps its sharp edge") {
  const Mesh mesh = lathe(std::array<ProfilePoint, 2>{{{-1.0, 0.5}, {3.0, 0.5}}});
  CHECK(open_edges(mesh) == 0);
  CHECK(volume_mm3(mesh) == doctest::Approx(std::numbers::pi).epsilon(0.01));
  for (const Mesh::Vertex& vertex : mesh.vertices) {
    const bool lid = std::abs(vertex.normal.y) > 0.5F;
    CHECK(std::abs(vertex.normal.y) == doctest::Approx(lid ? 1.0 : 0.0));
  }
}

TEST_CASE("profiles that are no body give no mesh, and doubled points do no harm") {
  CHECK(lathe({}).triangles.empty());
  CHECK(lathe(std::array<ProfilePoint, 1>{{{0.0, 1.0}}}).triangles.empty());
  CHECK(lathe(std::array<ProfilePoint, 3>{{{0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}}}).triangles.empty());
  const Mesh mesh = lathe(std::array<ProfilePoint, 4>{{{0, 0}, {0, 1}, {0, 1}, {2, 1}}});
  CHECK(volume_mm3(mesh) == doctest::Approx(2.0 * std::numbers::pi).epsilon(0.01));
  for (const Mesh::Vertex& vertex : mesh.vertices)
    CHECK(glm::length(vertex.normal) == doctest::Approx(1.0));
}

TEST_CASE("a tool has its head around the origin and a thinner shank towards +y") {
  const Mesh mesh =
      tool_mesh({.name = "ball", .profile_mm = circle_profile(1.0), .radius_mm = 1.0});
  float lowest = 0.0F;
  float highest = 0.0F;
  float widest_above_head = 0.0F;
  for (const Mesh::Vertex& vertex : mesh.vertices) {
    lowest = std::min(lowest, vertex.position.y);
    highest = std::max(highest, vertex.position.y);
    if (vertex.position.y > 1.01F) {
      widest_above_head =
          std::max(widest_above_head, std::hypot(vertex.position.x, vertex.position.z));
    }
  }
  CHECK(lowest == doctest::Approx(-1.0));
  CHECK(highest > 4.0F);
  CHECK(widest_above_head > 0.0F);
  CHECK(widest_above_head < 1.0F);
}

TEST_CASE("a shaft that is felt is drawn as it is felt, and none is made up") {
  ToolView ball{.name = "ball", .profile_mm = circle_profile(1.0), .radius_mm = 1.0};
  ball.shaft_mm = {{0.8, 0.6}, {5.0, 0.6}, {5.0, 3.0}, {8.0, 3.0}, {8.0, 0.0}};
  const Mesh mesh = tool_mesh(ball);
  const double head_mm3 = volume_mm3(lathe(ball.profile_mm));
  CHECK(volume_mm3(mesh) - head_mm3 ==
        doctest::Approx(std::numbers::pi * (4.2 * 0.36 + 3 * 9)).epsilon(0.01));
  CHECK(open_edges(mesh) == 0);
  for (const Mesh::Vertex& vertex : mesh.vertices) {
    CHECK(vertex.position.y <= 8.0F);
    if (vertex.position.y > 1.01F && vertex.position.y < 4.99F) {
      CHECK(std::hypot(vertex.position.x, vertex.position.z) == doctest::Approx(0.6));
    }
  }
}

TEST_CASE("a mesh is drawn as it is: sharp edges stay sharp, and round ones are lit round") {
  // A bar of 24 sides: 15 degrees between two of them, 90 to the ends.
  constexpr std::uint32_t kSides = 24;
  Facets bar;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    for (const double y : {-1.0, 1.0})
      bar.points_mm.push_back({std::cos(angle), y, std::sin(angle)});
  }
  const auto low_end = 2 * kSides, high_end = 2 * kSides + 1;
  bar.points_mm.push_back({0.0, -1.0, 0.0});
  bar.points_mm.push_back({0.0, 1.0, 0.0});
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t low = 2 * i, next = 2 * ((i + 1) % kSides);
    bar.triangles.insert(bar.triangles.end(), {{low, low + 1, next},
                                               {next, low + 1, next + 1},
                                               {low_end, low, next},
                                               {high_end, next + 1, low + 1}});
  }
  const Mesh mesh = shaded(bar);
  CHECK(open_edges(mesh) == 0);
  CHECK(volume_mm3(mesh) == doctest::Approx(2.0 * std::numbers::pi).epsilon(0.02));
  for (const Mesh::Vertex& vertex : mesh.vertices) {
    const glm::vec3 round = glm::normalize(glm::vec3(vertex.position.x, 0.0F, vertex.position.z));
    if (std::abs(vertex.normal.y) > 0.5F) {
      CHECK(std::abs(vertex.normal.y) == doctest::Approx(1.0));
    } else {
      CHECK(glm::dot(vertex.normal, round) > 0.998F);
    }
  }
  const Mesh tool = tool_mesh({.name = "bar", .profile_mm = {}, .radius_mm = 1.0, .facets = bar});
  float highest = 0.0F;
  for (const Mesh::Vertex& vertex : tool.vertices) highest = std::max(highest, vertex.position.y);
  CHECK(highest > 4.0F);  // its shank
}

}  // namespace kerf::mesh_test
