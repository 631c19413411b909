#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/tables/track_reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const engine::NavigationLog log =
        engine::parse_track(tests::text(data, size), "fuzz", {.kind = engine::TrackKind::file}, {});
    const engine::RecordedTrack track(log, size % 2 ? 2.0 : 0.0);
    track.at(track.begin_s());
  } catch (const engine::SceneError&) {
  }
  return 0;
}
