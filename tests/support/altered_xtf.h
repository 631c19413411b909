#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::tests {

/// The packets of an XTF file of one sonar, to be altered as other recorders would write them.
class AlteredXtf {
 public:
  static constexpr std::size_t header_bytes = 1024, ping_header = 256, channel_header = 64;

  explicit AlteredXtf(const engine::Recording& recording) {
    const std::vector<std::byte> bytes = engine::encode_xtf({&recording, 1});
    head.assign(bytes.begin(), bytes.begin() + header_bytes);
    for (std::size_t at = header_bytes; at < bytes.size();) {
      std::uint32_t size = 0;
      std::memcpy(&size, bytes.data() + at + 10, sizeof size);
      const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      packets.emplace_back(first, first + size);
      at += size;
    }
  }

  template <class T>
  static void put(std::vector<std::byte>& bytes, std::size_t offset, T value) {
    if (offset + sizeof value > bytes.size()) throw std::out_of_range("AlteredXtf::put");
    std::memcpy(bytes.data() + offset, &value, sizeof value);
  }
  template <class T>
  static T get(const std::vector<std::byte>& bytes, std::size_t offset) {
    T value{};
    if (offset + sizeof value > bytes.size()) throw std::out_of_range("AlteredXtf::get");
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
  }

  /// The only line of the file.
  engine::RecordedLine line() const {
    std::vector<std::byte> bytes = head;
    for (const std::vector<std::byte>& packet : packets)
      bytes.insert(bytes.end(), packet.begin(), packet.end());
    return engine::parse_recording(bytes, "r").at(0);
  }

  std::vector<std::byte> head;
  std::vector<std::vector<std::byte>> packets;
};

}  // namespace ensonify::tests
