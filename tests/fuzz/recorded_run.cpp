#include <cmath>

#include <ensonify/engine/mosaic/recorded_run.h>
#include <ensonify/engine/scene/scene.h>

#include "fuzz/fuzz.h"
#include "support/files.h"
#include "support/small_run.h"

using namespace ensonify;

// A run's manifest and, after a zero byte, its table of pings. The image is whole.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  [[maybe_unused]] static const bool written =
      (tests::write_text(folder / "left-right.exr", tests::SmallRun().image), true);
  const std::vector<std::string> texts = tests::texts(data, size, 2);
  tests::write_text(folder / "manifest.json", texts[0]);
  tests::write_text(folder / "left-right_pings.csv", texts[1]);
  for (const engine::Positions positions :
       {engine::Positions::truth, engine::Positions::navigation})
    try {
      const engine::RecordedRun run = engine::read_recorded_run(folder.path(), "", positions);
      for (const engine::MosaicPing& ping : run.pings)
        tests::promise(ping.place_m.allFinite() && std::isfinite(ping.heading_rad) &&
                           std::isfinite(ping.height_m) && ping.image < run.images.size(),
                       "pings have places");
    } catch (const engine::SceneError&) {
    }
  return 0;
}
