#include <ensonify/engine/comparison/picture_source.h>
#include <ensonify/engine/recording/recording_reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

// A folder with one picture of a sonar's line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const engine::RecordedLine line =
        engine::line_of_pictures(tests::file_of(data, size, "line.png").parent_path());
    for (const engine::Side side : {engine::Side::port, engine::Side::starboard})
      tests::promise(line.side(side).size() == line.pings.size() * line.samples,
                     "each ping has a row");
  } catch (const engine::RecordingError&) {
  }
  return 0;
}
