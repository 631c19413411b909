#include <ensonify/engine/sonar/echo/steered_beams.h>

#include <stdexcept>

#include "support/catch.h"

#include <ensonify/engine/sonar/instrument/presets.h>

using namespace ensonify::engine;

TEST_CASE("the near fields of a long array, which take long, are not made past a stop") {
  Sonar sonar = usual_sonar(SonarKind::imaging);
  sonar.array_length_m = 3.0;
  sonar.focused = false;
  int calls = 0;
  const auto stop = [&] {
    if (++calls == 3) throw std::runtime_error("stop");
  };
  CHECK_THROWS_WITH(SteeredBeams(sonar, 0.002, 512, stop), "stop");
  CHECK(calls == 3);
}
