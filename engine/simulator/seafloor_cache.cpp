#include <ensonify/engine/simulator/seafloor_cache.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <system_error>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/preparation.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

namespace {

constexpr std::array cached_extensions{cached_extension, tiles_extension, clusters_extension};

// Larger files are known by their size and time: to read them would take longer than many a run.
constexpr std::uintmax_t most_hashed_bytes = std::uintmax_t{1} << 28;

std::string identity_of(const fs::path& file) {
  refine::require_file<refine::MeshError>(file);
  const std::uintmax_t bytes = fs::file_size(file);
  if (bytes <= most_hashed_bytes) return xxh128_of_file(file);
  return fmt::format("{} bytes of {}", bytes, fs::last_write_time(file).time_since_epoch().count());
}

/// Names and identities of a file and of the files behind it. The names count because cached
/// seafloors have warnings that name the file.
std::string identities_of(const fs::path& file) {
  const auto named = [](const fs::path& its) {
    return fmt::format(" {} {}", its.filename().string(), identity_of(its));
  };
  std::string text = named(file);
  for (const fs::path& behind : files_behind(file)) text += named(behind);
  return text;
}

template <class Owner>
void add_keys(std::string& text, const Section<Owner>& section, const Owner& owner) {
  text += fmt::format("[{}]\n", section.name);
  for (const Key<Owner>& key : section.keys) {
    const ConstOption option = key.option(owner);
    if (const auto* file = std::get_if<const InputFile*>(&option)) {
      if ((*file)->path.empty()) continue;
      text += fmt::format("{} ={}\n", key.name, identities_of((*file)->path));
    } else if (const auto value = option_text(key, owner)) {
      text += fmt::format("{} = {}\n", key.name, *value);
    }
  }
}

/// The bytes that a file, or a folder of files, takes on the disk. A file of tiles has holes for
/// tiles that are not made yet.
std::uintmax_t bytes_on_disk(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return 0;
  auto bytes = static_cast<std::uintmax_t>(status.st_blocks) * 512;
  std::error_code gone;  // whatever another process removes meanwhile
  if (S_ISDIR(status.st_mode))
    for (const fs::directory_entry& entry : fs::directory_iterator(file, gone))
      bytes += bytes_on_disk(entry.path());
  return bytes;
}

/// Removes files that killed processes left half-written.
void remove_temporaries(const fs::path& folder) {
  std::error_code gone;  // whatever another process removes meanwhile
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, gone))
    if (entry.path().extension() == ".tmp") refine::remove_abandoned(entry.path());
}

}  // namespace

fs::path file_of(const fs::path& cache, const std::string& key, const char* extension) {
  return cache / (key + extension);
}

void trim_cache(const fs::path& cache, std::uintmax_t limit_bytes, const std::string& key) {
  struct Entry {
    fs::file_time_type used;
    std::uintmax_t bytes;
    fs::path file;
  };
  remove_temporaries(cache);
  std::vector<Entry> entries;
  std::uintmax_t total = 0;
  std::error_code gone;
  for (const fs::directory_entry& entry : fs::directory_iterator(cache, gone)) {
    const Entry found{entry.last_write_time(gone), bytes_on_disk(entry.path()), entry.path()};
    if (gone) continue;
    if (std::ranges::find(cached_extensions, found.file.extension()) == cached_extensions.end())
      continue;
    if (found.file.extension() == clusters_extension) remove_temporaries(found.file);
    total += found.bytes;
    if (found.file.stem() != key) entries.push_back(found);
  }
  std::ranges::sort(entries, {}, &Entry::used);
  for (const Entry& entry : entries) {
    if (total <= limit_bytes) return;
    fs::remove_all(entry.file, gone);
    total -= entry.bytes;
  }
}

std::string seafloor_key(const Scene& scene) {
  std::string text =
      fmt::format("seafloor {}\nprogressive mesh {}\n{}\nseed = {}\n", seafloor_version,
                  refine::progressive_mesh_version, library_versions(), scene.bed_seed());
  for (const Section<Scene>& section : scene_sections())
    if (section.name.starts_with("seafloor")) add_keys(text, section, scene);
  // Tiles hold only the bed, so objects are not part of the key.
  const bool bed_alone = needs_tiles(scene.seafloor);
  for_each_list(scene, [&](const auto& section, const auto& list) {
    if (bed_alone && section.name == object_section().name) return;
    for (const auto& item : list) {
      add_keys(text, section, item);
      if constexpr (requires { item.area.pixels; })
        if (const auto& pixels = item.area.pixels)
          text += fmt::format("{} x {} pixels = {}\n", pixels->columns, pixels->rows,
                              xxh128(std::as_bytes(std::span(pixels->values))));
    }
  });
  return xxh128(text);
}

fs::path cache_file(const Scene& scene, const fs::path& cache) {
  return file_of(cache, seafloor_key(scene),
                 needs_tiles(scene.seafloor) ? tiles_extension : cached_extension);
}

fs::path default_cache() {
  const auto variable = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (const fs::path cache = variable("XDG_CACHE_HOME"); cache.is_absolute())
    return cache / "ensonify";
  if (const fs::path home = variable("HOME"); home.is_absolute())
    return home / ".cache" / "ensonify";
  return {};
}

}  // namespace ensonify::engine
