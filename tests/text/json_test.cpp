// SPDX-License-Identifier: Apache-2.0
#include "shared/text/json.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

namespace kerf::json_test {
namespace {

std::string error_of(const auto& read) {
  try {
    static_cast<void>(read());
  } catch (const JsonError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("a document keeps the order of its members and has two blanks for each level") {
  const Json report{{"name", "kerf"},           {"ticks", 3U},
                    {"list", std::array{1, 2}}, {"inner", {{"b", true}, {"a", nullptr}}},
                    {"none", Json::List{}},     {"empty", Json::Members{}}};
  CHECK(report.document() ==
        "{\n  \"name\": \"kerf\",\n  \"ticks\": 3,\n  \"list\": [\n    1,\n    2\n  ],\n"
        "  \"inner\": {\n    \"b\": true,\n    \"a\": null\n  },\n  \"none\": [],\n"
        "  \"empty\": {}\n}\n");
}

TEST_CASE("the canonical text is one line with sorted keys") {
  const Json value{{"b", 1}, {"a", {{"d", 0.5}, {"c", -1}}}};
  CHECK(value.canonical() == R"({"a":{"c":-1,"d":0.5},"b":1})");
  CHECK(Json::parse(value.canonical()).canonical() == value.canonical());
  CHECK(Json("a \"b\"\n").canonical() == R"("a \"b\"\n")");
}

TEST_CASE("numbers are written as what they are") {
  CHECK(Json(1.0).canonical() == "1.0");
  CHECK(Json(0.1).canonical() == "0.1");
  CHECK(Json(0.1F).canonical() == "0.10000000149011612");
  CHECK(Json(UINT64_MAX).canonical() == "18446744073709551615");
  CHECK(Json(INT64_MIN).canonical() == "-9223372036854775808");
  CHECK(Json(std::nan("")).canonical() == "null");
  CHECK(Json(INFINITY).canonical() == "null");
}

TEST_CASE("what may be absent is null, a path is text, and a list takes any of them") {
  CHECK(Json(std::optional<double>()).canonical() == "null");
  CHECK(Json(std::optional(2.5)).canonical() == "2.5");
  CHECK(Json(std::filesystem::path("/a/b")).canonical() == R"("/a/b")");
  CHECK(Json(std::vector<std::array<int, 2>>{{1, 2}, {3, 4}}).canonical() == "[[1,2],[3,4]]");
  CHECK(Json(std::vector<std::string>{"x"}).canonical() == R"(["x"])");
}

TEST_CASE("bytes that are not UTF-8 do not stop a report") {
  CHECK(Json("a\xff").canonical() == "\"a\xef\xbf\xbd\"");
  CHECK(Json("a\xff").document() == "\"a\xef\xbf\xbd\"\n");
}

TEST_CASE("members and values are added one by one, and a member is written over") {
  Json value;
  value["list"].push_back(1);
  value["list"].push_back("two");
  value["list"].push_back({{"three", 3}});
  value["name"] = "old";
  value["name"] = "new";
  CHECK(value.canonical() == R"({"list":[1,"two",{"three":3}],"name":"new"})");
  CHECK(error_of([&] { return value["name"]["below"]; }) == "not an object");
  CHECK(error_of([&] { return (value.push_back(1), 0); }) == "not a list");
}

TEST_CASE("what is written is read back") {
  const Json value = Json::parse(
      R"({"t": true, "n": 7, "m": -7, "d": 2.5, "s": "x", "l": [1, 2, 3], "p": [[1, 2]]})");
  CHECK(value.at("t").get<bool>());
  CHECK(value.at("n").get<std::uint32_t>() == 7);
  CHECK(value.at("n").get<int>() == 7);
  CHECK(value.at("n").get<double>() == 7.0);
  CHECK(value.at("m").get<std::int64_t>() == -7);
  CHECK(value.at("m").get<double>() == -7.0);
  CHECK(value.at("d").get<double>() == 2.5);
  CHECK(value.at("d").is_fraction());
  CHECK_FALSE(value.at("n").is_fraction());
  CHECK(value.at("s").is_text());
  CHECK(value.at("s").get<std::string>() == "x");
  CHECK(value.at("l").size() == 3);
  CHECK(value.at("l").at(2).get<int>() == 3);
  CHECK(value.at("l").get<std::array<double, 3>>() == std::array{1.0, 2.0, 3.0});
  CHECK(value.at("l").get<std::vector<int>>() == std::vector{1, 2, 3});
  CHECK(value.at("p").get<std::vector<std::array<int, 2>>>().front()[1] == 2);
  int sum = 0;
  for (const Json& one : value.at("l")) sum += one.get<int>();
  CHECK(sum == 6);
  CHECK(value.contains("t"));
  CHECK_FALSE(value.contains("u"));
  CHECK(value.members().size() == 7);
}

TEST_CASE("each wrong shape is refused in its own words") {
  const Json value =
      Json::parse(R"({"n": -7, "d": 2.5, "s": "x", "l": [1, 2], "big": 4294967296})");
  CHECK(error_of([&] { return value.at("u"); }) == "\"u\" is missing");
  CHECK(error_of([&] { return value.at(0); }) == "not a list");
  CHECK(error_of([&] { return value.at("l").at(2); }) == "no value 2 in the list");
  CHECK(error_of([&] { return value.at("l").at("x"); }) == "not an object");
  CHECK(error_of([&] { return value.at("s").begin(); }) == "not a list");
  CHECK(error_of([&] { return value.at("s").get<double>(); }) == "not a number");
  CHECK(error_of([&] { return value.at("s").get<bool>(); }) == "not true or false");
  CHECK(error_of([&] { return value.at("d").get<std::string>(); }) == "not a text");
  CHECK(error_of([&] { return value.at("d").get<int>(); }) == "not a whole number");
  CHECK(error_of([&] { return value.at("n").get<unsigned>(); }) == "not a whole number from 0");
  CHECK(error_of([&] { return value.at("big").get<std::uint32_t>(); }) == "above 4294967295");
  CHECK(error_of([&] { return value.at("big").get<int>(); }) == "above 2147483647");
  CHECK(error_of([&] { return Json(INT64_MIN).get<int>(); }) ==
        "not from -2147483648 to 2147483647");
  CHECK(error_of([&] { return value.at("l").get<std::array<int, 3>>(); }) == "not a list of 3");
}

TEST_CASE("text that is no JSON is refused, and none can exhaust the stack") {
  for (const char* text : {"", "{", "[1,", "{\"a\" 1}", "nan", "01", "\"\xff\"", "1 2"}) {
    CAPTURE(text);
    CHECK(error_of([&] { return Json::parse(text); }).find("no JSON at character ") !=
          std::string::npos);
  }
  CHECK(error_of([] { return Json::parse("[1e400]"); }) == "a number out of range");
  const auto nested = [](std::size_t levels) {
    return std::string(levels, '[') + std::string(levels, ']');
  };
  CHECK(error_of([&] { return Json::parse(nested(60)); }) == "no error");
  CHECK(error_of([&] { return Json::parse(nested(100'000)); }) == "nested too deep");
}

TEST_CASE("a name that stands twice in one object is found, at any depth") {
  CHECK(doubled_key(R"({"a": 1, "b": {"a": 2}, "c": [{"a": 1}, {"a": 2}]})") == std::nullopt);
  CHECK(doubled_key(R"({"rows": 1, "b": 2, "rows": 1})") == "rows");
  CHECK(doubled_key(R"({"a": [{"b": {"c": 1, "\u0063": 2}}]})") == "c");
  CHECK(doubled_key(R"({"a": 1, "a": )") == std::nullopt);  // no JSON
  CHECK(doubled_key("[1, 2]") == std::nullopt);
}

}  // namespace kerf::json_test
