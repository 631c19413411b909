#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/object_way.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {
class HeightGrid;
struct RepairReport;
}  // namespace ensonify::refine

namespace ensonify::engine {

/// The largest number of labels, and of instances: they have 16 bits, and label pictures use the
/// last number for ignored pixels. Number 0 means none.
inline constexpr std::size_t max_labels = 65535;

/// The name of number 0. No class may have it.
inline constexpr std::string_view name_of_number_0 = "none";

/// The number of faces that a seafloor can have.
inline constexpr double max_seafloor_faces = 2147483648.0;  // 2^31

/// What a face belongs to. The number 0 means none.
struct Label {
  std::uint16_t sediment = 0;  ///< index into Seafloor::materials
  std::uint16_t class_id = 0;  ///< index into Seafloor::classes
  std::uint16_t instance = 0;  ///< number of the object or feature, from 1; 0: the bed
  bool two_sided = false;      ///< back faces scatter too: the mesh encloses no volume
  bool feature = false;        ///< the instance is a form of the bed, not an object on it
};

/// The position and size of one object that was set down.
struct ObjectRecord {
  std::size_t table = 0;  ///< number in the scene's [[objects]], from 0
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< middle of the bounding box, local
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    ///< of the bounding box: east, north, up
  double heading_rad = 0.0;
  double scale = 1.0;
  double buried = 0.0;  ///< share of the object's height that is under the bed
  Label label;          ///< the instance is the object's number in Seafloor::objects, from 1
};

/// One object of the scene that moves. It is not among the faces of the seafloor.
struct MovingRecord {
  ObjectRecord record;  ///< as it is where it starts; its heading is that of its mesh on the way
  refine::TriangleMesh mesh;  ///< about its middle, turned by the key heading_deg; metres
  ObjectWay way;
};

/// One feature that a relief layer made: a trawl mark, a pit or a boulder.
struct FeatureRecord {
  std::string layer;  ///< e.g. "boulders.0": made by the scene's first boulder layer
  Eigen::Vector3d middle_m =
      Eigen::Vector3d::Zero();  ///< middle of the box around the feature's points, local
  Eigen::Vector3d size_m =
      Eigen::Vector3d::Zero();  ///< east, north, up; includes half a cell beyond the points
  /// The label that most of the feature's points have. Instances count all objects first, then the
  /// features in the order of Seafloor::features.
  Label label;
};

/// The faces, and a label for each. The faces are in one of three places: all in `mesh`, all in
/// `progressive`, or the bed's faces in `grid` and the objects' faces in `mesh`. Local z is the
/// height above the sea surface, so local z is negative.
struct Seafloor {
  refine::TriangleMesh mesh;
  /// The mesh at many resolutions, after analyse() (analysis.h); faces keep their numbers.
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  std::shared_ptr<const refine::HeightGrid> grid;  ///< the heights of the bed
  std::size_t vertices = 0, faces = 0;             ///< of bed and objects
  std::size_t bed_faces = 0;  ///< the bed's faces come first, then each object's
  double mean_bed_m = 0.0;    ///< mean height of the bed's faces
  std::vector<Label> labels;  ///< the distinct labels; at least one
  /// Index into `labels`, one per face from number first_labelled on; the faces before have
  /// labels[0]. If face_label is empty, the tags of the progressive mesh are the indices. Without
  /// tags all faces have labels[0].
  std::vector<std::uint16_t> face_label;
  std::uint32_t first_labelled = 0;
  bool labels_in_grid = false;  ///< the kinds of the grid's tiles are the labels of the bed's faces
  std::vector<std::string> classes = {std::string(name_of_number_0)};
  std::vector<std::string> materials = {std::string(name_of_number_0)};
  int utm_zone = 0;       ///< as in Heightfield
  std::string reference;  ///< as in Heightfield
  std::vector<ObjectRecord> objects;
  std::vector<ObjectMesh> object_meshes;  ///< one per object; `mesh` has their faces in this order
  std::vector<FeatureRecord> features;    ///< only features that have a point of the bed
  std::vector<MovingRecord> moving;       ///< their instances follow those of the features
  std::size_t repairs = 0;                ///< number of repairs to all mesh files
  std::vector<std::string> warnings;      ///< of repairs, one line per file, and of too large cells

  /// Whether all faces have label 0.
  bool one_label() const {
    return face_label.empty() && !labels_in_grid && (!progressive || progressive->tag_count() == 0);
  }
  /// The index of the face's label. Throws refine::MeshError if the face's tag in the progressive
  /// mesh is not the index of a label, and what refine::HeightTiles::require() throws.
  std::uint16_t label_of(std::uint32_t face) const {
    if (labels_in_grid && face < bed_faces) return kind_of(face);
    if (face < first_labelled) return 0;
    if (!face_label.empty()) return face_label[face - first_labelled];
    return progressive ? tag_of(face) : std::uint16_t{0};
  }
  /// The number of the first face of `mesh`.
  std::uint32_t first_in_mesh() const { return grid ? static_cast<std::uint32_t>(bed_faces) : 0; }
  /// The label of an object at rest or of a feature, by its instance. Throws std::out_of_range if
  /// there is no such instance.
  const Label& label_of_instance(std::uint32_t instance) const {
    const std::size_t number = std::size_t{instance} - 1;
    return number < objects.size() ? objects[number].label
                                   : features.at(number - objects.size()).label;
  }
  /// The share of the bed's faces that each of `materials` has, without objects. For a large bed, a
  /// sample of its faces is counted. If the labels are in the grid, whose tiles may not be made
  /// yet, the first material has the whole bed. Throws what label_of() throws.
  std::vector<double> material_shares() const;
  /// Whether the bed has tiles that are made when needed, so that not all heights are known.
  bool in_tiles() const;
  /// The bounds of all faces, local metres. If in_tiles(), heights are estimates.
  refine::Bounds bounds() const;
  /// Counts the repairs to a mesh file, and adds a warning of them.
  void add_repairs(const refine::RepairReport& report, const std::filesystem::path& file);
  /// All faces of a seafloor without a progressive mesh, in their order. Throws what a bed in tiles
  /// throws, and std::bad_alloc.
  refine::TriangleMesh whole_mesh(const std::function<void()>& stop_check = {}) const;
  /// Appends the objects' faces to `bed`, some or all faces of `grid`. Throws std::bad_alloc.
  refine::TriangleMesh with_objects(refine::TriangleMesh bed) const;

 private:
  std::uint16_t kind_of(std::uint32_t face) const;
  std::uint16_t tag_of(std::uint32_t face) const;
};

}  // namespace ensonify::engine
