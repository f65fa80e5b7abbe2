// SPDX-License-Identifier: Apache-2.0
#include "controller/tool/tool_mesh.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/tool/inner_samples.hpp"
#include "controller/tool/surface_samples.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/tool_meshes.hpp"
#include "tests/scene/support.hpp"
#include "tests/tool/stl_support.hpp"

namespace kerf::tool_mesh_test {

using namespace kerf::extremes;

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

Triangles moved(Triangles triangles, float x, float y, float z) {
  for (LooseTriangle& t : triangles) {
    for (auto& corner : t) corner = {corner[0] + x, corner[1] + y, corner[2] + z};
  }
  return triangles;
}

Triangles both(Triangles a, const Triangles& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Triangles inverted(Triangles triangles) {
  for (LooseTriangle& t : triangles) std::swap(t[0], t[1]);
  return triangles;
}

double volume_mm3(const ToolMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto [a, b, c] = mesh.corners(t);
    sum += extremes::dot(a, extremes::cross(b, c)) / 6;
  }
  return sum;
}

double volume_mm3(const Triangles& triangles) {
  return volume_mm3(join_triangles(triangles, 1, "bur.stl"));
}

}  // namespace

TEST_CASE("a binary STL and the same as text give the same triangles") {
  CHECK(parse_stl(binary_stl(kBar), "bur.stl") == kBar);
  CHECK(parse_stl(text_stl(kBar), "bur.stl") == kBar);
  std::string crlf = text_stl(kBar);
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != crlf.npos; at += 2) crlf.insert(at, "\r");
  CHECK(parse_stl(crlf, "bur.stl") == kBar);
  std::string cr = text_stl(kBar);
  std::ranges::replace(cr, '\n', '\r');
  CHECK(parse_stl(cr, "bur.stl") == kBar);
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

namespace {

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += with.size()) {
    text.replace(at, what.size(), with);
  }
  return text;
}

}  // namespace

TEST_CASE("a text STL may close its blocks in two words, or the last solid with none") {
  const std::string text = text_stl(kBar);
  const std::string spaced =
      replaced(replaced(text, "endsolid", "end solid"), "endloop", "end loop");
  CHECK(parse_stl(replaced(spaced, "endfacet", "End Facet"), "bur.stl") == kBar);
  const std::string open = text.substr(0, text.rfind("endsolid"));
  CHECK(parse_stl(open, "bur.stl") == kBar);
  CHECK(parse_stl("\xef\xbb\xbf" + open + text, "bur.stl").size() == 2 * kBar.size());
  CHECK(begins(parse_error(text + "facet"), "bur.stl:115: \"facet\" where solid belongs"));
  CHECK(begins(parse_error(open + "end\nfacets"), "bur.stl:115: \"facets\" where solid belongs"));
}

