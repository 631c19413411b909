#include <cmath>
#include <limits>
#include <set>

#include "support/catch.h"
#include "support/message.h"

#include <ensonify/scatter/sediment.h>

using namespace ensonify::scatter;

namespace {

std::string refusal(const Sediment& sediment) {
  return ensonify::tests::message_thrown<std::invalid_argument>([&] { check(sediment); });
}

std::string refusal_of_name(std::string_view name) {
  return ensonify::tests::message_thrown<std::invalid_argument>([&] { sediment_named(name); });
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the regressions over grain size round to the rows of TR 9407, table 2") {
  struct Row {
    double phi, density_ratio, sound_speed_ratio, loss, volume, strength_cm4;
  };
  for (const Row& row : {Row{-1.0, 2.492, 1.3370, 0.01705, 0.002, 0.012937},
                         Row{-0.5, 2.401, 1.3067, 0.01667, 0.002, 0.010573},
                         Row{0.0, 2.314, 1.2778, 0.01630, 0.002, 0.008602},
                         Row{0.5, 2.231, 1.2503, 0.01638, 0.002, 0.006957},
                         Row{1.0, 2.151, 1.2241, 0.01645, 0.002, 0.005587},
                         Row{1.5, 1.845, 1.1782, 0.01624, 0.002, 0.004446},
                         Row{2.0, 1.615, 1.1396, 0.01610, 0.002, 0.003498},
                         Row{2.5, 1.451, 1.1073, 0.01602, 0.002, 0.002715},
                         Row{3.0, 1.339, 1.0800, 0.01728, 0.002, 0.002070},
                         Row{3.5, 1.268, 1.0568, 0.01875, 0.002, 0.001544},
                         Row{4.0, 1.224, 1.0364, 0.02019, 0.002, 0.001119},
                         Row{4.5, 1.195, 1.0179, 0.02158, 0.002, 0.000781},
                         Row{5.0, 1.169, 0.9999, 0.01261, 0.002, 0.000518},
                         Row{5.5, 1.149, 0.9885, 0.00676, 0.001, 0.000518},
                         Row{6.0, 1.149, 0.9873, 0.00386, 0.001, 0.000518},
                         Row{6.5, 1.148, 0.9861, 0.00306, 0.001, 0.000518},
                         Row{7.0, 1.147, 0.9849, 0.00242, 0.001, 0.000518},
                         Row{7.5, 1.147, 0.9837, 0.00194, 0.001, 0.000518},
                         Row{8.0, 1.146, 0.9824, 0.00163, 0.001, 0.000518},
                         Row{9.0, 1.145, 0.9800, 0.00148, 0.001, 0.000518}}) {
    CAPTURE(row.phi);
    const Sediment s = sediment_of_grain_size(row.phi);
    CHECK(std::abs(s.density_ratio - row.density_ratio) < 0.00101);
    CHECK(std::abs(s.sound_speed_ratio - row.sound_speed_ratio) < 0.000101);
    CHECK(std::abs(s.loss - row.loss) < 0.0000101);
    CHECK(s.volume == row.volume);
    CHECK(s.exponent == 3.25);
    CHECK(std::abs(s.strength_cm4 - row.strength_cm4) < 0.00000101);
  }
}

TEST_CASE("a sediment's name is found in any spelling, and so are the other names of its row") {
  CHECK(sediment_named("medium sand").strength_cm4 ==
        sediment_of_grain_size(1.5).strength_cm4);  // not the table's rounded 0.004446
  for (const char* spelling : {"Medium Sand", "medium_sand", " MEDIUM-sand ", "medium  sand"})
    CHECK(sediment_named(spelling).loss == sediment_named("medium sand").loss);
  CHECK(sediment_named("gravel").strength_cm4 == sediment_named("cobble").strength_cm4);
  CHECK(sediment_named("pebble").sound_speed_ratio == 1.8);
  CHECK(sediment_named("gravelly sand").density_ratio ==
        sediment_named("coarse sand").density_ratio);
  CHECK(sediment_named("sandy mud (silt)").density_ratio == sediment_named("silt").density_ratio);
  std::set<std::string_view> names;
  for (const NamedSediment& s : named_sediments()) {
    CAPTURE(s.name);
    CHECK(names.insert(s.name).second);
    CHECK_NOTHROW(check(s.sediment));
    CHECK(sediment_named(s.name).density_ratio == s.sediment.density_ratio);
  }
}

TEST_CASE("an unknown sediment is refused with the nearest names") {
  CHECK(contains(refusal_of_name("medum sand"), "'medium sand'"));
  CHECK(contains(refusal_of_name("GRAVLE"), "'gravel'"));
  CHECK(contains(refusal_of_name(""), "nearest"));
  const std::string sands = refusal_of_name("Sand");
  for (const std::string name :
       {"very coarse sand", "coarse sand", "gravelly sand", "gravelly muddy sand", "medium sand",
        "fine sand", "silty sand", "muddy sand", "very fine sand", "clayey sand", "sand silt clay"})
    CHECK(contains(sands, "'" + name + "'"));
  for (const std::string name : {"'silt'", "'rock'", "'clay'", "sandy"})
    CHECK(!contains(sands, name));
  CHECK(refusal_of_name(std::string(100000, 'x')).size() < 300);
}

TEST_CASE("a parameter outside its range is refused with the range") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Bad {
    double Sediment::*member;
    double value;
    const char* said;
  };
  for (const Bad& bad :
       {Bad{&Sediment::exponent, 2.0, "more than 2 and less than 4"},
        Bad{&Sediment::exponent, 4.0, "more than 2 and less than 4"},
        Bad{&Sediment::exponent, nan, "more than 2 and less than 4"},
        Bad{&Sediment::loss, -0.001, "loss is -0.001, expected 0 to 0.1"},
        Bad{&Sediment::loss, 0.11, "0 to 0.1"}, Bad{&Sediment::loss, nan, "0 to 0.1"},
        Bad{&Sediment::density_ratio, 0.9, "1 to 3"}, Bad{&Sediment::density_ratio, 3.1, "1 to 3"},
        Bad{&Sediment::sound_speed_ratio, 0.7, "0.8 to 3"},
        Bad{&Sediment::volume, -1e-9, "volume is -1e-09, expected 0 to 1"},
        Bad{&Sediment::strength_cm4, 1.5, "0 to 1"}, Bad{&Sediment::strength_cm4, -0.1, "0 to 1"},
        Bad{&Sediment::strength_offset_db, nan, "strength_offset_db"}}) {
    Sediment s = sediment_named("medium sand");
    CHECK(refusal(s).empty());
    s.*bad.member = bad.value;
    INFO(bad.said << " | " << refusal(s));
    CHECK(contains(refusal(s), bad.said));
  }
  CHECK(!refusal(Sediment{}).empty());
  for (const double phi : {-1.01, 9.01, nan})
    CHECK_THROWS_WITH(sediment_of_grain_size(phi), Catch::Contains("-1 to 9"));
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    CHECK_THROWS_WITH(wavenumber_per_cm(bad, 1500.0), Catch::Contains("frequency_hz"));
    CHECK_THROWS_WITH(wavenumber_per_cm(1e5, bad), Catch::Contains("sound_speed_mps"));
  }
}

