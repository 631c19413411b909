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

#include <ensonify/engine/dataset/dataset_json.h>

namespace ensonify::engine {

/// A sample's JSON files: sample.json and those of its images.
struct SampleRecord {
  nlohmann::ordered_json sample;
  std::map<std::string, nlohmann::ordered_json> images;
};

/// Whether the key "xxh128" has the hash of the other keys.
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
  /// Reads and checks every file of a sample. If a file is missing or damaged, returns nullopt, and
  /// `damage` names what is wrong and where. Throws std::system_error if the disk cannot read a
  /// file.
  std::optional<SampleRecord> read(std::size_t sample, std::string& damage);
  /// The size of a file of the sample last given to read(); none if it has no such file.
  std::optional<std::uint64_t> size_bytes(std::size_t sample, const std::string& name) const;
  /// The path of a sample's file relative to the dataset's folder. For a file in a tar: the tar's
  /// path, then the name in the tar.
  std::string path_of(std::size_t sample, const std::string& name) const;
  std::string content_of(std::size_t sample, const std::string& name) const;
  /// The path of a file. Only for a sample that is not in a tar.
  std::filesystem::path file(std::size_t sample, const std::string& name) const {
    return folders_.sample(sample) / name;
  }
  /// Calls f with every file of all samples, in the order of `name`. `name` is the file's name in a
  /// tar. `sample` is the file's sample, or the first sample of its tar.
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
