#include <ensonify/engine/simulator/prepare.h>

#include <algorithm>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/seafloor/add_objects.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/base.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/simulator/seafloor_cache.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_clusters.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/progressive_mesh_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

// The analysis of this many faces takes about as long as the echoes of one ping.
constexpr std::size_t faces_per_ping = 5000;

// Measured over 1.4 million faces of ripples: Embree's tree over all faces takes 0.4 us per face,
// and saves 0.6 ms per ping for queries and their trees. It takes memory as well.
constexpr std::size_t faces_per_static_ping = 1500;
constexpr std::size_t most_static_faces = 10'000'000;

/// Calls make() for a scene's seafloor. An error with the key of a layer or an object gets the
/// place of this key in the scene's file. std::invalid_argument becomes a SceneError.
template <class Make>
auto with_places(const Scene& scene, Make&& make) {
  try {
    return with_memory_for("the seafloor", make);
  } catch (const SceneError& error) {
    const auto place = scene.places.find(error.key);
    if (place == scene.places.end()) throw;
    throw SceneError(error.key, fmt::format("{}: {}", place->second, error.what()));
  } catch (const std::invalid_argument& error) {
    throw SceneError(error.what());
  }
}

/// Bytes per face that a surface needs in addition to the mesh; for `auto` the smaller one.
double bytes_per_face(std::string_view surface, std::string_view intersector) {
  if (surface == auto_surface)
    return std::min(bytes_per_face(static_surface, intersector),
                    bytes_per_face(refined_surface, intersector));
  const double bytes =
      build_bytes_per_face(face_source_kind(surface), intersector_kind(intersector));
  return face_source_kind(surface).needs_progressive_mesh ? bytes : bytes + BedGrid::bytes_per_face;
}

/// Throws for settings that a bed in tiles cannot have.
void refuse_for_tiles(const Scene& scene) {
  if (scene.run.surface == static_surface)
    throw SceneError(
        "run: the surface 'static' needs the whole bed at once, and this one is made in tiles; use "
        "footprint, or refined");
  if (scene.sea.refraction == RefractionMode::full)
    throw SceneError(
        "sea: refraction 'full' needs the highest and the lowest point of the bed, which are not known "
        "while a bed is made in tiles; use time-only, or a smaller bed");
}

class Preparing {
 public:
  Preparing(const Scene& scene, const Preparation& how)
      : scene_(scene), wanted_(preparation_key(scene)), how_(how) {
    origin_.surface = wanted_.surface;
  }

  std::shared_ptr<const PreparedSeafloor> result() {
    check_header(scene_.seafloor);  // a large file takes long to be hashed, or read
    if (scene_.seafloor.kind == SeafloorKind::progressive) {
      make_seafloor_of_scene();
      choose("the seafloor was analysed before");
      if (!needs_progressive()) restore();
      return result_;
    }
    if (needs_tiles(scene_.seafloor)) {
      take_tiles();
      return result_;
    }
    if (scene_.seafloor.is_grid() &&
        (wanted_.surface == auto_surface || face_source_kind(wanted_.surface).takes_grid)) {
      make_seafloor_of_scene(BedForm::grid);
      choose_for_grid();
      return result_;
    }
    if (wanted_.surface != auto_surface && !needs_progressive()) {
      make_seafloor_of_scene();
      return result_;
    }
    find_cached();
    if (!origin_.cached) make_seafloor_of_scene();
    choose_by_length();
    if (!needs_progressive()) {
      if (origin_.cached) make_seafloor_of_scene();
      origin_.cache_file.clear();
    } else if (!origin_.cached) {
      make_progressive();
    }
    return result_;
  }

  std::shared_ptr<const PreparedSeafloor> with_moving_objects() {
    result();
    if (std::ranges::none_of(scene_.objects, &ObjectOptions::moves)) return result_;
    Seafloor& seafloor = result_->seafloor;
    with_places(scene_, [&] {
      Seafloor mesh;  // objects are set down on a mesh or a grid
      if (seafloor.progressive) {
        mesh = seafloor;
        restore_mesh(mesh);
      }
      add_moving_objects(scene_.objects, scene_.bed_seed(), scene_.materials,
                         BedGrid(seafloor.progressive ? mesh : seafloor, how_.stop_check), seafloor,
                         plan(), {refine::thread_count(how_.threads), still_in("seafloor")});
    });
    return result_;
  }

 private:
  void report(std::string_view stage) const {
    if (how_.progress) how_.progress(stage);
  }
  /// Repeats the report of a long stage at intervals, from any thread.
  std::function<void()> still_in(std::string_view stage) {
    return [this, stage] {
      const std::lock_guard lock(reporting_);
      if (seconds_since(reported_) < 0.1) return;
      report(stage);
      reported_ = Clock::now();
    };
  }
  bool needs_progressive() const {
    return face_source_kind(origin_.surface).needs_progressive_mesh;
  }