TEST_CASE("above 100 kHz the relief of gravel and rock keeps the wavenumber of 100 kHz") {
  for (const char* name :
       {"rough rock", "rock", "handbook rock", "cobble", "gravel", "pebble", "sandy gravel"}) {
    const Sediment s = sediment_named(name);
    CHECK(gravel_or_rock(s));
    CHECK(relief_wavenumber_per_cm(s, 400e3, 1500.0) == wavenumber_per_cm(100e3, 1500.0));
    CHECK(relief_wavenumber_per_cm(s, 50e3, 1500.0) == wavenumber_per_cm(50e3, 1500.0));
  }
  for (const char* name : {"very coarse sand", "coarse sand", "muddy gravel", "clay"}) {
    const Sediment s = sediment_named(name);
    CHECK_FALSE(gravel_or_rock(s));
    CHECK(relief_wavenumber_per_cm(s, 400e3, 1500.0) == wavenumber_per_cm(400e3, 1500.0));
  }
}

TEST_CASE("a frequency or an exponent outside the model's range is warned of, with the spread") {
  const auto warning = [](const char* name, double frequency_hz) {
    return validity_warning(sediment_named(name), frequency_hz).value_or("");
  };
  CHECK(contains(warning("clay", 400e3), "levels are extrapolated, expected within 2 dB"));
  CHECK(contains(warning("coarse sand", 400e3), "levels are extrapolated, expected within 10 dB"));
  CHECK(contains(warning("cobble", 400e3), "by the roughness of 100 kHz, expected within 15 dB"));
  CHECK(contains(warning("rock", 400e3), "measured at 100 kHz, expected within 10 dB"));
  CHECK(contains(warning("clay", 9.9e3), "is not known"));
  CHECK(contains(warning("clay", 1.01e6), "is not known"));
  for (const char* name : {"rock", "cobble", "medium sand", "clay"}) {
    CHECK_FALSE(validity_warning(sediment_named(name), 10e3));
    CHECK_FALSE(validity_warning(sediment_named(name), 100e3));
  }
  Sediment steep = sediment_named("clay");
  steep.exponent = 3.95;
  CHECK(contains(validity_warning(steep, 50e3).value_or(""), "2.4 to 3.9"));
}
