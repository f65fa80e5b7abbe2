// SPDX-License-Identifier: Apache-2.0
// Every row of the table of keys, by tests that are made from it: what it allows is read, and every
// slip has its answer of one line.
#include "controller/scene/scene_keys.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/law/law.hpp"
#include "controller/law/registry/law_registry.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/volume/phantom.hpp"
#include "tests/scene/scene_lines.hpp"
#include "tests/scene/support.hpp"

namespace kerf::scene_keys_test {

using namespace kerf::test;

namespace {

/// The test's own laws, so that each key that names one has a name.
template <class N>
struct Nothing {
  static constexpr const char* kName = "nothing";
  static constexpr const char* kMeaning = "gives no force";
  static constexpr std::array<LawSetting, 1> kSettings{{{"share", "", 0, 1, 0.5, "of nothing"}}};
  struct State {};
  explicit Nothing(const LawSetup&) {}
  DeviceVec<typename N::Real> step(const auto&, State&) const noexcept { return {}; }
};
KERF_REGISTER_FORCE_LAW(Nothing)
template <class N>
struct Calm : Nothing<N> {
  using Nothing<N>::Nothing;
};
KERF_REGISTER_STABILISER(Calm)

std::string error_of(const std::string& text, SceneKeys keys = scene_keys()) {
  return test::error_of([&] { static_cast<void>(parse_scene(text, "x.toml", keys)); });
}

std::string in_quotes(std::string_view word) {
  return '"' + std::string(word) + '"';
}

std::string list_of(const std::vector<double>& numbers) {
  return written(TomlValue{numbers});
}

/// A value that a key may not have, and what is said of it.
struct Wrong {
  std::string value;
  std::string says;
};

constexpr double kInf = std::numeric_limits<double>::infinity();
const std::string kNoNumber = " is not a number; write one without quotes or unit";

/// Values that are allowed, the ends of the range among them, and values that are not: by the type
/// of the slot.
struct Samples {
  const SceneKey& key;
  std::vector<std::string> right;
  std::vector<Wrong> wrong;

