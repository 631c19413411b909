#include <ensonify/engine/image/label_names.h>

#include "support/catch.h"

using namespace ensonify::engine;
using Names = std::vector<std::string>;

TEST_CASE("Renumbered labels keep their names, and names that were not wanted come last") {
  Sonar sonar;
  sonar.bins = 2;
  const LabelNames own{{"none", "seabed", "wreck", "mine"}, {"none", "mud", "steel"}};
  std::vector<Waterfall> images(2, Waterfall(sonar, 1));
  images[1].pixels.class_id = {0, 1, 2, 3};
  images[1].pixels.sediment = {0, 1, 2, 2};

  const std::vector<Waterfall> before = images;
  const LabelNames same = renumber(own, {}, images);
  CHECK(same.classes == own.classes);
  CHECK(images[1].pixels.class_id == before[1].pixels.class_id);

  const LabelNames names = renumber(own, {{"mine", "drum", "seabed"}, {"steel"}}, images);
  CHECK(names.classes == Names{"none", "mine", "drum", "seabed", "wreck"});
  CHECK(names.materials == Names{"none", "steel", "mud"});
  CHECK(images[0].pixels.class_id == std::vector<std::uint32_t>(4, 0));
  CHECK(images[1].pixels.class_id == std::vector<std::uint32_t>{0, 3, 4, 1});
  CHECK(images[1].pixels.sediment == std::vector<std::uint32_t>{0, 2, 1, 1});
}

TEST_CASE("Number 0 is not a label, even if a class is called none") {
  Sonar sonar;
  sonar.bins = 1;
  std::vector<Waterfall> images(1, Waterfall(sonar, 1));
  images[0].pixels.class_id = {0, 1};
  const LabelNames names = renumber({{"none", "none"}, {"none"}}, {{"a", "none"}, {}}, images);
  CHECK(names.classes == Names{"none", "a", "none"});
  CHECK(images[0].pixels.class_id == std::vector<std::uint32_t>{0, 2});
}
