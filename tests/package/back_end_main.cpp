// Compares the documentation's back-end with the reference: over a mesh, and in a run whose folder
// is the argument. The library knows it by its name.

#include <cmath>
#include <cstdio>
#include <numbers>

#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/trace/intersector.h>

int main(int, char** argv) {
  using namespace ensonify;
  refine::TriangleMesh bed;
  for (std::uint32_t j = 0; j <= 20; ++j)
    for (std::uint32_t i = 0; i <= 20; ++i)
      bed.positions.emplace_back(float(i) - 10.0f, float(j) - 10.0f,
                                 -8.0f + 0.3f * std::sin(1.7f * float(i) + 0.9f * float(j)));
  for (std::uint32_t j = 0; j < 20; ++j)
    for (std::uint32_t i = 0; i < 20; ++i) {
      const std::uint32_t k = 21 * j + i;
      bed.faces.push_back({k, k + 1, k + 22});
      bed.faces.push_back({k + 22, k + 21, k});
    }
  const engine::RayFan fan{std::make_shared<const engine::FanGrid>(
                               engine::FanLayout{.sector_low_rad = 0.2,
                                                 .sector_high_rad = std::numbers::pi / 2.0,
                                                 .truncation_rad = 0.05,
                                                 .main_lobe_rad = 0.02,
                                                 .planes = 4,
                                                 .elevations = 500}),
                           {0.1, 0.2, 0.0},
                           {0.0, 1.0, 0.0},
                           {0.6, 0.0, -0.8},
                           {0.8, 0.0, 0.6},
                           30.0};
  std::vector<engine::Hit> expected(fan.grid->rays()), found(expected.size());
  engine::make_intersector("pluecker", bed)->intersect(fan, expected);
  engine::make_intersector("every_face", bed)->intersect(fan, found);
  int hits = 0, others = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    hits += static_cast<bool>(expected[i]);
    others += expected[i].face != found[i].face ||
              (expected[i] && std::abs(expected[i].t - found[i].t) > 1e-9);
  }
  std::printf("%d hits, %d others\n", hits, others);
  const engine::Scene scene =
      engine::read_scene("small.toml", std::vector<std::string>{"run.intersector=every-face"});
  auto verified = engine::run(scene, argv[1], {.verify_pings = 2}).verification;
  std::printf("%d rays verified, %d unexplained\n", int(verified["rays"]),
              int(verified["unexplained"]));
  const bool sound = verified["rays"] > 200 && verified["unexplained"] == 0;
  return hits > 500 && others == 0 && sound ? 0 : 1;
}
