#include "fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return ensonify::tests::fuzz_mesh(data, size, ensonify::refine::MeshFormat::obj);
}
