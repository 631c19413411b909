#include <ensonify/engine/dataset/sample_folder.h>

#include <fmt/format.h>

#include <ensonify/engine/output/tar.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

SampleFolders::SampleFolders(fs::path dataset, std::size_t samples_per_tar)
    : dataset_(std::move(dataset)), samples_per_tar_(samples_per_tar) {}

bool SampleFolders::finished(std::size_t number) const {
  // A tar appears before its samples' folders are removed, so this order misses none.
  return fs::exists(sample(number)) ||
         (samples_per_tar_ > 0 && is_whole_tar(tar(number / samples_per_tar_)));
}

fs::path SampleFolders::sample(std::size_t number) const {
  return dataset_ / "samples" / name_of(number);
}
fs::path SampleFolders::tar(std::size_t number) const {
  return dataset_ / "tars" / (name_of(number) + ".tar");
}
std::string SampleFolders::name_of(std::size_t sample) { return fmt::format("{:06}", sample); }

std::string SampleFolders::name_in_tar(std::size_t sample, const std::string& file) {
  const std::size_t slash = file.find('/');
  if (slash == std::string::npos) return fmt::format("{:06}.{}", sample, file);
  return fmt::format("{:06}-{}-{}", sample, file.substr(0, slash), file.substr(slash + 1));
}

}  // namespace ensonify::engine
