#include <stdexcept>

#include <ensonify/engine/output/tar.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    engine::read_tar(tests::file_of(data, size, "a.tar"),
                     [&](const std::string&, const std::vector<std::byte>& content) {
                       tests::promise(content.size() <= size, "a file is a part of the tar");
                     });
  } catch (const std::runtime_error&) {
  }
  return 0;
}
