#include <ensonify/engine/dataset/webdataset.h>

#include <fmt/format.h>

namespace ensonify::engine {

void WebDatasetWriter::add(const std::string& group_name, const std::string& key,
                           const std::string& extension, std::span<const std::byte> content) {
  Group& group = groups_[group_name];
  if (group.key != key) {
    if (group.records % records_per_tar == 0) {
      if (group.tar) group.tar->finish();
      group.tar = std::make_unique<TarFile>(
          folder_ / fmt::format("{}-{:06}.tar", group_name, group.records / records_per_tar));
    }
    group.key = key;
    ++group.records;
  }
  group.tar->add(key + "." + extension, content);
}

void WebDatasetWriter::finish() {
  for (auto& [name, group] : groups_) group.tar->finish();
  groups_.clear();
}

}  // namespace ensonify::engine
