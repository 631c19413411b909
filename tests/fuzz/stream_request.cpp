#include <stdexcept>

#include <ensonify/engine/app/stream_request.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/refine/triangle_mesh.h>

#include "fuzz/fuzz.h"
#include "fuzz/session.h"

using namespace ensonify;
using Kind = engine::app::StreamRequest::Kind;

namespace {

const engine::SessionScene& scene() {
  static const engine::SessionScene one = tests::session_scene();
  return one;
}

engine::Simulator& simulator() {
  static engine::Simulator one(scene().with());
  return one;
}

}  // namespace

// The first input has not the time to make the simulator.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  simulator();
  return 0;
}

// A line that `ensonify stream` reads, and its answer. Sonars are not set, because a sonar may need
// any time and memory.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const engine::Scene objects_scene = scene().with();
  try {
    const engine::app::StreamRequest request =
        engine::app::read_stream_request(std::string(tests::text(data, size)));
    if (request.kind == Kind::set) scene().with(request.keys);
    if (request.kind == Kind::add)
      simulator().remove(simulator().add(
          engine::object_of(request.keys, "'add'", objects_scene, {}, simulator().next_instance()),
          request.pose));
    if (request.kind == Kind::ping) simulator().ping(request.pose);
  } catch (const engine::SceneError&) {
  } catch (const refine::MeshError&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
