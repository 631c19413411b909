#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// Calls take(packet) for each packet of a file from byte `begin` on, in the file's order.
/// `stated_size(bytes)` returns the size that a packet at the beginning of `bytes` states, at least
/// 1; it returns 0 if no packet begins there. A packet ends well if another packet begins at its
/// end, or the file ends there. If a packet does not end well, and a packet that ends well begins
/// within it, its stated size is wrong, and it is left out. Bytes outside packets are counted by
/// `lines.skipped()`. If the last packet does not fit into the file, `lines.cut_off()` is called.
/// The time is proportional to the file's size, whatever the bytes are.
void over_packets(const RecordingBytes& file, std::size_t begin,
                  std::size_t (*stated_size)(const RecordingBytes& bytes),
                  const std::function<void(const RecordingBytes& packet)>& take,
                  LineBuilder& lines);

}  // namespace ensonify::engine
