// Values that the command line gives with -D.

#include <ensonify/engine/scene/reader.h>

#include "support/catch.h"
#include "support/parsed_scene.h"

using namespace ensonify::engine;
using ensonify::tests::error_of;
using ensonify::tests::head;
using ensonify::tests::parsed;

TEST_CASE("An override is read as TOML, a bare word as a string, and errors name it") {
  const Scene scene = parsed(
      head + "[track]\npings = 3\n",
      {"track.pings=5", "track.pings=6", "display.palette=copper", "sea.sound_speed_mps = 1500",
       "sonar.sidescan.bins=9", "seafloor.fractal={hurst=0.5}"});
  CHECK(scene.track.pings == 6);
  CHECK(scene.display.palette == Palette::copper);
  CHECK(scene.sea.sound_speed_mps == 1500.0);
  CHECK(scene.sonars[0].bins == 9);
  CHECK(scene.seafloor.fractal.hurst == 0.5);
  struct Case {
    std::string text, message;
  };
  const auto [text, message] = GENERATE(values<Case>({
      {"track.pings=1.2.3",
       "-D track.pings=1.2.3: 'track.pings' is the string \"1.2.3\", expected a whole number from "
       "1 "
       "to 10000000"},
      {"track.ping=3", "-D track.ping=3: unknown key \"ping\" in [track]; did you mean 'pings'?"},
      {"pings=3", "-D pings=3: unknown key \"pings\"; did you mean 'track.pings'?"},
      {"sonar.sidescna.bins=3",
       "-D sonar.sidescna.bins=3: the scene has no sonar \"sidescna\", expected one of sidescan; "
       "did "
       "you mean 'sidescan'?"},
      {"track.pings", "-D track.pings: expected key=value, as in -D sea.temperature_c=12"},
      {"=3", "-D =3: expected key=value, as in -D sea.temperature_c=12"},
      {"#a=3", "-D #a=3: expected key=value, as in -D sea.temperature_c=12"},
      {"seed=1\nspeckle=false", "-D: expected one line of text without control characters"},
      {"sonar.sidescan.sector_low_deg=140",
       "s.toml: 'sonar.sidescan.sector_high_deg' is 132, expected more than sector_low_deg, which "
       "is "
       "140; with -D sonar.sidescan.sector_low_deg=140"},
      {"sonar.sidescan.sector_high_deg=-20",
       "-D sonar.sidescan.sector_high_deg=-20: 'sonar.sidescan.sector_high_deg' is -20, expected "
       "more than sector_low_deg, which is -10"},
  }));
  CHECK(error_of(head, {text}) == message);
  CHECK(error_of(head, {"a b=1"}).starts_with("-D a b=1: "));
  CHECK(error_of(head, {"seed=\xff"}).starts_with("-D seed=\xff: "));
}

TEST_CASE("An override of what the scene does not have is answered with what to add") {
  CHECK(error_of([] {
          parse_scene("version = 1\n", "s.toml", std::vector<std::string>{"objects.0.height_m=2"},
                      {});
        }) == "-D objects.0.height_m=2: the scene has no [[objects]]; add one to the file");
  CHECK(error_of([] {
          parse_scene("version = 1\n", "s.toml", std::vector<std::string>{"material.q.like=sand"},
                      {});
        }) ==
        "-D material.q.like=sand: the scene has no material \"q\"; define it in the file, as "
        "[material.NAME]");
}
