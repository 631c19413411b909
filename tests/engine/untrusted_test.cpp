#include <ensonify/engine/untrusted.h>

#include <stdexcept>
#include <string>

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
