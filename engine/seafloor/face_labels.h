#pragma once

#include <cstdint>
#include <vector>

#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// Labels of a seafloor's faces and of bodies that move. All faces of moving body b have the face
/// number Seafloor::faces + b. The seafloor and the list of moving labels must outlive this object.
class FaceLabels {
 public:
  FaceLabels(const Seafloor& seafloor, const std::vector<Label>* moving = nullptr)
      : seafloor_(&seafloor),
        moving_(moving),
        first_labelled_(seafloor.one_label()      ? static_cast<std::uint32_t>(seafloor.faces)
                        : seafloor.labels_in_grid ? 0
                                                  : seafloor.first_labelled) {}

  /// Throws what Seafloor::label_of() throws.
  std::uint16_t label_of(std::uint32_t face) const {
    if (face < first_labelled_) return 0;
    if (!moving_ || face < seafloor_->faces) return seafloor_->label_of(face);
    return static_cast<std::uint16_t>(seafloor_->labels.size() + (face - seafloor_->faces));
  }
  const Label& operator[](std::uint16_t label) const {
    const std::size_t fixed = seafloor_->labels.size();
    return label < fixed ? seafloor_->labels[label] : (*moving_)[label - fixed];
  }

 private:
  const Seafloor* seafloor_;
  const std::vector<Label>* moving_;  // one per body
  std::uint32_t first_labelled_;      // faces before this one have label 0
};

}  // namespace ensonify::engine
