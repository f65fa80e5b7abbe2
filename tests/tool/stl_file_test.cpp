// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "controller/tool/tool_mesh.hpp"
#include "lab/rig/tool_meshes.hpp"
#include "tests/scene/support.hpp"
#include "tests/tool/stl_support.hpp"

using namespace kerf;
using test::binary_stl;
using test::text_stl;

namespace {

using Triangles = std::vector<LooseTriangle>;

const Triangles kBar = extremes::prism(1.5, 4, 4);  // 16 triangles

std::string parse_error(const std::string& bytes) {
  return test::error_of([&] { static_cast<void>(parse_stl(bytes, "bur.stl")); });
}

std::string join_error(const Triangles& triangles, double scale = 1) {
  return test::error_of([&] { static_cast<void>(join_triangles(triangles, scale, "bur.stl")); });
}

bool begins(const std::string& text, const std::string& with) {
  return text.starts_with(with);
}

double volume_mm3(const ToolMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    sum += extremes::dot(a, extremes::cross(b, c)) / 6;
  }
  return sum;
}

}  // namespace

TEST_CASE("a binary STL and the same as text give the same triangles") {
  CHECK(parse_stl(binary_stl(kBar), "bur.stl") == kBar);
  CHECK(parse_stl(text_stl(kBar), "bur.stl") == kBar);
  std::string crlf = text_stl(kBar);
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != crlf.npos; at += 2) crlf.insert(at, "\r");
  CHECK(parse_stl(crlf, "bur.stl") == kBar);
}

TEST_CASE("a binary STL whose header begins as text does is still binary") {
  const std::string bytes = binary_stl(kBar);
  CHECK(parse_stl("solid" + bytes.substr(5), "bur.stl") == kBar);
}

