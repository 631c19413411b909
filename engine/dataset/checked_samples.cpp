#include <ensonify/engine/dataset/checked_samples-inl.h>

#include <exception>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json json_in(const std::string& name, const std::string& text) {
  try {
    return json_of<nlohmann::ordered_json>(text);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{} is damaged: {}", name, error.what()));
  }
}

/// Calls f with the name (relative to the folder) and the path of each file below a sample's
/// folder. Throws std::runtime_error for a link that leads out of the dataset, because the merge
/// would copy the content of a file outside.
template <class F>
void for_each_file_below(const fs::path& folder, const fs::path& dataset, const F& f) {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    if (entry.is_symlink() && !lies_below(entry.path(), dataset))
      throw std::runtime_error(
          fmt::format("{} is a link that leads out of the dataset; copy the file there",
                      entry.path().filename().string()));
    f(entry.path().lexically_relative(folder).string(), entry.path());
  }
}

}  // namespace

bool fits_its_hash(nlohmann::ordered_json json) {
  const std::string hash = json.at("xxh128").get<std::string>();
  json.erase("xxh128");
  return hash == xxh128(json.dump());
}

bool CheckedSamples::in_tar(std::size_t sample) const {
  return per_tar_ > 0 && fs::exists(folders_.tar(sample / per_tar_));
}

fs::path CheckedSamples::place(std::size_t sample) const {
  return in_tar(sample) ? folders_.tar(sample / per_tar_) : folders_.sample(sample);
}

std::string CheckedSamples::name_of(std::size_t sample, const std::string& file) const {
  return in_tar(sample) ? SampleFolders::name_in_tar(sample, file) : file;
}

/// Reads the sizes and hashes of a sample's files into seen_. A tar is read only once: it has
/// consecutive samples, and seen_ then has the files of all of them.
void CheckedSamples::see_files_of(std::size_t sample) {
  const std::size_t tar = in_tar(sample) ? sample / per_tar_ : none;
  if (tar != none && tar == seen_tar_) return;
  seen_.clear();
  seen_tar_ = tar;
  const auto see_json = [&](const std::string& name, std::string text) {
    FileSeen& seen = seen_[name];
    seen.size_and_hash = {text.size(), xxh128(text)};
    seen.text = std::move(text);
  };
  const auto is_json = [](const std::string& name) { return name.ends_with(".json"); };
  if (tar != none) {
    read_tar(folders_.tar(tar), [&](const std::string& name, std::vector<std::byte> content) {
      if (!is_json(name))
        seen_[name].size_and_hash = {content.size(), xxh128(content)};
      else if (content.size() > most_json_bytes)
        throw std::runtime_error(fmt::format("{} has {} bytes, expected at most {}", name,
                                             content.size(), most_json_bytes));
      else
        see_json(name, {reinterpret_cast<const char*>(content.data()), content.size()});
    });
    return;
  }
  const auto see = [&](const std::string& name, const fs::path& file) {
    if (is_json(name)) return see_json(name, refine::read_file(file, most_json_bytes));
    const FileRecord record = record_of(file.parent_path(), file.filename().string());
    seen_[name].size_and_hash = {record.size_bytes, record.xxh128};
  };
  for_each_file_below(place(sample), folders_.dataset(), see);
}

std::optional<SampleRecord> CheckedSamples::read(std::size_t sample, std::string& damage) {
  const auto damaged = [&](const std::string& file, std::string_view what) {
    damage = fmt::format("{}: {}", (place(sample) / name_of(sample, file)).string(), what);
    return std::nullopt;
  };
  try {
    see_files_of(sample);
    SampleRecord record;
    const auto own = seen_.find(name_of(sample, "sample.json"));
    if (own == seen_.end()) return damaged("sample.json", "is missing");
    record.sample = json_in(own->first, own->second.text);
    if (!fits_its_hash(record.sample))
      return damaged("sample.json", "its hash is not the one that it contains");
    if (record.sample.at("dataset_xxh128") != dataset_xxh128_)
      return damaged("sample.json", "it is a sample of another dataset");
    if (whole_numbers(record.sample.at("sample")).get<std::size_t>() != sample)
      return damaged("sample.json", "it is another sample, under this one's number");
    for (const auto& file : record.sample.at("files")) {
      const auto name = file.at("name").get<std::string>();
      const auto seen = seen_.find(name_of(sample, name));
      if (seen == seen_.end()) return damaged(name, "is missing");
      if (seen->second.size_and_hash !=
          std::pair(whole_numbers(file.at("size_bytes")).get<std::uint64_t>(),
                    file.at("xxh128").get<std::string>()))
        return damaged(name, "its bytes have changed since it was written");
      if (name.ends_with(".json") && name != "manifest.json")
        if (auto image = json_in(seen->first, seen->second.text); image.contains("pictures"))
          record.images[name] = std::move(image);
    }
    return record;
  } catch (const std::system_error& error) {
    // If the disk cannot read a file, the file may be undamaged.
    if (error.code() != std::errc::no_such_file_or_directory &&
        error.code() != std::errc::not_a_directory)
      throw;
    damage = fmt::format("{}: {}", place(sample).string(), error.code().message());
    return std::nullopt;
  } catch (const std::exception& error) {
    damage = fmt::format("{}: {}", place(sample).string(), fault_in_json(error));
    return std::nullopt;
  }
}

std::optional<std::uint64_t> CheckedSamples::size_bytes(std::size_t sample,
                                                        const std::string& name) const {
  const auto seen = seen_.find(name_of(sample, name));
  if (seen == seen_.end()) return std::nullopt;
  return seen->second.size_and_hash.first;
}

std::string CheckedSamples::path_of(std::size_t sample, const std::string& name) const {
  return in_tar(sample) ? fmt::format("tars/{}/{}", place(sample).filename().string(),
                                      SampleFolders::name_in_tar(sample, name))
                        : fmt::format("samples/{}/{}", SampleFolders::name_of(sample), name);
}

std::string CheckedSamples::content_of(std::size_t sample, const std::string& name) const {
  if (!in_tar(sample)) return refine::read_file(file(sample, name));
  std::string found;
  read_tar(place(sample), [&](const std::string& in_tar, const std::vector<std::byte>& content) {
    if (in_tar == SampleFolders::name_in_tar(sample, name))
      found.assign(reinterpret_cast<const char*>(content.data()), content.size());
  });
  return found;
}

void CheckedSamples::for_each_file(const std::function<void(std::size_t, const std::string&,
                                                            std::span<const std::byte>)>& f) const {
  for (std::size_t i = 0; i < samples_; ++i) {
    if (in_tar(i)) {
      if (i % per_tar_ == 0)
        read_tar(place(i), [&](const std::string& name, std::vector<std::byte> content) {
          f(i, name, content);
        });
      continue;
    }
    std::map<std::string, fs::path> files;
    const auto take = [&](const std::string& name, const fs::path& file) {
      files[SampleFolders::name_in_tar(i, name)] = file;
    };
    for_each_file_below(place(i), folders_.dataset(), take);
    for (const auto& [name, file] : files) {
      const std::string content = refine::read_file(file);
      f(i, name, std::as_bytes(std::span(content)));
    }
  }
}

}  // namespace ensonify::engine
