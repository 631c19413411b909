#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <ensonify/engine/dataset/sample_folder.h>

namespace ensonify::engine {

/// A sample's JSON files: sample.json and those of its images.
struct SampleRecord {
  nlohmann::ordered_json sample;
  std::map<std::string, nlohmann::ordered_json> images;
};

/// Whether the key "xxh128" is the hash of the others.
bool fits_its_hash(nlohmann::ordered_json json);

/// The finished samples of a dataset, in folders or in tars, checked against their hashes.
class CheckedSamples {
 public:
  /// `dataset_xxh128` is the hash of the dataset that they must belong to.
  CheckedSamples(const std::filesystem::path& dataset, std::string dataset_xxh128,
                 std::size_t samples, std::size_t samples_per_tar)
      : folders_(dataset, samples_per_tar),
        dataset_xxh128_(std::move(dataset_xxh128)),
        samples_(samples),
        per_tar_(samples_per_tar) {}

  bool finished(std::size_t sample) const { return folders_.finished(sample); }
  /// The sample's folder, or its tar.
  std::filesystem::path place(std::size_t sample) const;
  /// Reads and checks every file of a sample. None if one is damaged; `damage` then names the file
  /// and the damage. Throws std::system_error if the disk refuses to read it.
  std::optional<SampleRecord> read(std::size_t sample, std::string& damage);
  /// The size of a file of the sample that was read last; none if it is not one of its files.
  std::optional<std::uint64_t> size_bytes(std::size_t sample, const std::string& name) const;
  /// The path of a sample's file in the dataset's folder, also of one in a tar.
  std::string path_of(std::size_t sample, const std::string& name) const;
  std::string content_of(std::size_t sample, const std::string& name) const;
  /// The file itself, of a sample that is not in a tar.
  std::filesystem::path file(std::size_t sample, const std::string& name) const {
    return folders_.sample(sample) / name;
  }
  /// Passes the files of all samples to f, by their names in tars, in the order of these names.
  /// `sample` is the sample of a file; of one in a tar, the tar's first.
  void for_each_file(const std::function<void(std::size_t sample, const std::string& name,
                                              std::span<const std::byte> content)>& f) const;

 private:
  /// A file's size and hash, and the text of a JSON file.
  struct FileSeen {
    std::pair<std::uint64_t, std::string> size_and_hash;
    std::string text;
  };

  bool in_tar(std::size_t sample) const;
  std::string name_of(std::size_t sample, const std::string& file) const;
  void see_files_of(std::size_t sample);

  SampleFolders folders_;
  std::string dataset_xxh128_;
  std::size_t samples_, per_tar_;
  static constexpr std::size_t none = ~std::size_t{0};
  std::size_t seen_tar_ = none;
  std::map<std::string, FileSeen> seen_;  // by name, in a tar or in a sample's folder
};

}  // namespace ensonify::engine