  void operator()(const bool*) {
    right = {"true", "false"};
    for (const char* value : {"1", "\"true\"", "[true]"})
      wrong.push_back({value, " is not a switch"});
  }
  void operator()(const int*) {
    const auto [lo, hi] = key.allowed.range;
    right = {number_text(lo), number_text(hi)};
    for (const double out : {lo - 1, hi + 1, -1e9, 1e9}) {
      wrong.push_back({std::to_string(std::llround(out)), " is out of range; use "});
    }
    for (const char* value : {"100.5", "nan", "inf", "\"100\"", "true", "[100]", "1979-05-27"}) {
      wrong.push_back({value, " is not a whole number; write one without point or exponent"});
    }
  }
  void operator()(const double*) {
    const auto [lo, hi] = key.allowed.range;
    right = {number_text(lo), number_text(hi)};
    for (const std::string_view word : key.allowed.words) right.push_back(in_quotes(word));
    for (const std::string& value : outside()) wrong.push_back({value, " is out of range; use "});
    for (const char* value : {"true", "[1]", "{}", "1979-05-27"})
      wrong.push_back({value, kNoNumber});
    wrong.push_back({"\"zzz\"", key.allowed.words.empty() ? kNoNumber : " is unknown; "});
  }
  template <class Text>
  void operator()(const Text*) {
    for (const std::string_view word : key.allowed.words) right.push_back(in_quotes(word));
    if (key.allowed.words.empty()) right = {"\"abc\""};
    if (!key.allowed.words.empty()) wrong = {{"\"zzz\"", " is unknown; "}};
    wrong.push_back({"\"\"", " is not a usable text; "});
    wrong.push_back({in_quotes(std::string(257, 'a')), " is not a usable text; "});
    for (const char* value : {"3", "true", "[\"a\"]", "{}"}) {
      wrong.push_back({value, " is not text; put it in quotes"});
    }
  }
  void operator()(const Denoise*) {
    (*this)(static_cast<int*>(nullptr));
    for (const std::string_view word : key.allowed.words) right.push_back(in_quotes(word));
    std::erase_if(wrong, [](const Wrong& value) { return value.value == "\"100\""; });
    wrong.push_back({"\"1\"", " is unknown; "});
    wrong.push_back({"\"\"", " is not a usable text; "});
  }
  template <std::size_t N>
  void operator()(const std::array<double, N>*) {
    const auto [lo, hi] = key.allowed.range;
    std::vector<double> numbers(N, hi);
    if (key.name == "volume.window") numbers = {lo, hi};                // rises
    if (key.name == "volume.pose.orientation") numbers = {1, 0, 0, 0};  // of length one
    right = {list_of(numbers)};
    if (N == 3) right.push_back(list_of({lo, lo, lo}));
    if (key.options.one_for_all) right.push_back(number_text(lo));
    for (const std::string& value : outside()) {
      std::string list = list_of(std::vector<double>(N - 1, hi));
      list.insert(list.size() - 1, ", " + value);
      wrong.push_back({list, " is out of range; use "});
    }
    const std::string form = " is not a list of " + std::to_string(N) + " numbers; write [";
    for (const std::size_t count : {N - 1, N + 1}) {
      wrong.push_back({list_of(std::vector<double>(count, hi)), form});
    }
    wrong.push_back({"[]", form});
    wrong.push_back({"\"zzz\"", key.options.one_for_all ? kNoNumber : form});
    std::string mixed = list_of(std::vector<double>(N - 1, hi));
    wrong.push_back({mixed.insert(mixed.size() - 1, ", true"), form});
  }
  void operator()(const LawChoice* law) {
    for (const LawRow* known : known_laws(law->kind)) {
      right.push_back("{ name = " + in_quotes(known->name) + " }");
      right.push_back(in_quotes(known->name));
    }
    if (law->kind != LawKind::velocity) {
      right.push_back(law->kind == LawKind::force ? "\"coupling\"" : "\"none\"");
    }
    wrong.push_back({"\"zzz\"", " is unknown"});
    for (const char* value : {"1", "[]", "{}", "{ name = 1 }", "{ tau_ms = 1 }"}) {
      wrong.push_back({value, " does not say which; write { name = "});
    }
  }
  void operator()(const VoxelGrid*) {
    (*this)(static_cast<std::array<double, 3>*>(nullptr));
    wrong.push_back({"[64, 64.5, 64]", " counts voxels; write whole numbers"});
  }
  template <class T>
  void operator()(const std::optional<T>*) {
    (*this)(static_cast<const T*>(nullptr));
  }

