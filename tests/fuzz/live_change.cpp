#include <stdexcept>

#include <ensonify/engine/live/change.h>
#include <ensonify/refine/triangle_mesh.h>

#include "fuzz/fuzz.h"
#include "fuzz/session.h"

using namespace ensonify;

// The body of a page's request to the live view.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const engine::SessionScene scene = tests::session_scene();
  try {
    engine::read_change(tests::text(data, size), scene);
  } catch (const engine::SceneError&) {
  } catch (const refine::MeshError&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
