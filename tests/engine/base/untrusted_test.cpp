#include <ensonify/engine/base/untrusted.h>

#include <cstdint>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "support/catch.h"

using namespace ensonify::engine;

TEST_CASE("JSON may be 64 levels deep, and brackets in its texts do not count") {
  const auto levels = [](std::size_t count) {
    return std::string(count, '[') + std::string(count, ']');
  };
  CHECK(!too_deep_in_json(levels(64)));
  CHECK(too_deep_in_json(levels(65)) == 64);
  CHECK(!too_deep_in_json("[" + levels(63) + "," + levels(63) + "]"));
  CHECK(!too_deep_in_json(R"({"a\"b": "\\)" + std::string(99, '{') + R"("})"));
  CHECK(too_deep_in_json(R"("\\")" + levels(65)) == 4 + 64);
}

TEST_CASE("A statement of TOML may be 64 levels deep, and strings and comments do not count") {
  const auto key = [](std::size_t dots) {
    std::string text = "a";
    for (std::size_t i = 0; i < dots; ++i) text += ".a";
    return text;
  };
  const auto value = [](std::size_t brackets) {
    return std::string(brackets, '[') + std::string(brackets, ']');
  };
  CHECK(!too_deep_in_toml(key(64) + " = 1\n" + key(64) + " = 2\n"));
  CHECK(too_deep_in_toml("b = 1\n" + key(65) + " = 1") == 6 + 129);
  CHECK(!too_deep_in_toml("[" + key(63) + "]\n" + key(64) + " = 1"));
  CHECK(too_deep_in_toml("[" + key(64) + "]"));
  CHECK(too_deep_in_toml("[[" + key(63) + "]]"));
  CHECK(!too_deep_in_toml("a = " + value(64)));
  CHECK(too_deep_in_toml("a = " + value(65)));
  CHECK(too_deep_in_toml("a.b = " + value(64)));
  CHECK(!too_deep_in_toml("a.b = [" + value(62) + ",\n " + value(62) + "]"));
  CHECK(
      !too_deep_in_toml("a = [" + std::string(500, '1') + ".5, 2.5, 3.5, 1979-05-27T07:32:00.9]"));
  CHECK(too_deep_in_toml("a = {b = 1, " + key(64) + " = 1}"));
  CHECK(too_deep_in_toml("a = {b = 1, c = {" + key(63) + " = 1}}"));
  for (const std::string& text :
       {R"(a = ")" + key(99) + R"(\"")", "a = '" + key(99) + "\\'", "# " + key(99),
        "a = 1 # " + key(99), R"(a = """)" + key(99) + "\n\"" + key(99) + R"(\""""")",
        "a = '''" + key(99) + "\n'" + key(99) + "\\''''", R"("a." . ")" + key(99) + "\" = 1"}) {
    CAPTURE(text);
    CHECK(!too_deep_in_toml(text));
    CHECK(too_deep_in_toml(text + "\n" + key(99)));  // the string has ended where it does
  }
  CHECK(
      too_deep_in_toml("a = [\"\"\"b\"\"\"\", {" + key(99) + " = 1}]"));  // a quote before its end
}

TEST_CASE("JSON that is none, or too deep, is refused with the byte, or is null") {
  using Json = nlohmann::ordered_json;
  CHECK(json_of<Json>(R"({"a": 1})").at("a") == 1);
  const std::string deep = std::string(99, '[') + std::string(99, ']');
  CHECK_THROWS_WITH(json_of<Json>("[1, nan]"),
                    Catch::Contains("this is not JSON") && Catch::Contains("from byte 6 on"));
  CHECK_THROWS_WITH(json_of<Json>("1e999"), Catch::StartsWith("this is not JSON"));
  CHECK_THROWS_WITH(json_of<Json>(deep, "; make it again"),
                    "this JSON has lists or objects more than 64 levels deep, from byte 65 on; "
                    "make it again");
  for (const std::string& wrong : {deep, std::string("1e999"), std::string("[")})
    CHECK(json_or_null<Json>(wrong).is_null());
  try {
    Json::parse("{}").at("a");
  } catch (const std::exception& error) {
    CHECK(fault_in_json(error) == "key 'a' not found");
  }
  CHECK(fault_in_json(std::out_of_range("too many")) == "too many");
}

TEST_CASE("A path stays inside its folder unless it is absolute or goes above it") {
  for (const char* inside : {"a", "a/b.png", "a/../b", "..."}) CHECK(stays_inside(inside));
  for (const char* outside : {"", "/a", "..", "../a", "a/../../b"}) CHECK(!stays_inside(outside));
}

TEST_CASE("A whole number is one that its type holds, also in lists") {
  using Json = nlohmann::ordered_json;
  CHECK(whole_numbers(Json::parse("18446744073709551615")).get<std::uint64_t>() ==
        18446744073709551615u);
  CHECK(whole_numbers(Json::parse("65535"), 65535).get<std::uint16_t>() == 65535);
  CHECK_NOTHROW(whole_numbers(Json::parse(R"([[0, 7], {"a": 9, "b": "-1"}])"), 9));
  for (const char* wrong :
       {"-1", "2.0", "1e300", "18446744073709551616", "[1, [2, -3]]", R"({"a": 0.5})"}) {
    CAPTURE(wrong);
    CHECK_THROWS_AS(whole_numbers(Json::parse(wrong)), std::out_of_range);
  }
  CHECK_THROWS_AS(whole_numbers(Json::parse("65536"), 65535), std::out_of_range);
}