 private:
  [[nodiscard]] std::vector<std::string> outside() const {
    const auto [lo, hi] = key.allowed.range;
    return {number_text(std::nextafter(lo, -kInf)), number_text(std::nextafter(hi, kInf)), "nan",
            "inf", "-inf"};
  }
};

Samples samples_of(const SceneKey& key) {
  SceneParts parts;
  Samples samples{key, {}, {}};
  std::visit([&](const auto* slot) { samples(slot); }, key.at(parts));
  return samples;
}

/// One line that begins with `x.toml:LINE: name = ` and tells a way out.
void must_answer(const std::string& error, const SceneLines& lines, const SceneKey& key,
                 const std::string& says) {
  CAPTURE(error);
  CAPTURE(says);
  CHECK(error.rfind("x.toml:" + std::to_string(lines.line_of(key.name)) + ": " +
                        std::string(key.name) + " = ",
                    0) == 0);
  CHECK(has(error, says));
  CHECK(has(error, "; "));
  CHECK(error.find('\n') == std::string::npos);
}

}  // namespace

TEST_CASE("every row: what it allows is read, both ends of its range too") {
  for (const SceneKey& key : scene_keys()) {
    if (key.name == "tool.bur") continue;  // stands for other keys: scene_file_test.cpp
    for (const std::string& value : samples_of(key).right) {
      SceneLines lines = scene_for(key).set(key.name, value);
      // The upper ends are those of the strongest device.
      if (key.name.starts_with("limits.")) lines.set("device.personality", "\"omega\"");
      if (key.name == "limits.slew_n_per_ms") lines.set("limits.force_n", "3.3");
      if (key.name == "device.first_tool") lines.set("tool.name", value);
      if (value == in_quotes(kMeshShape)) lines.set("tool.file", "\"a.stl\"").drop("tool.size_vox");
      // Something must be solid.
      const std::string second = "[[volume]]\nname = \"second\"\nfile = \"phantom\"\n";
      CAPTURE(lines.text());
      CHECK(error_of(lines.text() + second).empty());
    }
  }
}

TEST_CASE("every row: a wrong value has its answer with line, key, value and a way out") {
  std::size_t count = 0;
  for (const SceneKey& key : scene_keys()) {
    for (const Wrong& wrong : samples_of(key).wrong) {
      const SceneLines lines = scene_for(key).set(key.name, wrong.value);
      CAPTURE(lines.text());
      must_answer(error_of(lines.text()), lines, key, wrong.says);
      ++count;
    }
  }
  CHECK(count > 400);
}

TEST_CASE("a law that is unknown, or has no such setting, has its answer") {
  const auto answer = [](const std::string& table) {
    return error_of("[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = \"ball\"\nsize_vox = 16\n" +
                    table);
  };
  CHECK(answer("[servo.velocity]\nname = \"difference\"\ntau_ms = 1000\n").empty());
  CHECK(answer("[servo.velocity]\nname = \"diference\"\n") ==
        "x.toml:7: servo.velocity.name = \"diference\" is unknown; did you mean \"difference\"? "
        "known: difference, foaw");
  CHECK(answer("[servo.velocity]\ntau = 3\nname = \"difference\"\n") ==
        "x.toml:7: servo.velocity.tau = 3 is unknown; did you mean tau_ms? known: tau_ms");
  CHECK(answer("[servo.velocity]\nname = \"foaw\"\ntau_ms = 3\n") ==
        "x.toml:8: servo.velocity.tau_ms = 3 is unknown; foaw has no settings, leave it out");
  for (const char* value : {"1000.1", "-1e-9", "nan", "inf"}) {
    CHECK(answer("[servo.velocity]\nname = \"difference\"\ntau_ms = " + std::string(value))
              .ends_with(" is out of range; use 0 to 1000"));
  }
  CHECK(answer("[servo.velocity]\nname = \"difference\"\ntau_ms = \"1\"").ends_with(kNoNumber));
  CHECK(answer("[force]\ndamping_ns_per_mm = 0\nlaw = { name = \"nothing\" }\n") ==
        "x.toml:7: force.damping_ns_per_mm = 0 is of the coupling, and force.law is in its place; "
        "leave it out");
  CHECK(answer("[force]\nmodel = \"paper\"\nlaw = { name = \"x\" }\n")
            .find(" is of the model proxy; leave it out") != std::string::npos);
}

TEST_CASE("a force law on the command line takes the place of the coupling and its keys") {
  const auto scene = [](std::vector<KeyOverride> settings) {
    return parse_scene(
        "[[volume]]\nfile = \"phantom\"\n[[tool]]\nshape = \"ball\"\nsize_vox = 16\n"
        "[force]\nstiffness_n_per_mm = 0.4\ndamping_ns_per_mm = 0.001\n",
        "x.toml", scene_keys(), settings);
  };
  CHECK(scene({{"force.law", "nothing"}}).force.law.name == "nothing");
  CHECK(scene({{"force.law.share", "1"}, {"force.law", "nothing"}}).force.law.settings.size() == 1);
  CHECK(scene({{"force.law", "{ name = \"nothing\" }"}}).force.law.name == "nothing");
  for (const char* word : {"coupling", "\"coupling\""}) {  // its keys stay
    CHECK(scene({{"force.law", word}}).force.stiffness_n_per_mm == 0.4);
  }
  CHECK(test::error_of([&] {
          static_cast<void>(scene({{"force.stiffness_n_per_mm", "1"}, {"force.law", "nothing"}}));
        }) ==
        "x.toml: --set force.stiffness_n_per_mm = 1 is of the coupling, and force.law is in its "
        "place; leave it out");
  CHECK(test::error_of([&] {
          static_cast<void>(scene({{"force.law", "{ name = \"nothing\", shares = 1 }"}}));
        }) == "x.toml: --set force.law.shares = 1 is unknown; did you mean share? known: share");
}

TEST_CASE("a later setting drops the earlier ones that it leaves without a meaning") {
  const auto left = [](const KeyOverride& later) {
    std::vector<KeyOverride> earlier{{"force.stiffness_n_per_mm", "0.4"},
                                     {"force.law.share", "1"},
                                     {"force.law", "nothing"},
                                     {"servo.velocity.tau_ms", "1"}};
    drop_replaced(earlier, later);
    std::string keys;
    for (const KeyOverride& one : earlier) keys += one.key + ' ';
    return keys;
  };
  CHECK(left({"force.law", "calm"}) == "servo.velocity.tau_ms ");
  CHECK(left({"force.law", "coupling"}) == "force.stiffness_n_per_mm servo.velocity.tau_ms ");
  CHECK(left({"servo.velocity", "foaw"}) == "force.stiffness_n_per_mm force.law.share force.law ");
  CHECK(left({"force.law.share", "0"}) ==
        "force.stiffness_n_per_mm force.law servo.velocity.tau_ms ");
}

TEST_CASE("every row: its default is allowed") {
  SceneParts defaults;
  for (const SceneKey& key : scene_keys()) {
    CAPTURE(key.name);
    const TomlValue value = value_of(key, defaults);
    const auto allowed = [&](double number) {
      return number >= key.allowed.range.lo && number <= key.allowed.range.hi;
    };
    if (const auto* number = std::get_if<double>(&value)) CHECK(allowed(*number));
    if (const auto* whole = std::get_if<std::int64_t>(&value)) CHECK(allowed(double(*whole)));
    // No torque per count at all keeps the motors off.
    if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
      CHECK(std::ranges::all_of(*numbers, allowed));
    }
    CHECK((key.allowed.words.empty() || !key.options.required_as.empty() ||
           !std::holds_alternative<std::monostate>(value)));
  }
}

