#include <ensonify/engine/sonar/echo/echo.h>

namespace ensonify::engine {
namespace {

constexpr Artefact artefact_of(std::size_t bit) {
  return static_cast<Artefact>(std::uint32_t{1} << bit);
}

constexpr bool streams_differ() {
  for (std::size_t i = 0; i < 32; ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (const auto stream = kind_of(artefact_of(i)).stream;
          stream && stream == kind_of(artefact_of(k)).stream)
        return false;
  return true;
}
static_assert(streams_differ(), "two artefacts have the same random numbers");

}  // namespace

RandomStream artefact_stream(std::uint64_t seed, Artefact artefact, std::uint64_t a,
                             std::uint64_t b) {
  return RandomStream(seed, Purpose::artefact, {kind_of(artefact).stream.value(), a, b});
}

std::string Artefacts::text() const {
  std::string text;
  for (std::size_t bit = 0; bit < 32; ++bit)
    if (has(artefact_of(bit)))
      text.append(text.empty() ? "" : "+").append(kind_of(artefact_of(bit)).name);
  return text;
}

}  // namespace ensonify::engine
