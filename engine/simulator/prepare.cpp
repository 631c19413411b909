#include <ensonify/engine/simulator/prepare.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <variant>

#include <fmt/format.h>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/progressive_mesh_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

// To be raised when a seafloor's options make another mesh than they did.
constexpr int seafloor_version = 3;

// The analysis of this many faces takes about as long as the echoes of one ping.
constexpr std::size_t faces_per_ping = 5000;

// What the cache may hold; what was used longest ago goes first.
constexpr std::uintmax_t cache_limit_bytes = std::uintmax_t{16} << 30;
constexpr const char* cached_extension = ".mesh";
constexpr std::chrono::hours abandoned_after{1};

template <class Owner>
void add_keys(std::string& text, const Section<Owner>& section, const Owner& owner) {
  text += fmt::format("[{}]\n", section.name);
  for (const Key<Owner>& key : section.keys) {
    const ConstOption option = key.option(owner);
    if (const auto* file = std::get_if<const InputFile*>(&option)) {
      if (!(*file)->path.empty())
        text += fmt::format("{} = {}\n", key.name, xxh128_of_file((*file)->path));
    } else if (const auto value = option_text(key, owner)) {
      text += fmt::format("{} = {}\n", key.name, *value);
    }
  }
}

fs::path file_of(const fs::path& cache, const std::string& key) {
  return cache / (key + cached_extension);
}

/// Removes what was used longest ago until the rest is within the limit, and what a killed process
/// left half-written (write_file's temporaries), once no living one can be at it. The file that was
/// just saved stays, however large it is.
void trim_cache(const fs::path& folder, const fs::path& saved) {
  struct Entry {
    fs::file_time_type used;
    std::uintmax_t bytes;
    fs::path file;
  };
  std::vector<Entry> entries;
  std::uintmax_t total = 0;
  std::error_code gone;  // whatever another process removes meanwhile
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, gone)) {
    const Entry found{entry.last_write_time(gone), entry.file_size(gone), entry.path()};
    if (gone) continue;
    if (found.file.extension() == ".tmp" &&
        fs::file_time_type::clock::now() - found.used > abandoned_after)
      fs::remove(found.file, gone);
    if (found.file.extension() != cached_extension) continue;
    total += found.bytes;
    if (found.file != saved) entries.push_back(found);
  }
  std::ranges::sort(entries, {}, &Entry::used);
  for (const Entry& entry : entries) {
    if (total <= cache_limit_bytes) return;
    fs::remove(entry.file, gone);
    total -= entry.bytes;
  }
}

/// Throws a fault that begins with the key of a table in a list again, with its place in the file.
[[noreturn]] void throw_placed(const Scene& scene, const std::exception& error) {
  const std::string_view what = error.what();
  const std::string_view key = what.substr(0, what.find_first_of(": "));
  const auto place = scene.places.lower_bound(key);
  if (key.find('.') != key.npos && place != scene.places.end() && place->first.starts_with(key))
    throw SceneError(fmt::format("{}: {}", place->second, what));
  throw;
}

constexpr double mesh_bytes_per_face = 18.0;  // of faces and half as many vertices

/// Bytes per face that a surface needs in addition to the mesh; for `auto` the smaller one.
double bytes_per_face(std::string_view surface, std::string_view intersector) {
  if (surface == "auto")
    return std::min(bytes_per_face("static", intersector), bytes_per_face("refined", intersector));
  const double bytes =
      build_bytes_per_face(face_source_kind(surface), intersector_kind(intersector));
  return face_source_kind(surface).needs_progressive_mesh ? bytes : bytes + BedGrid::bytes_per_face;
}

class Preparing {
 public:
  Preparing(const Scene& scene, const Preparation& how) : scene_(scene), how_(how) {
    result_->surface = scene.run.surface;
  }

  std::shared_ptr<const PreparedSeafloor> result() {
    check_header(scene_.seafloor);  // a large file takes long to be hashed, or read
    if (scene_.seafloor.kind == SeafloorKind::progressive) {
      make_seafloor_of_scene();
      choose("the seafloor was analysed before");
      if (!needs_progressive()) restore();
      return result_;
    }
    if (scene_.run.surface != "auto" && !needs_progressive()) {
      make_seafloor_of_scene();
      return result_;
    }
    find_cached();
    if (!result_->cached) make_seafloor_of_scene();
    choose_by_length();
    if (!needs_progressive()) {
      if (result_->cached) make_seafloor_of_scene();
      result_->cache_file.clear();
    } else if (!result_->cached) {
      make_progressive();
    }
    return result_;
  }

 private:
  void report(std::string_view stage) const {
    if (how_.progress) how_.progress(stage);
  }
  bool needs_progressive() const {
    return face_source_kind(result_->surface).needs_progressive_mesh;
  }

