#include <ensonify/engine/output/manifest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/settings.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;

namespace {

Manifest sample_manifest() {
  Manifest manifest;
  manifest.scene_toml = "version = 1\n# \"h\xc3\xa9\"\n";
  manifest.seed = 0xffffffffffffffffu;
  manifest.surface = "static";
  manifest.intersector = "embree";
  manifest.code_path = "avx2";
  manifest.classes = {"none", "seabed"};
  manifest.materials = {"none", "medium sand"};
  manifest.counts = {{"pings", 600}, {"rays", 5'000'000'000}};
  manifest.warnings = {"the bed has holes"};
  manifest.files = {{"a.exr", 12, xxh128("a")}, {"b.png", 0, xxh128("")}};
  return manifest;
}

std::error_code error_of_hashing(const std::filesystem::path& file) {
  try {
    xxh128_of_file(file);
  } catch (const std::system_error& error) {
    return error.code();
  }
  return {};
}

}  // namespace

TEST_CASE("The hash is XXH3 with 128 bits, big-endian") {
  // Published: XXH3_128bits of nothing with seed 0.
  CHECK(xxh128("") == "99aa06d3014798d86001c324468d497f");
  CHECK(xxh128(std::span<const std::byte>()) == "99aa06d3014798d86001c324468d497f");
  const std::string text(1000, 'x');
  CHECK(xxh128(text) == xxh128(std::as_bytes(std::span(text))));
  CHECK(xxh128(text) != xxh128(text.substr(1)));
}

TEST_CASE("The hash of a file is that of its content, or fails if the file cannot be read") {
  const ensonify::tests::TemporaryFolder folder;
  const std::filesystem::path file = folder / "f";
  std::ofstream(file) << "content";
  CHECK(xxh128_of_file(file) == xxh128("content"));
  CHECK(error_of_hashing(folder / "missing") == std::errc::no_such_file_or_directory);
  std::filesystem::create_symlink("loop", folder / "loop");
  CHECK(error_of_hashing(folder / "loop") == std::errc::too_many_symbolic_link_levels);
  const FileRecord record = record_of(folder.path(), file.filename().string());
  CHECK(record.name == file.filename().string());
  CHECK(record.size_bytes == 7);
  CHECK(record.xxh128 == xxh128("content"));
  CHECK_THROWS_AS(record_of(folder.path(), "missing"), std::system_error);

  const std::vector<std::byte> long_content(2'500'000, std::byte{7});  // several blocks
  FileRecord read_back;
  ensonify::refine::write_staged(
      folder / "long", ensonify::refine::content_of(long_content),
      [&](const ensonify::refine::ReadAt& read_at) { read_back = record_of("long", read_at); });
  CHECK(read_back.name == "long");
  CHECK(read_back.size_bytes == long_content.size());
  CHECK(read_back.xxh128 == xxh128(long_content));

  // The first page of a process is never mapped, and reading it is an error of input. This comes
  // before descriptors lack: the first time that an error's virtual table is checked, UBSan needs
  // one.
  CHECK(error_of_hashing("/proc/self/mem") == std::errc::io_error);

  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
  const rlimit none{0, before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
  const std::error_code error = error_of_hashing(file);
  REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
  CHECK(error == std::errc::too_many_files_open);
}

TEST_CASE("A manifest has its fields in order, with versions and the scene's hash") {
  const Manifest manifest = sample_manifest();
  const auto json = nlohmann::ordered_json::parse(manifest_json(manifest));
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  CHECK(keys == std::vector<std::string>{"program", "version", "libraries", "scene", "scene_hash",
                                         "seed", "code_path", "classes", "materials", "counts",
                                         "warnings", "files"});
  CHECK(json["program"] == "ensonify");
  for (const char* library :
       {"embree", "fftw", "gdal", "libarchive", "libpng", "openexr", "proj", "zlib"}) {
    INFO(library);
    CHECK_FALSE(json["libraries"].at(library).get<std::string>().empty());
  }
  CHECK(json["libraries"]["proj"] != "0.0.0");
#if __has_include(<GeographicLib/Config.h>)
  CHECK_FALSE(json["libraries"].at("geographiclib").get<std::string>().empty());
#endif
  CHECK(json["scene"] == manifest.scene_toml);
  CHECK(json["scene_hash"] == xxh128(manifest.scene_toml));
  CHECK(json["seed"] == manifest.seed);
  CHECK(json["code_path"]["surface"] == "static");
  CHECK(json["code_path"]["intersector"] == "embree");
  CHECK(json["code_path"]["instruction_set"] == "avx2");
  CHECK(json["classes"] == std::vector<std::string>{"none", "seabed"});
  CHECK(json["materials"] == std::vector<std::string>{"none", "medium sand"});
  CHECK(json["counts"]["rays"] == 5'000'000'000);
  CHECK(json["warnings"] == std::vector<std::string>{"the bed has holes"});
  REQUIRE(json["files"].size() == 2);
  CHECK(json["files"][0]["name"] == "a.exr");
  CHECK(json["files"][0]["size_bytes"] == 12);
  CHECK(json["files"][1]["xxh128"] == "99aa06d3014798d86001c324468d497f");
}

TEST_CASE("An empty manifest has an empty list of files, not null") {
  const auto json = nlohmann::json::parse(manifest_json({}));
  CHECK(json["files"] == nlohmann::json::array());
  CHECK(json["warnings"] == nlohmann::json::array());
  CHECK(json["counts"] == nlohmann::json::object());
}

TEST_CASE("A manifest is valid UTF-8 for any bytes in the scene") {
  Manifest manifest = sample_manifest();
  manifest.scene_toml = std::string("\xff\xc3(\0\x1b\xed\xa0\x80 end", 12);
  manifest.warnings = {"\x80"};
  const std::string text = manifest_json(manifest);
  CHECK(nlohmann::json::accept(text));  // this checks UTF-8
  CHECK(nlohmann::json::parse(text)["scene_hash"] == xxh128(manifest.scene_toml));
}

TEST_CASE("A manifest has the same bytes in another locale") {
  const std::string text = manifest_json(sample_manifest());
  const OtherSettings other;
  CHECK(manifest_json(sample_manifest()) == text);
}
