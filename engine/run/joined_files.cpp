#include <ensonify/engine/run/joined_files.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run/json_record-inl.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_rows = 30000;
constexpr std::uintmax_t most_picture_bytes = std::uintmax_t{1} << 30;

Picture read_picture(const fs::path& file) {
  const std::string content = refine::read_file(file, most_picture_bytes);
  try {
    return decode_png(std::as_bytes(std::span(content)));
  } catch (const std::runtime_error& error) {
    throw SceneError(fmt::format("{}: {}; {}", file.string(), error.what(), make_part_again));
  }
}

}  // namespace

std::size_t pings_per_row(std::size_t pings) { return (pings + max_rows - 1) / max_rows; }

void join_pictures(const fs::path& folder, const RunParts& parts, std::size_t finished_parts,
                   const std::string& sonar) {
  refine::NewFile file(folder / (sonar + ".png"));
  std::optional<PngWriter> writer;
  PngFormat format;  // of the joined picture
  std::size_t beams = 0, group = 1;
  // A group is the rows of the parts' pictures whose mean is one row of the joined picture.
  std::size_t left = 0, added = 0;  // rows of the present group
  std::vector<std::uint64_t> sums;
  std::vector<std::uint8_t> mean;
  // The newest ping is on top. Groups begin at the oldest ping; the top one may be smaller.
  for (std::size_t part = finished_parts; part-- > 0;) {
    const fs::path its_file = folder / parts.file(part, sonar, ".png");
    const Picture picture = read_picture(its_file);
    const std::size_t pings = parts.range(part).count;
    if (!writer) {
      beams = picture.height / pings;
      format = {picture.width, 0, picture.channels, picture.bits};
    }
    if (beams == 0 || picture.height != beams * pings || picture.width != format.width ||
        picture.channels != format.channels || picture.bits != format.bits)
      throw SceneError(
          fmt::format("{}: its size does not fit its pings and the other parts' pictures; {}",
                      its_file.string(), make_part_again));
    if (!writer) {
      group = pings_per_row(beams * parts.pings());
      const std::size_t rows = beams * parts.range(part).end();
      format.height = (rows + group - 1) / group;
      left = rows % group > 0 ? rows % group : group;
      sums.resize(picture.width * static_cast<std::size_t>(picture.channels));
      writer.emplace(format, [&](std::span<const std::byte> bytes) { file.write(bytes); });
    }
    const bool wide = picture.bits == 16;
    for (auto pixels = picture.pixels.begin(); pixels != picture.pixels.end();) {
      for (std::uint64_t& sum : sums) {
        const unsigned high = wide ? *pixels++ : 0u;
        sum += 256u * high + *pixels++;
      }
      ++added;
      if (--left > 0) continue;
      mean.clear();
      for (std::uint64_t& sum : sums) {
        const std::uint64_t value = (std::exchange(sum, 0) + added / 2) / added;
        if (wide) mean.push_back(static_cast<std::uint8_t>(value >> 8));
        mean.push_back(static_cast<std::uint8_t>(value & 0xff));
      }
      writer->add_rows(mean);
      left = group;
      added = 0;
    }
  }
  writer->finish();
  file.commit();
}

PartRecord sum_of_parts(const fs::path& folder, const RunParts& parts, std::size_t first,
                        std::size_t end) {
  PartRecord sum{.counts = {{"pings", 0}}};
  for (std::size_t part = first; part < end; ++part) {
    const std::string its = parts.folder(part);
    PartRecord record = read_part_json(folder / its / part_json_name);
    for (FileRecord& file : record.files) file.name = its + "/" + file.name;
    if (part == first)
      sum = std::move(record);
    else
      sum += record;
  }
  return sum;
}

PartRecord finish_run(const fs::path& folder, const RunPlan& plan,
                      const std::function<void()>& waiting) {
  const RunParts& parts = plan.parts;
  PartRecord whole = sum_of_parts(folder, parts, 0, parts.count());
  for (std::size_t part = 0; part < parts.count(); ++part)
    whole.files.push_back(record_of(folder, parts.folder(part) + "/" + part_json_name));
  for (const auto& [sonar, visibility] : whole.object_visibility) {
    const std::string picture = sonar + ".png", targets = sonar + "_targets.json";
    {
      const Claim claim = StagingFolder::wait_for(folder / picture, waiting);
      join_pictures(folder, parts, parts.count(), sonar);
    }
    whole.files.push_back(record_of(folder, picture));
    if (std::ranges::none_of(whole.files, [](const FileRecord& file) {
          return file.name.ends_with("_targets.json");
        }))
      continue;
    const Claim claim = StagingFolder::wait_for(folder / targets, waiting);
    refine::write_file(folder / targets,
                       join_targets(folder, parts, sonar, visibility, whole.target_sights[sonar]));
    whole.files.push_back(record_of(folder, targets));
  }
  whole.files.push_back(record_of(folder, plan_file(folder).filename().string()));
  std::ranges::sort(whole.files, {}, &FileRecord::name);
  const std::vector<std::string> more = warnings_of(whole, plan.intersector);
  whole.warnings.insert(whole.warnings.end(), more.begin(), more.end());
  const Claim claim = StagingFolder::wait_for(folder / "manifest.json", waiting);
  refine::write_file(folder / "manifest.json", manifest_json(plan, whole));
  return whole;
}

}  // namespace ensonify::engine
