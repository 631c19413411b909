#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ensonify::engine {

/// The image of one sonar in a run's folder (OpenEXR), read by rows. The file is not trusted: each
/// fault throws SceneError with the file, what is wrong and what to do.
class ImageReader {
 public:
  /// Opens a file and checks that it is complete.
  explicit ImageReader(const std::filesystem::path& file);
  ~ImageReader();
  ImageReader(const ImageReader&) = delete;
  ImageReader& operator=(const ImageReader&) = delete;

  std::size_t rows() const;
  std::size_t columns() const;
  /// The attribute of that name, which has to be there.
  std::string text(const std::string& attribute) const;
  double number(const std::string& attribute) const;
  /// The names of a layer of labels, by number: its attribute `class_names` or `sediment_names`.
  std::vector<std::string> names(const std::string& attribute) const;
  /// Fills `into` (one entry per layer) with `count` rows from `first` on: count * columns() values
  /// per layer, as float.
  void read(std::size_t first, std::size_t count, std::span<const std::string> layers,
            std::span<std::vector<float>> into);

 private:
  struct Open;
  std::filesystem::path file_;
  std::unique_ptr<Open> open_;
};

}  // namespace ensonify::engine
