#include <ensonify/engine/recording/packets.h>

#include <algorithm>

namespace ensonify::engine {

void over_packets(const RecordingBytes& file, std::size_t begin,
                  std::size_t (*stated_size)(const RecordingBytes& bytes),
                  const std::function<void(const RecordingBytes& packet)>& take,
                  LineBuilder& lines) {
  const auto size_at = [&](std::size_t place) { return stated_size(file.part(place)); };
  const auto ends_well = [&](std::size_t place, std::size_t size) {
    return file.has(place, size) && (place + size == file.size() || size_at(place + size) > 0);
  };
  for (std::size_t place = begin; place < file.size();) {
    const std::size_t size = size_at(place);
    if (size == 0) {
      lines.skipped(1);
      ++place;
      continue;
    }
    if (!ends_well(place, size)) {
      // Samples may look like the beginning of a packet, but hardly of one that also ends well.
      const std::size_t end = place + std::min(size, file.size() - place);
      std::size_t next = place + 1;
      while (next < end && !(size_at(next) > 0 && ends_well(next, size_at(next)))) ++next;
      if (next < end) {
        lines.skipped(next - place);
        place = next;
        continue;
      }
      if (!file.has(place, size)) {
        lines.cut_off();
        break;
      }
    }
    take(file.part(place, size));
    place += size;
  }
}

}  // namespace ensonify::engine
