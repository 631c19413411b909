#include <ensonify/refine/printable.h>

#include <string>

#include "support/catch.h"

using ensonify::refine::is_utf8;
using ensonify::refine::printable;
using ensonify::refine::shortened;

TEST_CASE("Control characters and bytes that are not UTF-8 become printable, all others stay") {
  CHECK(printable("") == "");
  CHECK(printable("größe/深さ/🐟.toml") == "größe/深さ/🐟.toml");
  CHECK(printable("\x1b[31mred\x07\n\t\x7f") == "\\x1B[31mred\\x07\\x0A\\x09\\x7F");
  CHECK(printable(std::string("a\0b", 3)) == "a\\x00b");
  CHECK(printable("\xc2\x9b"
                  "31m") == "\\xC2\\x9B31m");  // U+009B, which begins sequences, too
  CHECK(printable("\xc2\xa0") == "\xc2\xa0");  // the first character after those
  CHECK(printable("a\nb\x1b\n", "\n") == "a\nb\\x1B\n");
}

TEST_CASE("What is UTF-8 follows table 3-7 of the Unicode Standard") {
  for (const std::string good :
       {"\x7e", "\xc2\xa0", "\xdf\xbf", "\xe0\xa0\x80", "\xec\xbf\xbf", "\xed\x9f\xbf",
        "\xee\x80\x80", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf3\xbf\xbf\xbf", "\xf4\x8f\xbf\xbf"})
    CHECK((is_utf8(good) && printable(good) == good));
  for (const std::string wrong :
       {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xc2", "\xc2\x7f", "\xdf\xc0", "\xe0\x9f\xbf",
        "\xe0\xa0", "\xed\xa0\x80", "\xef\xbf", "\xef\xbf\xc0", "\xf0\x8f\xbf\xbf", "\xf0\x90\x80",
        "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff"}) {
    CAPTURE(wrong);
    CHECK((!is_utf8(wrong) && printable(wrong).starts_with("\\x")));
  }
  CHECK(printable("a\xe9z") == "a\\xE9z");                  // Latin-1
  CHECK(printable("\xf0\x90\x80z") == "\\xF0\\x90\\x80z");  // cut off
}

TEST_CASE("A shortened text ends with a whole character") {
  CHECK(shortened("abc", 3) == "abc");
  CHECK(shortened("abcd", 3) == "abc...");
  CHECK(shortened("abö", 3) == "ab...");
  CHECK(shortened("aböx", 4) == "abö...");
  CHECK(shortened("深さ", 2) == "...");
}
