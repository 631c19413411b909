#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// How many labels, and numbers of instances, there can be: they have 16 bits, and the last number
/// is what label pictures ignore. Number 0 is none.
inline constexpr std::size_t max_labels = 65535;

/// What a face belongs to; 0 is none.
struct Label {
  std::uint16_t sediment = 0;  ///< into Seafloor::materials
  std::uint16_t class_id = 0;  ///< into Seafloor::classes
  std::uint16_t instance = 0;  ///< which object or feature of the bed, from 1; 0: the bed
  bool two_sided = false;  ///< its backs answer as well: an imported mesh's outside is not known
  bool feature = false;    ///< a form of the bed that has an instance: no object on it
};

/// Where an object came to lie.
struct ObjectRecord {
  std::size_t table = 0;                               ///< of the scene's [[objects]], from 0
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of its bounds, local
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    ///< of its bounds: east, north, up
  double heading_rad = 0.0;
  double scale = 1.0;
  double buried = 0.0;  ///< share of its height under the bed
  Label label;          ///< its instance is its number in Seafloor::objects, from 1
};

/// A thing that a layer of relief made: a trawl mark, a pit or a boulder.
struct FeatureRecord {
  std::string layer;                                   ///< "boulders.0": of the scene's first
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of its points' bounds, local
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    ///< of its points' bounds: east, north, up
  Label label;  ///< of most; its instance is its number in Seafloor::features, after all objects
};

/// The mesh, and what each face is. Local z is height above the sea surface, so it is negative.
struct Seafloor {
  refine::TriangleMesh mesh;  ///< of no faces where `progressive` has them
  /// The mesh at many resolutions, once it was analysed (analysis.h); faces keep their numbers.
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  std::size_t vertices = 0, faces = 0;    ///< of the mesh, wherever it is
  std::size_t bed_faces = 0;              ///< the bed's come first, then each object's
  double mean_bed_m = 0.0;                ///< mean height of the bed's faces
  std::vector<Label> labels;              ///< the different ones there are; at least one
  std::vector<std::uint16_t> face_label;  ///< into labels, one a face; empty: the progressive
                                          ///< mesh's tags, or else all are labels[0]
  std::vector<std::string> classes = {"none"};
  std::vector<std::string> materials = {"none"};
  int utm_zone = 0;  ///< of the mesh's world, as in Heightfield
  std::vector<ObjectRecord> objects;
  std::vector<FeatureRecord> features;  ///< those that have a point of the bed
  std::size_t repairs = 0;              ///< of the files' meshes, all counts summed
  std::vector<std::string> warnings;  ///< what was repaired, a line a file, and what is too coarse

  /// Whether all faces have label 0.
  bool one_label() const {
    return face_label.empty() && (!progressive || progressive->tag_count() == 0);
  }
  /// Throws refine::MeshError for a progressive mesh that names a label there is not.
  std::uint16_t label_of(std::uint32_t face) const {
    if (!face_label.empty()) return face_label[face];
    return progressive ? tag_of(face) : std::uint16_t{0};
  }
  /// Of an object or, behind those, a feature. Throws std::out_of_range for an instance there is
  /// not.
  const Label& label_of_instance(std::uint32_t instance) const {
    const std::size_t number = std::size_t{instance} - 1;
    return number < objects.size() ? objects[number].label
                                   : features.at(number - objects.size()).label;
  }
  refine::Bounds bounds() const;  ///< of all faces, local metres

 private:
  std::uint16_t tag_of(std::uint32_t face) const;
};

}  // namespace ensonify::engine