  void make_seafloor_of_scene() {
    report("seafloor");
    result_->seafloor = seafloor_of(scene_, plan());
    result_->cached = false;
  }

  MemoryPlan plan() const {
    return {how_.memory, bytes_per_face(scene_.run.surface, scene_.run.intersector),
            how_.more_bytes};
  }

  void restore() {
    const auto faces = static_cast<double>(result_->seafloor.faces);
    how_.memory.require(
        faces * (mesh_bytes_per_face + bytes_per_face(result_->surface, scene_.run.intersector)) +
            how_.more_bytes,
        fmt::format("the {:.0f} faces of {} and a tree over them", faces,
                    scene_.seafloor.progressive.path.string()),
        "take --surface footprint");
    with_memory_for("the seafloor", [&] { restore_mesh(result_->seafloor); });
  }

  void choose(std::string_view why) {
    if (scene_.run.surface != "auto") return;
    result_->surface = "refined";
    result_->why = why;
  }

  // By the scene alone: whether the cache has it changes no byte.
  void choose_by_length() {
    if (scene_.run.surface != "auto") return;
    if (scene_.track.kind != TrackKind::line) return choose("the track is no single line");
    const std::size_t faces = result_->seafloor.faces;
    const auto pings = static_cast<std::size_t>(scene_.track.pings);
    const bool long_enough = pings >= faces / faces_per_ping;
    result_->surface = long_enough ? "refined" : "static";
    result_->why = fmt::format("{} pings are {} to pay for the analysis of {} faces", pings,
                               long_enough ? "enough" : "too few", faces);
  }

  void find_cached() {
    if (how_.cache.empty()) return;
    report("seafloor");
    key_ = seafloor_key(scene_);
    result_->cache_file = file_of(how_.cache, key_);
    std::error_code unreadable;  // is as good as not there
    if (!fs::exists(result_->cache_file, unreadable)) return;
    try {
      result_->seafloor = open_analysed(result_->cache_file, key_);
      result_->cached = true;
      std::error_code ignored;  // it was used now
      fs::last_write_time(result_->cache_file, fs::file_time_type::clock::now(), ignored);
    } catch (const refine::MeshError& error) {
      result_->warnings.push_back(fmt::format("{}; it is made again", error.what()));
    }
  }

  void make_progressive() {
    report("analysis");
    with_memory_for("the analysis of the seafloor",
                    [&] { analyse(result_->seafloor, refine::thread_count(how_.threads)); });
    if (how_.cache.empty()) return;
    try {
      fs::create_directories(how_.cache);
      save_analysed(result_->seafloor, key_, result_->cache_file);
      trim_cache(how_.cache, result_->cache_file);
    } catch (const std::system_error& error) {
      result_->warnings.push_back(
          fmt::format("the analysed seafloor could not be kept: {}; --cache names another folder",
                      error.what()));
      result_->cache_file.clear();
    }
  }

  const Scene& scene_;
  const Preparation& how_;
  std::shared_ptr<PreparedSeafloor> result_ = std::make_shared<PreparedSeafloor>();
  std::string key_;
};

}  // namespace

const BedGrid& PreparedSeafloor::bed() const {
  std::call_once(bed_once_, [&] { bed_.emplace(seafloor); });
  return *bed_;
}

std::shared_ptr<const PreparedSeafloor> prepare_seafloor(const Scene& scene,
                                                         const Preparation& how) {
  refine::thread_count(how.threads);  // refuses a wrong number before any work
  return how.seafloor ? how.seafloor : Preparing(scene, how).result();
}

Seafloor seafloor_of(const Scene& scene, const MemoryPlan& plan) {
  try {
    return with_memory_for("the seafloor", [&] {
      return make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects, scene.materials, plan);
    });
  } catch (const std::invalid_argument& error) {
    throw_placed(scene, error);
  } catch (const refine::MeshError& error) {
    throw_placed(scene, error);
  }
}

std::string seafloor_key(const Scene& scene) {
  std::string text =
      fmt::format("seafloor {}\nprogressive mesh {}\n{}\nseed = {}\n", seafloor_version,
                  refine::progressive_mesh_version, library_versions(), scene.bed_seed());
  for (const Section<Scene>& section : scene_sections())
    if (section.name.starts_with("seafloor")) add_keys(text, section, scene);
  for_each_list(scene, [&](const auto& section, const auto& list) {
    for (const auto& item : list) add_keys(text, section, item);
  });
  return xxh128(text);
}

fs::path cache_file(const Scene& scene, const fs::path& cache) {
  return file_of(cache, seafloor_key(scene));
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
