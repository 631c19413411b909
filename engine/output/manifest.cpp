#include <ensonify/engine/output/manifest.h>

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

#ifdef ENSONIFY_GEOGRAPHICLIB
#include <GeographicLib/Config.h>
#endif
#include <OpenEXR/OpenEXRConfig.h>
#include <archive.h>
#include <fftw3.h>
#include <fmt/format.h>
#include <gdal.h>
#include <nlohmann/json.hpp>
#include <ogr_srs_api.h>
#include <png.h>
#include <xxhash.h>
#if __has_include(<embree4/rtcore_config.h>)
#include <embree4/rtcore_config.h>
#else
#include <embree3/rtcore_config.h>
#endif
#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

std::string digits_of(XXH128_hash_t hash) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, hash);
  std::string digits;
  for (const unsigned char byte : canonical.digest) digits += fmt::format("{:02x}", byte);
  return digits;
}

constexpr std::size_t block_bytes = 1 << 20;

/// The hash of bytes that are read in blocks. `read` fills a block and returns the number of bytes
/// that it read; 0 at the end.
template <class Read>
std::string hash_of_blocks(Read&& read) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  const auto block = std::make_unique_for_overwrite<std::byte[]>(block_bytes);
  while (const std::size_t bytes = read(std::span(block.get(), block_bytes)))
    XXH3_128bits_update(state.get(), block.get(), bytes);
  return digits_of(XXH3_128bits_digest(state.get()));
}

}  // namespace

std::string xxh128(std::span<const std::byte> bytes) {
  return digits_of(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string xxh128(std::string_view text) { return xxh128(std::as_bytes(std::span(text))); }

std::string xxh128_of_file(const std::filesystem::path& file) {
  return record_of(file.parent_path(), file.filename().string()).xxh128;
}

FileRecord record_of(const std::filesystem::path& folder, const std::string& name) {
  refine::FileReader reader(folder / name);
  reader.require_open();
  FileRecord record{.name = name, .size_bytes = 0, .xxh128 = {}};
  record.xxh128 = hash_of_blocks([&](std::span<std::byte> block) {
    const std::size_t bytes = reader.read(block);
    record.size_bytes += bytes;
    return bytes;
  });
  return record;
}

FileRecord record_of(const std::string& name, const refine::ReadAt& read_at) {
  std::uint64_t place = 0;
  std::string hash = hash_of_blocks([&](std::span<std::byte> block) {
    const std::size_t bytes = read_at(place, block);
    place += bytes;
    return bytes;
  });
  return {name, place, std::move(hash)};
}

std::string_view program_version() { return ENSONIFY_VERSION; }

std::string library_versions() {
  nlohmann::ordered_json versions;
  versions["embree"] = RTC_VERSION_STRING;
  versions["fftw"] = std::string(fftw_version);
  versions["gdal"] = GDALVersionInfo("RELEASE_NAME");
#ifdef ENSONIFY_GEOGRAPHICLIB
  versions["geographiclib"] = GEOGRAPHICLIB_VERSION_STRING;
#endif
  versions["libarchive"] = archive_version_string();
  versions["libpng"] = png_get_libpng_ver(nullptr);
  versions["openexr"] = OPENEXR_VERSION_STRING;
  int proj_major = 0, proj_minor = 0, proj_patch = 0;
  OSRGetPROJVersion(&proj_major, &proj_minor, &proj_patch);
  versions["proj"] = fmt::format("{}.{}.{}", proj_major, proj_minor, proj_patch);
  versions["zlib"] = archive_zlib_version();
#ifdef __GLIBC__
  versions["glibc"] = gnu_get_libc_version();
#endif
  return versions.dump();
}

bool begins_as_manifest(const std::filesystem::path& file) {
  constexpr std::string_view every = "{\n  \"program\": \"ensonify\",";
  const std::string begin = refine::begin_of_file(file, every.size());
  return every.starts_with(begin) &&
         begin.size() == std::min<std::uintmax_t>(std::filesystem::file_size(file), every.size());
}

}  // namespace ensonify::engine
