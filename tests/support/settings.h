#pragma once

#include <clocale>
#include <cstdlib>
#include <locale>
#include <string>

#include <sys/stat.h>

namespace ensonify::tests {

/// Settings of a user's machine that no file's bytes may depend on: during its lifetime another
/// time zone, locale and umask.
class OtherSettings {
 public:
  OtherSettings() : umask_(umask(077)) {
    setenv("TZ", "Pacific/Kiritimati", 1);
    tzset();
    // C's locale, if one with a decimal comma is installed; C++ streams always.
    for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"})
      if (std::setlocale(LC_ALL, name)) break;
    std::locale::global(std::locale(std::locale(), new Commas));
  }
  ~OtherSettings() {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
    unsetenv("TZ");
    tzset();
    umask(umask_);
  }
  OtherSettings(const OtherSettings&) = delete;
  OtherSettings& operator=(const OtherSettings&) = delete;

 private:
  struct Commas : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  mode_t umask_;
};

}  // namespace ensonify::tests