TEST_CASE("normals are not used, so any three words do, and corners are numbers with points") {
  const std::string text = text_stl(kBar);
  const std::size_t from = text.find("normal") + 6, to = text.find('\n', from);
  for (const char* words : {"-1.#IND -1.#IND -1.#IND", "nan nan -nan(ind)", "0,5 x 1e999"}) {
    CHECK(parse_stl(std::string(text).replace(from, to - from, " " + std::string(words)),
                    "bur.stl") == kBar);
  }
  const auto error = parse_error("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0,5 0 0\n");
  CHECK(error ==
        "bur.stl:4: \"0,5\" where a number with a decimal point belongs; export the mesh again");
  CHECK(begins(parse_error(replaced(text, "vertex", "vertex -1.#IND")), "bur.stl:4: \"-1.#IND\""));
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
  const ToolMesh mesh = join_triangles(moved(kBar, 0, 10, 0), 0.5, "bur.stl");
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

TEST_CASE(
    "a mesh or a part of it that is inside out is turned, and a hollow stays one in any order of "
    "the parts") {
  CHECK(volume_mm3(inverted(kBar)) == doctest::Approx(4.5 * 4));
  CHECK(volume_mm3(both(kBar, inverted(moved(kBar, 5, 0, 0)))) == doctest::Approx(2 * 4.5 * 4));
  const Triangles body = prism(3, 8, 4);
  CHECK(volume_mm3(both(body, inverted(kBar))) == doctest::Approx(volume_mm3(body) - 4.5 * 4));
  CHECK(volume_mm3(both(kBar, inverted(body))) == doctest::Approx(volume_mm3(body) - 4.5 * 4));
  // The body aside is the larger: the mesh is not inside out as a whole.
  const Triangles aside = moved(prism(4, 8, 4), 20, 0, 0);
  const double solid_mm3 = volume_mm3(aside) + volume_mm3(body);
  const std::array<Triangles, 3> parts{aside, inverted(body), inverted(kBar)};
  std::array<std::size_t, 3> order{0, 1, 2};
  do {
    const Triangles all = both(both(parts[order[0]], parts[order[1]]), parts[order[2]]);
    CHECK(volume_mm3(all) == doctest::Approx(solid_mm3 - 4.5 * 4));
  } while (std::next_permutation(order.begin(), order.end()));
  Triangles more = kBar;
  more.push_back({kBar[0][0], kBar[0][1], kBar[0][0]});  // without area: it is left out
  CHECK(join_triangles(more, 1, "bur.stl").triangles.size() == 16);
}

TEST_CASE("a folder or a pipe is no STL file, and says so") {
  const test::TemporaryFolder folder;
  const auto path = folder.write("bur.stl", text_stl(kBar));
  CHECK(read_stl(path) == kBar);
  const auto error = test::error_of([&] { static_cast<void>(read_stl(path.parent_path())); });
  CHECK(test::has(error, ": is a folder; name an STL file in it"));
  const auto none = test::error_of([&] { static_cast<void>(read_stl(path / "x")); });
  CHECK(test::has(none, ": no such STL file"));
  const auto pipe = path.parent_path() / "pipe.stl";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const auto waits = test::error_of([&] { static_cast<void>(read_stl(pipe)); });
  CHECK(test::has(waits, "pipe.stl: a pipe, socket or device; copy what it gives"));
}

TEST_CASE("a mesh that encloses nothing or has a hole is refused with the edge") {
  CHECK(join_error({}) == "bur.stl: no triangles; export a closed mesh");
  Triangles open = kBar;
  open.pop_back();
  CHECK(begins(join_error(open), "bur.stl: not closed, the edge from ("));
  CHECK(test::has(join_error(open), " has no partner; close the hole there"));
  Triangles twisted = kBar;
  std::swap(twisted[3][0], twisted[3][1]);
  CHECK(test::has(join_error(twisted), "turned against each other"));
  Triangles flat = {kBar[0], kBar[0]};
  std::swap(flat[1][0], flat[1][1]);
  CHECK(begins(join_error(flat), "bur.stl: the mesh encloses 0 mm^3"));
}

namespace {

/// Whose sides lie in the planes x, z = +-half.
Triangles upright_bar(double half, double length) {
  return extremes::loft({-length / 2, length / 2}, 4, [&](double y, double angle) {
    const double diagonal = angle + std::numbers::pi / 4;
    return extremes::Point{half * std::round(std::sqrt(2) * std::cos(diagonal)), y,
                           half * std::round(std::sqrt(2) * std::sin(diagonal))};
  });
}

}  // namespace

TEST_CASE("doubled triangles, walls and sheets are named as what they are") {
  Triangles doubled = kBar;
  doubled.push_back(kBar[5]);
  CHECK(begins(join_error(doubled), "bur.stl: two triangles have the corners ("));
  CHECK(test::has(join_error(doubled), " mm; remove doubled triangles"));
  CHECK(join_error(both(kBar, kBar)) != "");  // twice the volume, and each edge has its partner
  LooseTriangle turned = kBar[5];
  std::ranges::rotate(turned, turned.begin() + 1);
  CHECK(join_error(both(kBar, {turned})) == join_error(doubled));
  Triangles sheet = kBar;  // a flap at one edge of the bar
  sheet.push_back({kBar[5][0], kBar[5][1], {9, 9, 9}});
  CHECK(test::has(join_error(sheet), "3 triangles meet at the edge from ("));
}

namespace {

Triangles mapped(Triangles triangles, auto to) {
  for (LooseTriangle& t : triangles) {
    for (auto& corner : t) corner = to(corner[0], corner[1], corner[2]);
  }
  return triangles;
}

std::string note_of(const Triangles& triangles) {
  return mesh_note(join_triangles(triangles, 1, "bur.stl"));
}

}  // namespace

TEST_CASE("a bur that is round about another axis or beside it, and several shells, are told") {
  using Corner = std::array<float, 3>;
  const Triangles bur = prism(1, 8, 12);
  CHECK(note_of(bur).empty());
  CHECK(note_of(prism(4, 1, 12)).empty());    // a wheel
  CHECK(note_of(upright_bar(1, 2)).empty());  // a cube, round about no axis
  CHECK(note_of(mapped(upright_bar(1, 9), [](float x, float y, float z) {
          return Corner{3 * x, y, z};  // a blade, which is not round either
        })).empty());
  const auto along_z = [](float x, float y, float z) { return Corner{x, -z, y}; };
  CHECK(begins(note_of(mapped(bur, along_z)), "it is round about (0, 0, 1), and the spindle"));
  CHECK(begins(note_of(mapped(bur,
                              [](float x, float y, float z) {
                                return Corner{y, -x, z};
                              })),
               "it is round about (1, 0, 0), and"));
  for (const float degrees : {3.0F, 45.0F}) {
    const float c = std::cos(degrees / 57.3F), s = std::sin(degrees / 57.3F);
    const std::string note = note_of(mapped(bur, [&](float x, float y, float z) {
      return Corner{x, c * y - s * z, s * y + c * z};
    }));
    CHECK(note.empty() == (degrees < 5));
  }
  CHECK(begins(note_of(moved(bur, 0.3F, 0, 0)), "its middle is 0.3 mm beside the spindle's axis"));
  const std::string two = note_of(both(bur, moved(prism(0.5, 1, 4), 0, 10, 0)));
  CHECK(begins(two, "its mesh is 2 closed shells without a common edge, the smallest from ("));
  CHECK(note_of(both(bur, inverted(prism(0.5, 1, 4)))).starts_with("its mesh is 2 closed shells"));
}

TEST_CASE("corners that the rounding of their numbers sets apart are joined, real detail is not") {
  const ToolMesh exact = join_triangles(kBar, 1, "bur.stl");
  const auto each_corner = [](Triangles triangles, auto change) {
    int count = 0;
    for (LooseTriangle& t : triangles) {
      for (auto& corner : t) {
        for (float& x : corner) x = change(x, count++);
      }
    }
    return triangles;
  };
  // Steps of the float at hand, and digits that were cut elsewhere.
  const auto stepped = each_corner(kBar, [](float x, int n) {
    return n % 3 == 0 ? std::nextafter(x, 9.0F) : n % 3 == 1 ? std::nextafter(x, -9.0F) : x;
  });
  const auto six_digits = each_corner(
      kBar, [](float x, int n) { return x + (n % 2 == 0 ? 1e-5F : 0) * std::copysign(1.0F, x); });
  CHECK(join_error(stepped).empty());
  CHECK(join_error(six_digits).empty());
  CHECK(join_error(moved(stepped, 0, 900, 0)).empty());
  const ToolMesh welded = join_triangles(six_digits, 1, "bur.stl");
  CHECK(welded.points_mm.size() == exact.points_mm.size());
  CHECK(volume_mm3(welded) == doctest::Approx(volume_mm3(exact)).epsilon(1e-4));
  const auto gaping =
      each_corner(kBar, [](float x, int n) { return x + (n % 2 == 0 ? 1e-4F : 0); });
  CHECK(begins(join_error(gaping), "bur.stl: not closed"));
  // A closed mesh keeps what is smaller than any noise.
  Triangles fine = extremes::loft({-4, -3.999999, 4}, 4, [](double y, double angle) {
    return extremes::Point{std::cos(angle), y, std::sin(angle)};
  });
  CHECK(join_triangles(fine, 1, "bur.stl").points_mm.size() == 14);
  // What the noise made flat goes, and the rest is closed.
  const auto stepped_up = [&](const Triangles& mesh) {
    return each_corner(mesh,
                       [](float x, int n) { return n % 2 == 0 ? std::nextafter(x, 9.0F) : x; });
  };
  CHECK(join_error(stepped_up(fine)).empty());
  // Detail above the noise of floats, below that of six digits.
  const auto detailed = stepped_up(extremes::loft({-4, -3.99999, 4}, 4, [](double y, double angle) {
    return extremes::Point{std::cos(angle), y, std::sin(angle)};
  }));
  CHECK(join_triangles(detailed, 1, "bur.stl").points_mm.size() == 14);
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

TEST_CASE("the samples of a mesh are those of the same body as a shape") {
  // A corner of the sides is on each sample of the rim.
  const SceneTool lathe =
      make_tool("t", "cylinder", {.pitch_mm = 1, .radius_mm = 5.3, .length_mm = 16});
  const SceneTool mesh = mesh_of_units("t", prism(5.3, 16, 400));
  // The last layers are half a pitch from the rims: what is added there goes by places on them.
  const auto between = [](const SceneTool& tool) {
    std::vector<ToolOffset> offsets;
    std::ranges::copy_if(tool.offsets, std::back_inserter(offsets),
                         [](const ToolOffset& o) { return std::abs(o[1]) < 15; });
    return offsets;
  };
  CHECK(between(mesh) == between(lathe));
  CHECK(mesh.offsets.size() - lathe.offsets.size() <= 16);
  CHECK(mesh.size_vox == lathe.size_vox);
  CHECK(mesh.radius_mm == doctest::Approx(5.3));
  CHECK(mesh.length_mm == 16);
  CHECK_FALSE(mesh.round);
}

TEST_CASE("faces through samples keep them on all sides") {
  const SceneTool bar = mesh_of_units("t", upright_bar(4, 10));
  CHECK(bar.offsets.size() == 9 * 9 * 10);
  CHECK(bar.size_vox == std::array<std::int32_t, 3>{9, 10, 9});
}

TEST_CASE("bodies that overlap are one, and a body beside the axis stays there") {
  const SceneTool one = mesh_of_units("t", upright_bar(4.2, 10));
  const SceneTool twice = mesh_of_units("t", both(upright_bar(4.2, 10), upright_bar(3.3, 10)));
  CHECK(twice.offsets == one.offsets);
  const SceneTool beside = mesh_of_units("t", moved(upright_bar(2.2, 6), 5, 30, 0));
  CHECK(beside.offsets.size() == 5 * 5 * 6);
  for (const ToolOffset& offset : beside.offsets) CHECK(offset[0] >= 2 * 3);
}

TEST_CASE("a hollow body has no samples in its hollow") {
  const SceneTool shell =
      mesh_of_units("t", both(upright_bar(5.2, 10), inverted(upright_bar(2.3, 4))));
  CHECK(shell.offsets.size() == 11 * 11 * 10 - 5 * 5 * 4);
}

TEST_CASE("samples fill the volume of a fluted bur, in any direction of its triangles") {
  const SceneTool bur = mesh_of_units("t", fluted_bur(40));
  CHECK(static_cast<double>(bur.offsets.size()) ==
        doctest::Approx(volume_mm3(bur.mesh)).epsilon(0.03));  // edges of its blades too
  const std::set<ToolOffset> different(bur.offsets.begin(), bur.offsets.end());
  CHECK(different.size() == bur.offsets.size());
}

TEST_CASE("the surface of a mesh has even samples, rows of them along its rims") {
  const SceneTool bar = mesh_of_units("t", prism(6, 16, 4));
  const auto samples = surface_samples(bar, 1);
  CHECK(samples.size() == doctest::Approx(surface_mm2(bar.mesh)).epsilon(0.01));
  std::vector<double> nearest(samples.size(), 1e9);
  double away = 0;
  int at_corners = 0, at_rims = 0;
  const double half = 6 / std::sqrt(2.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // Turned, so that the sides are at +-half.
    const auto& [x, y, z] = samples[i];
    const double u = std::abs(x + z) / std::sqrt(2.0), v = std::abs(x - z) / std::sqrt(2.0);
    const double from[3] = {half - u, half - v, 8 - std::abs(y)};
    away = std::max(away, std::abs(*std::min_element(from, from + 3)));
    const auto near = std::count_if(from, from + 3, [](double d) { return d < 0.1; });
    if (near == 3) ++at_corners;
    if (near >= 2) ++at_rims;
    for (std::size_t j = 0; j < samples.size(); ++j) {
      if (i == j) continue;
      nearest[i] = std::min(nearest[i], vec3::length(vec3::operator-(samples[i], samples[j])));
    }
  }
  CHECK(away < 0.05);
  CHECK(at_corners == 8);
  CHECK(at_rims == 8 + 8 * 7 + 4 * 15);  // edges of 8.49 and of 16
  const auto [least, most] = std::minmax_element(nearest.begin(), nearest.end());
  CHECK(*least > 0.5);
  CHECK(*most < 1.25);
}

TEST_CASE("a rim that bends has a sample in each corner") {
  const SceneTool bur = mesh_of_units("t", fluted_bur(32));
  const auto close = close_samples(bur, 1);
  const auto far = [&](const ToolMesh::Point& corner) {
    double nearest = 1e9;
    for (const SurfaceSample& sample : close) {
      nearest = std::min(nearest, vec3::length(vec3::operator-(sample.at, corner)));
    }
    return nearest;
  };
  double top = -1e9, widest = 0;
  for (const auto& p : bur.mesh.points_mm) {
    top = std::max(top, p[1]);
    widest = std::max(widest, std::hypot(p[0], p[2]));
  }
  int corners = 0;
  double farthest = 0;
  for (const auto& p : bur.mesh.points_mm) {  // where the blades end
    if (p[1] < top - 1e-9 || std::hypot(p[0], p[2]) < widest - 1e-3) continue;
    ++corners;
    farthest = std::max(farthest, far(p));
  }
  CHECK(corners >= 6);
  CHECK(farthest < 0.03);
}

TEST_CASE("a mesh reaches beyond its close samples by at most what is told, along any direction") {
  const SceneTool bur = mesh_of_units("t", fluted_bur(32));
  const auto close = close_samples(bur, 1);
  const double told = support_deficit_mm(bur.mesh, close);
  CHECK(told > 0.002);
  CHECK(told < 0.1);
  CHECK(support_deficit_mm({}, close) == 0);
  double most = 0;
  for (int i = 0; i < 2000; ++i) {  // great circles that no direction of the search follows
    const double angle = 2 * std::numbers::pi * i / 400, lean = std::floor(i / 400.0);
    const ToolMesh::Point u{std::cos(angle), std::sin(angle) * std::cos(lean),
                            std::sin(angle) * std::sin(lean)};
    double surface = -1e9, samples = -1e9;
    for (const auto& p : bur.mesh.points_mm) surface = std::max(surface, vec3::dot(u, p));
    for (const SurfaceSample& sample : close) samples = std::max(samples, vec3::dot(u, sample.at));
    most = std::max(most, surface - samples);
  }
  CHECK(most < told + 0.005);
}

TEST_CASE("a thin blade has samples on both of its sides") {
  const auto blade = extremes::loft({-8, 8}, 4, [](double y, double angle) {
    return extremes::Point{8 * std::round(std::cos(angle)), y, 0.2 * std::round(std::sin(angle))};
  });
  const auto samples = surface_samples(mesh_of_units("t", blade), 1);
  // Beyond, one row serves both rims of the narrow end.
  const auto count = [&](double sign) {
    return std::count_if(samples.begin(), samples.end(),
                         [&](const auto& s) { return sign * s[2] > 0.02 && std::abs(s[1]) < 7; });
  };
  const auto front = count(1), back = count(-1);
  CHECK(front > 180);
  CHECK(back == doctest::Approx(double(front)).epsilon(0.05));
}

TEST_CASE("a small mesh gets more samples, and one of too many is refused") {
  CHECK(surface_samples(mesh_of_units("t", prism(1, 4, 12)), 1).size() ==
        doctest::Approx(kMinSurfaceSamples).epsilon(0.02));
  const SceneTool large = mesh_of_units("large", prism(25, 60, 24));
  CHECK_THROWS_AS(static_cast<void>(surface_samples(large, 1)), LoadError);
  // Nothing but rims.
  const SceneTool thread = mesh_of_units("thread", prism(5e-5, 60, 4));
  CHECK_THROWS_AS(static_cast<void>(surface_samples(thread, 1)), LoadError);
}

TEST_CASE("a scene loads a mesh from beside its file, and tells what is wrong with one") {
  const test::TemporaryFolder folder;
  constexpr VoxelGrid kGrid{30, 30, 24};
  static_cast<void>(folder.write(
      "block.nrrd",
      test::nrrd(kGrid, {0.1, 0.1, 0.1}, test::block(kGrid, {{5, 5, 7}, {25, 25, 17}}, 1000))));
  static_cast<void>(folder.write("bur.stl", test::binary_stl(fluted_bur(1))));
  static_cast<void>(folder.write("open.stl", "solid\nendsolid\n"));
  const auto load = [&](const std::string& lines) {
    return load_scene(
        folder.write("scene.toml", "[[volume]]\nfile = \"block.nrrd\"\n[[tool]]\n" + lines));
  };
  const auto error = [&](const std::string& lines) {
    return test::error_of([&] { static_cast<void>(load(lines)); });
  };
  const std::string place = (folder.write("x", "").parent_path() / "scene.toml").string();
  const SceneTool tool = load("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 2.0\n").tools[0];
  CHECK(tool.name == "bur");
  CHECK(tool.length_mm == doctest::Approx(2));
  CHECK(tool.radius_mm == doctest::Approx(0.4).epsilon(0.001));
  CHECK(tool.pitch_mm == doctest::Approx(0.1));
  CHECK(tool.offsets.size() > 100);

  CHECK(error("shape = \"stl\"\n") == place + ":3: tool has no file; write file = \"bur.stl\"");
  CHECK(test::has(error("shape = \"stl\"\nfile = \"no.stl\"\n"), "no.stl: no such STL file"));
  CHECK(test::has(error("shape = \"stl\"\nfile = \"open.stl\"\n"), "open.stl: no triangles"));
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nradius_mm = 1.0\n") ==
        place +
            ":6: tool.radius_mm = 1 is given with a mesh, which has its own size; leave it "
            "out, or set scale (mm per unit of the file)");
  CHECK(error("shape = \"ball\"\nsize_vox = 4\nfile = \"bur.stl\"\n")
            .find("tool.file = \"bur.stl\" is of the shape stl") != std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 10\n")
            .find("tool.file = \"bur.stl\" makes a tool of 100 samples along a side") !=
        std::string::npos);
  CHECK(error("shape = \"stl\"\nfile = \"bur.stl\"\nscale = 0.01\n")
            .find("reaches less than half a voxel (0.05 mm) from its axis; use a larger scale") !=
        std::string::npos);
}

TEST_CASE("the project's fluted bur is the one that the code makes") {
  const auto file = read_stl(std::filesystem::path(KERF_SCENES_DIR) / "burs" / "fluted.stl");
  const Triangles made = fluted_bur(4);
  REQUIRE(file.size() == made.size());
  for (std::size_t t = 0; t < made.size(); ++t) {
    for (std::size_t k = 0; k < 9; ++k) {
      CHECK(std::abs(file[t][k / 3][k % 3] - made[t][k / 3][k % 3]) < 1e-5F);
    }
  }
}

namespace {

using N = FixedNumbers;

/// How far above the ideal place a tool comes to rest on a flat, for some random turns: the largest
/// difference between two tools of the same body, and the largest offset of the second.
struct Rests {
  double apart = 0, off = 0;
};

Rests rest_on_flats(const SceneTool& shape, const SceneTool& mesh) {
  constexpr VoxelGrid kGrid{40, 40, 40};
  const SampledTool shape_samples(shape), mesh_samples(mesh);
  RandomNumbers random(5);
  Rests rests;
  for (int k = 0; k < 8; ++k) {
    const Frame frame(random, {19, 19, 19});
    const Point axis = random.direction(), across = random.across(axis),
                third = cross(across, axis);
    RotationRows<N> rows;
    for (std::size_t i = 0; i < 3; ++i) {
      rows[i] = {N::Unit(across[i]), N::Unit(axis[i]), N::Unit(third[i])};
    }
    const Orientation<N> turn = orientation_of<N>(rows);
    double support = 0;
    for (const Point& p : mesh.mesh.points_mm) {
      const Point at = p[0] * across + p[1] * axis + p[2] * third;
      support = std::max(support, -dot(at, frame.up));
    }
    const Body flat = blurred(kGrid, [&](Point p) { return frame.of(p)[1] + support; });
    const auto height = [&](const SampledTool& tool) {
      return frame.of(rest_of<N>(tool, flat, frame.place, frame.up, turn, 16))[1];
    };
    const double of_mesh = height(mesh_samples);
    rests.apart = std::max(rests.apart, std::abs(of_mesh - height(shape_samples)));
    rests.off = std::max(rests.off, std::abs(of_mesh));
  }
  return rests;
}

}  // namespace

TEST_CASE("a cylinder as a mesh of 48 sides rests where the shape does, in any pose") {
  const Rests rests =
      rest_on_flats(tool_of_units("cylinder", 5, 16), mesh_of_units("mesh", prism(5, 16, 48)));
  CHECK(rests.off < 0.075);
  CHECK(rests.apart < 0.075);
}

TEST_CASE("a square bar, which no shape is, rests within the limits of the shapes") {
  const SceneTool bar = mesh_of_units("mesh", prism(6, 16, 4));
  CHECK(rest_on_flats(bar, bar).off < 0.075);
}

}  // namespace kerf::tool_mesh_test