  void make_seafloor_of_scene(BedForm form = BedForm::mesh) {
    report("seafloor");
    result_->seafloor = seafloor_of(scene_, plan(), form,
                                    {refine::thread_count(how_.threads), still_in("seafloor")});
    origin_.cached = false;
  }

  /// A bed whose tiles are made when a ping needs them.
  void take_tiles() {
    report("seafloor");
    refuse_for_tiles(scene_);
    const auto make = [&](const fs::path& file) {
      result_->seafloor = with_places(scene_, [&] {
        return make_seafloor_in_tiles(scene_.seafloor, scene_.bed_seed(), scene_.objects,
                                      scene_.materials, {file, key_}, plan(), still_in("seafloor"));
      });
      if (!face_source_kind(origin_.surface).takes_grid) make_clusters(file);
    };
    if (wanted_.surface == auto_surface) {
      origin_.surface = footprint_surface;
      origin_.why = "the bed is made in tiles where pings need it";
    }
    if (how_.cache.empty()) return make({});
    key_ = seafloor_key(scene_);
    const fs::path file = file_of(how_.cache, key_, tiles_extension);
    try {
      refine::make_folder(how_.cache);
      if (!is_tile_file(file)) remove_with_warning(file);
      std::error_code unreadable;  // counts as missing
      origin_.cached = fs::exists(file, unreadable);
      make(file);
      origin_.cache_file = file;
      fs::last_write_time(file, fs::file_time_type::clock::now(), unreadable);
      trim_cache(how_.cache, how_.cache_limit_bytes, key_);
    } catch (const std::system_error& error) {
      warn_of_cache("the bed's tiles are", error);
      origin_.cached = false;
      make({});
    }
  }

  /// Makes the clusters of a bed in tiles, in a folder next to the file of the tiles, if there is
  /// such a file.
  void make_clusters(const fs::path& tiles) {
    const fs::path folder =
        tiles.empty() ? fs::path() : file_of(how_.cache, key_, clusters_extension);
    result_->clusters = std::make_shared<refine::MeshClusters>(
        *result_->seafloor.grid, result_->seafloor.mesh, folder, key_);
    std::error_code not_there_yet;
    fs::last_write_time(folder, fs::file_time_type::clock::now(), not_there_yet);
  }

  /// True if the file does not exist, or has the tiles of this key.
  bool is_tile_file(const fs::path& file) {
    std::error_code unreadable;
    if (!fs::exists(file, unreadable)) return true;
    try {
      return refine::HeightTiles(file).key() == key_;
    } catch (const refine::MeshError&) {
      return false;
    }
  }
  void remove_with_warning(const fs::path& file) {
    result_->warnings.push_back(fmt::format(
        "{}: is damaged or belongs to another seafloor; it is made again", file.string()));
    std::error_code ignored;
    fs::remove(file, ignored);
  }

  MemoryPlan plan() const {
    return {how_.memory, bytes_per_face(wanted_.surface, wanted_.intersector), how_.more_bytes};
  }

  /// Throws MemoryError unless the mesh and a tree over it fit. of: what has the faces.
  void require_tree(const std::string& of) const {
    const std::size_t faces = result_->seafloor.faces;
    how_.memory.require(
        static_cast<double>(faces) * (refine::mesh_bytes_per_face +
                                      bytes_per_face(origin_.surface, wanted_.intersector)) +
            how_.more_bytes,
        fmt::format("the {} faces of {} and a tree over them", faces, of),
        "use --surface footprint");
  }

  void restore() {
    require_tree(scene_.seafloor.progressive.path.string());
    with_memory_for("the seafloor", [&] { restore_mesh(result_->seafloor); });
  }

  void choose(std::string_view why) {
    if (wanted_.surface != auto_surface) return;
    origin_.surface = refined_surface;
    origin_.why = why;
  }

  // The choice depends on the seafloor and on `wanted_` only, not on the cache, so the output does
  // not depend on the cache. All face sources give the same hits, except with Embree.

  void choose_for_grid() {
    if (wanted_.surface != auto_surface) return;
    const std::size_t faces = result_->seafloor.faces;
    const std::size_t pings = wanted_.line_pings.value_or(0);
    const bool for_a_tree = intersector_kind(wanted_.intersector).builds_tree &&
                            wanted_.line_pings && faces <= most_static_faces &&
                            pings >= faces / faces_per_static_ping;
    origin_.surface = for_a_tree ? static_surface : footprint_surface;
    origin_.why =
        for_a_tree
            ? fmt::format("{} pings are enough for a tree over {} faces to save time", pings, faces)
            : "the bed is a grid of heights, and a tree over all its faces would not save time";
    if (!for_a_tree) return;
    require_tree("the seafloor");
    with_memory_for("the seafloor",
                    [&] { take_bed_to_mesh(result_->seafloor, still_in("seafloor")); });
  }

