#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// Calls take(packet) for each packet of a file from byte `begin` on, in their order.
/// `stated_size(bytes)` is the size that a packet at the beginning of `bytes` states, at least 1; 0
/// if no packet begins there. A size is wrong if, within it, another packet begins that ends where
/// a third one begins or the file ends; such a packet is left out. Bytes that are no packet count
/// as `lines.skipped()`; a last packet that does not fit into the file is `lines.cut_off()`. Takes
/// a time in proportion to the file's size, whatever its bytes are.
void over_packets(const RecordingBytes& file, std::size_t begin,
                  std::size_t (*stated_size)(const RecordingBytes& bytes),
                  const std::function<void(const RecordingBytes& packet)>& take,
                  LineBuilder& lines);

}  // namespace ensonify::engine