TEST_CASE("every row: a key that the scene's choices leave no meaning is refused") {
  for (const SceneKey& key : scene_keys()) {
    if (key.only_with.key.empty()) continue;
    const SceneLines lines = scene_for(key, false).set(key.name, samples_of(key).right.front());
    CAPTURE(lines.text());
    must_answer(error_of(lines.text()), lines, key, "; leave it out");
  }
}

TEST_CASE("every row: a key without a default is asked for") {
  std::size_t count = 0;
  for (const SceneKey& key : scene_keys()) {
    if (key.options.required_as.empty()) continue;
    SceneLines lines = scene_for(key).drop(key.name);
    const std::string table(key.name.substr(0, key.name.find('.')));
    if (table == "material") lines.set("material.iso", "0.5");
    if (key.name == "volume.file") lines.set("volume.crop", "true");
    CAPTURE(lines.text());
    const std::string says = table + " has no " + std::string(name_in_table(key)) + "; write ";
    CHECK(error_of(lines.text()).find(says) != std::string::npos);
    ++count;
  }
  CHECK(count == 4);
}

TEST_CASE("every row: a key with any one letter wrong is answered with the key") {
  for (const SceneKey& key : scene_keys()) {
    const std::string value = samples_of(key).right.front();
    const std::size_t last = key.name.rfind('.') + 1;
    for (std::size_t at = last; at < key.name.size(); ++at) {
      std::string slip(key.name);
      slip[at] = slip[at] == 'q' ? 'z' : 'q';
      const SceneLines lines = scene_for(key).set(slip, value);
      const std::string error = error_of(lines.text());
      CAPTURE(error);
      CHECK(error.rfind("x.toml:" + std::to_string(lines.line_of(slip)) + ":", 0) == 0);
      const std::string unit = key.unit.empty() ? "" : " (in " + std::string(key.unit) + ")";
      CHECK(has(error,
                slip + " is not a known key; did you mean " + std::string(key.name) + unit + "?"));
    }
  }
}

