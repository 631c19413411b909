#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// Reads the image of one sonar in a run's folder (OpenEXR) by rows. The file is not trusted: all
/// functions throw SceneError for a fault, with the file, what is wrong and what to do.
class ImageReader {
 public:
  /// Opens a file and checks that it is complete.
  explicit ImageReader(const std::filesystem::path& file);
  ~ImageReader();
  ImageReader(const ImageReader&) = delete;
  ImageReader& operator=(const ImageReader&) = delete;

  std::size_t rows() const;
  std::size_t columns() const;
  /// The attribute with this name. Throws SceneError if there is none.
  std::string text(const std::string& attribute) const;
  double number(const std::string& attribute) const;
  /// A layer's names of labels, by number; `attribute` is `class_names` or `sediment_names`.
  std::vector<std::string> names(const std::string& attribute) const;
  /// Fills `into` (one vector per layer) with `count` rows from row `first` on: count * columns()
  /// values per layer, as floats.
  void read(std::size_t first, std::size_t count, std::span<const std::string> layers,
            std::span<std::vector<float>> into);

 private:
  struct Open;
  std::filesystem::path file_;
  std::unique_ptr<Open> open_;
};

}  // namespace ensonify::engine