  void choose_by_length() {
    if (wanted_.surface != auto_surface) return;
    if (!wanted_.line_pings) return choose("the track is no single line");
    const std::size_t faces = result_->seafloor.faces;
    const bool long_enough = *wanted_.line_pings >= faces / faces_per_ping;
    origin_.surface = long_enough ? refined_surface : static_surface;
    origin_.why = fmt::format("{} pings are {} for the analysis of {} faces to save time",
                              *wanted_.line_pings, long_enough ? "enough" : "too few", faces);
  }

  void find_cached() {
    if (how_.cache.empty()) return;
    report("seafloor");
    key_ = seafloor_key(scene_);
    origin_.cache_file = file_of(how_.cache, key_, cached_extension);
    std::error_code unreadable;  // counts as missing
    if (!fs::exists(origin_.cache_file, unreadable)) return;
    try {
      result_->seafloor = open_analysed(origin_.cache_file, key_);
      origin_.cached = true;
      std::error_code ignored;  // it was used now
      fs::last_write_time(origin_.cache_file, fs::file_time_type::clock::now(), ignored);
    } catch (const refine::MeshError& error) {
      result_->warnings.push_back(fmt::format("{}; it is made again", error.what()));
    }
  }

  void make_progressive() {
    report("analysis");
    with_memory_for("the analysis of the seafloor", [&] {
      analyse(result_->seafloor, refine::thread_count(how_.threads), still_in("analysis"));
    });
    if (how_.cache.empty()) return;
    try {
      refine::make_folder(how_.cache);
      save_analysed(result_->seafloor, key_, origin_.cache_file);
      trim_cache(how_.cache, how_.cache_limit_bytes, key_);
    } catch (const std::system_error& error) {
      warn_of_cache("the analysed seafloor is", error);
      origin_.cache_file.clear();
    }
  }

  void warn_of_cache(std::string_view what_is, const std::system_error& error) {
    result_->warnings.push_back(
        fmt::format("{}; {} not kept (--cache names another folder)", error.what(), what_is));
  }

  const Scene& scene_;
  const PreparationKey wanted_;
  const Preparation& how_;
  std::shared_ptr<PreparedSeafloor> result_ = std::make_shared<PreparedSeafloor>();
  SeafloorOrigin& origin_ = result_->origin;
  std::string key_;
  std::mutex reporting_;
  Clock::time_point reported_;
};

}  // namespace

const BedGrid& PreparedSeafloor::bed(const std::function<void()>& stop_check) const {
  std::call_once(bed_once_, [&] { bed_.emplace(seafloor, stop_check); });
  return *bed_;
}

BedHeight::BedHeight(const PreparedSeafloor& prepared) {
  if (prepared.seafloor.progressive)
    plumb_line_.emplace(prepared.seafloor);
  else
    grid_ = &prepared.bed();
}

double BedHeight::height_m(double x_m, double y_m) {
  return grid_ ? grid_->height_m(x_m, y_m) : plumb_line_->height_m(x_m, y_m);
}

std::optional<BedPoint> BedHeight::top(double x_m, double y_m) {
  return grid_ ? grid_->top(x_m, y_m) : plumb_line_->top(x_m, y_m);
}

PreparationKey preparation_key(const Scene& scene) {
  PreparationKey key{.surface = scene.run.surface, .intersector = scene.run.intersector};
  if (scene.track.kind == TrackKind::line)
    key.line_pings = static_cast<std::size_t>(scene.track.pings);
  return key;
}

std::shared_ptr<const PreparedSeafloor> prepare_seafloor(const Scene& scene,
                                                         const Preparation& how) {
  refine::thread_count(how.threads);  // refuses a wrong number before any work
  return how.seafloor ? how.seafloor : Preparing(scene, how).with_moving_objects();
}

Scene with_session_surface(Scene scene) {
  if (scene.run.surface == auto_surface && !needs_tiles(scene.seafloor))
    scene.run.surface = static_surface;
  return scene;
}

Seafloor seafloor_of(const Scene& scene, const MemoryPlan& plan, BedForm form,
                     const WorkControl& control) {
  return with_places(scene, [&] {
    return make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects, scene.materials, plan,
                         form, control);
  });
}

Heightfield heights_of(const Scene& scene, const MemoryPlan& plan, const WorkControl& control) {
  return with_places(scene, [&] {
    return make_heightfield(scene.seafloor, scene.bed_seed(), scene.objects, scene.materials, plan,
                            control);
  });
}

}  // namespace ensonify::engine
