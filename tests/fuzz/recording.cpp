#include <cmath>

#include <ensonify/engine/recording/recording_reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    for (const engine::RecordedLine& line :
         engine::parse_recording({reinterpret_cast<const std::byte*>(data), size}, "fuzz")) {
      for (const engine::Side side : {engine::Side::port, engine::Side::starboard})
        tests::promise(
            line.side(side).empty() || line.side(side).size() == line.pings.size() * line.samples,
            "each ping has a row");
      for (const engine::RecordedPing& ping : line.pings)
        for (const engine::PingColumn& column : engine::ping_columns())
          tests::promise(std::isfinite(column.value(ping).value_or(0.0)), "numbers are finite");
    }
  } catch (const engine::RecordingError&) {
  }
  return 0;
}
