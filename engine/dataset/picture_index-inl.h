#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <ensonify/engine/dataset/checked_samples-inl.h>
#include <ensonify/engine/dataset/merged_files.h>

namespace ensonify::engine {

/// The classes of a dataset, for its indexes.
struct IndexClasses {
  std::vector<std::string> names;  ///< class number n is names[n - 1]
  std::size_t shadow_class = 0;    ///< number of the class of shadows; 0: none
};

/// A picture of a sample.
struct IndexedPicture {
  std::size_t sample = 0;
  std::string name;      ///< in the sample's folder
  std::string segments;  ///< the outlines in it, as rows of YOLO's segmentation format
};

/// The paths of a picture and its masks, relative to the dataset's folder.
struct PicturePaths {
  std::string picture;
  nlohmann::ordered_json masks;  ///< by kind of mask
};

/// The pictures of one geometry, kind and split, and the content of the files about them. Boxes are
/// [column, row, columns, rows]. Category numbers begin with 1 in COCO and the Hub, with 0 in YOLO.
class PictureIndex {
 public:
  /// Adds a picture. `image` is the content of the image's JSON file. Throws
  /// nlohmann::json::exception and std::runtime_error if `image` is damaged.
  void add(std::size_t sample, const std::string& name, const PicturePaths& paths,
           const nlohmann::ordered_json& image, const IndexClasses& classes);

  const std::vector<IndexedPicture>& pictures() const { return pictures_; }
  const nlohmann::ordered_json& images() const { return images_; }  ///< of COCO
  /// The clips whose frames are the images, for COCO; empty if there are no frames.
  const nlohmann::ordered_json& videos() const { return videos_; }
  const nlohmann::ordered_json& annotations() const { return annotations_; }  ///< of COCO
  const std::string& yolo_list() const { return yolo_list_; }
  const std::string& hub_metadata() const { return hub_metadata_; }  ///< metadata.jsonl

 private:
  std::size_t number_of_video(std::size_t sample, const std::string& name,
                              const nlohmann::ordered_json& image);
  nlohmann::ordered_json& add_outline(std::size_t category, const nlohmann::ordered_json& outline);
  void add_target(const nlohmann::ordered_json& target);
  void add_shadow(const nlohmann::ordered_json& target, std::size_t shadow_class);
  std::string hub_row(const nlohmann::ordered_json& image, const IndexedPicture& picture,
                      std::size_t first_annotation, const IndexClasses& classes) const;

  std::vector<IndexedPicture> pictures_;
  nlohmann::ordered_json images_ = nlohmann::ordered_json::array();
  nlohmann::ordered_json annotations_ = nlohmann::ordered_json::array();
  nlohmann::ordered_json videos_ = nlohmann::ordered_json::array();
  std::map<std::string, std::size_t> video_numbers_;  // by the name of the video
  /// By video and instance: the number that the target has in all frames of the video.
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> tracks_;
  std::string yolo_list_, hub_metadata_;
};

/// The pictures of a dataset by group and split.
using PictureIndexes = std::map<std::pair<std::string, std::string>, PictureIndex>;

/// Writes yolo/ (boxes) and yolo_segment/ (outlines) for the splits that have pictures. classes[k]
/// is class k. On a file system without links, leaves out the lists and adds a warning.
void write_yolo(const PictureIndexes& indexes, const std::vector<std::string>& classes,
                MergedFiles& files, std::vector<std::string>& warnings);

/// Writes hub/GROUP/SPLIT/ for the Hub's ImageFolder: pictures, and metadata.jsonl next to them.
/// The pictures are hard links, or copies on a file system without hard links.
HubGroups write_hub(const PictureIndexes& indexes, const CheckedSamples& samples,
                    MergedFiles& files);

}  // namespace ensonify::engine