TEST_CASE("keywords are read in any case, and numbers that a float takes for zero") {
  std::string upper = text_stl(kBar);
  std::ranges::transform(upper, upper.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  CHECK(parse_stl(upper, "bur.stl") == kBar);
  const auto tiny = parse_stl(
      "Solid x\nFacet Normal 0 0 1\nOuter Loop\nVertex 1e-50 -1e-50 +2\nVertex 0 1 0\n"
      "Vertex 1 0 0\nEndLoop\nEndFacet\nEndSolid x\n",
      "bur.stl");
  REQUIRE(tiny.size() == 1);
  CHECK(tiny[0][0] == std::array<float, 3>{0, 0, 2});
}

TEST_CASE("a number too small for any is read as zero, and one too large is refused") {
  const auto facet = [](const std::string& x) {
    return "solid x\nfacet normal 0 0 1\nouter loop\nvertex " + x +
           " 0 2\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid x\n";
  };
  for (const char* x : {"1e-400", "-1e-400", "+0.001e-99999"}) {
    const auto read = parse_stl(facet(x), "bur.stl");
    REQUIRE(read.size() == 1);
    CHECK(read[0][0] == std::array<float, 3>{0, 0, 2});
  }
  for (const std::string x : {"1e400", "-1e99999"}) {
    CHECK(parse_error(facet(x)) ==
          "bur.stl:4: \"" + x + "\" where a number belongs; export the mesh again");
  }
  CHECK(begins(parse_error(facet("1e-400x")), "bur.stl:4: \"1e-400x\" where a number"));
}

TEST_CASE("several solids of one text are one mesh") {
  CHECK(parse_stl(text_stl(kBar) + text_stl(kBar), "bur.stl").size() == 2 * kBar.size());
}

TEST_CASE("a file that is no STL is refused with the place, what is there and the way out") {
  const std::string bytes = binary_stl(kBar), text = text_stl(kBar);
  CHECK(parse_error(bytes.substr(0, bytes.size() - 1)) ==
        "bur.stl: a binary STL of 16 triangles has 884 bytes, and the file has 883; export the "
        "mesh again");
  CHECK(begins(parse_error(bytes + "x"), "bur.stl: a binary STL of 16 triangles has 884 bytes"));
  CHECK(parse_error(text.substr(0, text.rfind("endloop"))) ==
        "bur.stl:112: the file ends where endloop belongs; export the mesh again");
  CHECK(parse_error("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 one 0\n") ==
        "bur.stl:4: \"one\" where a number belongs; export the mesh again");
  CHECK(begins(parse_error("solid x\nfacet normal 0 0 1\nouter loop\nvertex 1e99 0 0\n"),
               "bur.stl:4: \"1e99\" where a number"));
  CHECK(begins(parse_error("ply\n"), "bur.stl:1: \"ply\" where solid belongs"));
  // Long enough for a binary header; only a zero byte makes it one.
  const std::string prose(200, 'x');
  CHECK(begins(parse_error(prose), "bur.stl:1: \"xxx"));
  CHECK(begins(parse_error(prose + '\0'), "bur.stl: a binary STL of "));
  CHECK(parse_stl("", "bur.stl").empty());
}

TEST_CASE("a file of more triangles than are taken is refused before they are") {
  std::string bytes(80, ' ');
  test::append_word(bytes, kMaxMeshTriangles + 1);
  bytes.resize(84 + 50 * (kMaxMeshTriangles + 1));
  CHECK(parse_error(bytes) == "bur.stl: more than 65536 triangles; simplify the mesh");
}

TEST_CASE("joined triangles share corners, stand in the middle and are in mm") {
  Triangles high = kBar;
  for (LooseTriangle& t : high) {
    for (auto& corner : t) corner[1] += 10;
  }
  const ToolMesh mesh = join_triangles(high, 0.5, "bur.stl");
  CHECK(mesh.points_mm.size() == 10);
  CHECK(mesh.triangles.size() == 16);
  double low = 1e9, top = -1e9;
  for (const auto& p : mesh.points_mm) {
    low = std::min(low, p[1]);
    top = std::max(top, p[1]);
  }
  CHECK(low == -1.0);
  CHECK(top == 1.0);
  CHECK(volume_mm3(mesh) == doctest::Approx(4.5 * 4 / 8));
}

TEST_CASE("a mesh that is inside out is turned, and a triangle without area is left out") {
  Triangles inside_out = kBar;
  for (LooseTriangle& t : inside_out) std::swap(t[0], t[1]);
  CHECK(volume_mm3(join_triangles(inside_out, 1, "bur.stl")) == doctest::Approx(4.5 * 4));
  Triangles more = kBar;
  more.push_back({kBar[0][0], kBar[0][1], kBar[0][0]});
  CHECK(join_triangles(more, 1, "bur.stl").triangles.size() == 16);
}

TEST_CASE("a part that is inside out is turned beside one that is not") {
  Triangles both = kBar;
  for (LooseTriangle t : kBar) {
    for (auto& corner : t) corner[0] += 5;
    std::swap(t[0], t[1]);
    both.push_back(t);
  }
  const ToolMesh mesh = join_triangles(both, 1, "bur.stl");
  CHECK(volume_mm3(mesh) == doctest::Approx(2 * 4.5 * 4));
  CHECK(mesh.triangles.size() == 32);
}

TEST_CASE("a hollow stays one, also where the whole mesh is inside out") {
  const Triangles outer = extremes::prism(3, 8, 4);
  Triangles hollow = outer, inside_out = kBar;
  for (LooseTriangle t : kBar) {
    std::swap(t[0], t[1]);
    hollow.push_back(t);
  }
  for (LooseTriangle t : outer) {
    std::swap(t[0], t[1]);
    inside_out.push_back(t);
  }
  const double outer_mm3 = volume_mm3(join_triangles(outer, 1, "bur.stl"));
  for (const Triangles& mesh : {hollow, inside_out}) {
    CHECK(volume_mm3(join_triangles(mesh, 1, "bur.stl")) == doctest::Approx(outer_mm3 - 4.5 * 4));
  }
}

TEST_CASE("a body that is inside out keeps its hollow, in whatever order its parts come") {
  const auto inside_out = [](Triangles mesh) {
    for (LooseTriangle& t : mesh) std::swap(t[0], t[1]);
    return mesh;
  };
  Triangles aside = extremes::prism(4, 8, 4);  // the larger: the mesh is not inside out as a whole
  for (LooseTriangle& t : aside) {
    for (auto& corner : t) corner[0] += 20;
  }
  const Triangles body = extremes::prism(3, 8, 4), hollow = kBar;
  const double solid_mm3 = volume_mm3(join_triangles(aside, 1, "bur.stl")) +
                           volume_mm3(join_triangles(body, 1, "bur.stl"));
  std::array<Triangles, 3> parts{aside, inside_out(body), inside_out(hollow)};
  for (std::array<std::size_t, 3> order{0, 1, 2};;) {
    Triangles all;
    for (const std::size_t i : order) all.insert(all.end(), parts[i].begin(), parts[i].end());
    CHECK(volume_mm3(join_triangles(all, 1, "bur.stl")) == doctest::Approx(solid_mm3 - 4.5 * 4));
    if (!std::next_permutation(order.begin(), order.end())) break;
  }
}

TEST_CASE("a folder or a pipe is no STL file, and says so") {
  const test::TempFolder folder;
  const auto path = folder.write("bur.stl", text_stl(kBar));
  CHECK(read_stl(path) == kBar);
  const auto error = test::error_of([&] { static_cast<void>(read_stl(path.parent_path())); });
  CHECK(error.find(": is a folder; name an STL file in it") != std::string::npos);
  const auto none = test::error_of([&] { static_cast<void>(read_stl(path / "x")); });
  CHECK(none.find(": no such STL file") != std::string::npos);
  const auto pipe = path.parent_path() / "pipe.stl";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const auto waits = test::error_of([&] { static_cast<void>(read_stl(pipe)); });
  CHECK(waits.find("pipe.stl: a pipe, socket or device; copy what it gives") != std::string::npos);
}

TEST_CASE("a mesh that encloses nothing or has a hole is refused with the edge") {
  CHECK(join_error({}) == "bur.stl: no triangles; export a closed mesh");
  Triangles open = kBar;
  open.pop_back();
  CHECK(begins(join_error(open), "bur.stl: not closed, the edge from ("));
  CHECK(join_error(open).find(" has no partner; close the hole there") != std::string::npos);
  Triangles twisted = kBar;
  std::swap(twisted[3][0], twisted[3][1]);
  CHECK(join_error(twisted).find("turned against each other") != std::string::npos);
  Triangles flat = {kBar[0], kBar[0]};
  std::swap(flat[1][0], flat[1][1]);
  CHECK(begins(join_error(flat), "bur.stl: the mesh encloses 0 mm^3"));
}

TEST_CASE("coordinates that no tool has are refused with their triangle") {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(), 1001.0F, -3e38F}) {
    Triangles triangles = kBar;
    triangles[2][1][0] = bad;
    CHECK(begins(join_error(triangles), "bur.stl: triangle 3 has the coordinate "));
  }
  CHECK(begins(join_error(kBar, 1000), "bur.stl: triangle 1 has the coordinate "));
}