TEST_CASE("every row: a key in another table is told where it belongs") {
  for (const SceneKey& key : scene_keys()) {
    const std::string name(key.name.substr(key.name.rfind('.') + 1));
    for (const std::string_view table : names_below("", scene_keys())) {
      const auto known = names_below(std::string(table) + ".", scene_keys());
      if (std::ranges::find(known, name) != known.end()) continue;
      const std::string misplaced = std::string(table) + "." + name;
      const std::string error =
          error_of(scene_for(key).set("material.name", "\"wax\"").set(misplaced, "1").text());
      CAPTURE(error);
      CHECK(has(error, misplaced + " is not a known key; did you mean "));
      CHECK(has(error, std::string(key.name)));
    }
    const std::string bare = error_of(name + " = 1\n" + scene_for(key).text());
    CHECK(bare.find("x.toml:1:1: " + name + " is not a known key; did you mean ") == 0);
    CHECK(has(bare, std::string(key.name)));
  }
}

TEST_CASE("every row: a key that stands twice is one line with line and column") {
  for (const SceneKey& key : scene_keys()) {
    const SceneLines lines = scene_for(key).set(key.name, samples_of(key).right.front());
    std::istringstream text(lines.text());
    std::string doubled, line;
    for (long at = 1; std::getline(text, line); ++at) {
      doubled += line + "\n";
      if (at == lines.line_of(key.name)) doubled += line + "\n";
    }
    const std::string error = error_of(doubled);
    CAPTURE(error);
    CHECK(error.rfind("x.toml:" + std::to_string(lines.line_of(key.name) + 1) + ":", 0) == 0);
    CHECK(has(error, "; leave one of the two out"));
    CHECK(error.find('\n') == std::string::npos);
  }
}

TEST_CASE("every table: one of another form is answered with the right one") {
  for (const std::string_view row : names_below("", scene_keys())) {
    const std::string table(row);
    const bool list = most_of(table) > 0;
    const std::string says = list ? " is not a list of tables; write [[" + table + "]]"
                                  : " is not a table; write [" + table + "]";
    const std::string head = "x.toml:1: " + table + " = ";
    CHECK(error_of(table + " = 3\n") == head + "3" + says);
    if (table == "device" || table == "hand") continue;  // a list of them is two arms
    CHECK(error_of((list ? "[" + table + "]" : "[[" + table + "]]") + "\n") ==
          head + (list ? "{..}" : "[{..}]") + says);
  }
}

TEST_CASE("the settings in effect: of the models that the scene has, in the table's order") {
  const std::string text = settings_text(parse_scene(
      SceneLines().set("tool.size_vox", "16").set("force.model", "\"paper\"").text(), "x.toml"));
  CHECK(text.rfind("volume.name=\"phantom\"\nvolume.file=\"phantom\"\nvolume.shape="
                   "\"molar\"\nvolume.iso=\"otsu\"\n",
                   0) == 0);
  CHECK(has(text, "\nforce.model=\"paper\"\nforce.p0_n_per_mm2=0.06\ncut.model=\"overlap\"\n"));
  CHECK(text.find("stiffness_n_per_mm") == std::string::npos);
  CHECK(text.find("spindle.") == std::string::npos);
}

TEST_CASE("a quoted name with a dot is no key") {
  CHECK(has(error_of("\"force.friction\" = 0.5\n"), "is not a known key"));
  CHECK(error_of("[[volume]]\nfile = \"a\"\n\"pose.position_mm\" = [1, 2, 3]\n")
            .find("is not a known key") != std::string::npos);
}

