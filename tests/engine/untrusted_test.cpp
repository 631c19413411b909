#include <ensonify/engine/untrusted.h>

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
  CHECK_NOTHROW(require_shallow_json(levels(64)));
  CHECK_THROWS_AS(require_shallow_json(levels(65)), std::invalid_argument);
  CHECK_NOTHROW(require_shallow_json("[" + levels(63) + "," + levels(63) + "]"));
  CHECK_NOTHROW(require_shallow_json(R"({"a\"b": "\\)" + std::string(99, '{') + R"("})"));
  CHECK_THROWS_AS(require_shallow_json(R"("\\")" + levels(65)), std::invalid_argument);
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