TEST_CASE("every row: the unit is the one that its name tells") {
  constexpr std::pair<std::string_view, std::string_view> kUnits[] = {{"_n_per_mm2", "N/mm^2"},
                                                                      {"_ns_per_mm", "N s/mm"},
                                                                      {"_n_per_mm", "N/mm"},
                                                                      {"_mm_per_s", "mm/s"},
                                                                      {"_n_per_ms", "N/ms"},
                                                                      {"_per_s_n", "mm^3/(s N)"},
                                                                      {"_per_s", "1/s"},
                                                                      {"_n_mm", "N mm"},
                                                                      {"_g_mm2", "g mm^2"},
                                                                      {"_krpm", "1000/min"},
                                                                      {"_mm", "mm"},
                                                                      {"_n", "N"},
                                                                      {"_hz", "Hz"},
                                                                      {"_rad", "rad"},
                                                                      {"_vox", "voxels"}};
  for (const SceneKey& key : scene_keys()) {
    const auto unit = std::ranges::find_if(
        kUnits, [&](const auto& pair) { return key.name.ends_with(pair.first); });
    CAPTURE(key.name);
    if (unit != std::end(kUnits)) CHECK(key.unit == unit->second);
  }
}

TEST_CASE("docs/scene-keys.md begins with what the table says") {
  std::ifstream file(KERF_DOCS "/scene-keys.md", std::ios::binary);
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  INFO("renew it: tests/docs/reference/make.py . build/release/bin write");
  const LawRow* own = std::exchange(first_own_law, nullptr);
  CHECK(page.starts_with(scene_keys_page()));  // behind it are the keys of other files
  first_own_law = own;
  CHECK(has(scene_keys_page(), "`law = { name = \"nothing\" }`: gives no force.\n"));
  const VoxelGrid grid = PhantomSpec{}.grid;
  const double sides[] = {double(grid.nx), double(grid.ny), double(grid.nz)};
  const auto size = std::ranges::find(scene_keys(), "volume.size", &SceneKey::name);
  CHECK(size->options.default_text == list_of({std::begin(sides), std::end(sides)}));
}

TEST_CASE("a new row alone brings a key: it is read, checked, told, printed and explained") {
  static double grip_n = 1;
  std::vector<SceneKey> keys(scene_keys().begin(), scene_keys().end());
  keys.push_back({"limits.grip_n",
                  "N",
                  [](SceneParts&) -> SceneSlot { return &grip_n; },
                  {{0.5, 9}, {}},
                  "how hard the hand holds",
                  {"force.model", "proxy"}});
  const SceneLines lines = scene_for(keys.back()).set("limits.grip_n", "2.5");
  CHECK(
      error_of(lines.text(keys)).find(": limits.grip_n is not a known key; known here: force_n") !=
      std::string::npos);
  const SceneSpec scene = parse_scene(lines.text(keys), "x.toml", keys);
  CHECK(grip_n == 2.5);
  CHECK(has(settings_text(scene, keys), "\nlimits.grip_n=2.5\n"));
  LoadedScene loaded;
  CHECK(has(canonical_json(loaded, keys), "\"grip_n\":2.5,"));
  CHECK(has(scene_keys_page(keys),
            "| `grip_n` | N | 0.5 to 9 | 2.5 | how hard the hand holds; "
            "only with force.model = \"proxy\" |\n"));

  const auto answer = [&](const std::string& key, const std::string& value) {
    return error_of(scene_for(keys.back()).set(key, value).text(keys), keys);
  };
  CHECK(has(answer("limits.grip_n", "10"), "limits.grip_n = 10 is out of range; use 0.5 to 9"));
  CHECK(has(answer("limits.grip", "1"), "did you mean limits.grip_n (in N)?"));
  CHECK(has(answer("cut.grip_n", "1"), "did you mean limits.grip_n (in N)?"));
  const std::string paper =
      error_of(scene_for(keys.back(), false).set("limits.grip_n", "1").text(keys), keys);
  CHECK(has(paper,
            "limits.grip_n = 1 is of the model proxy; leave it out, or set model = "
            "\"proxy\""));
}

}  // namespace kerf::scene_keys_test
