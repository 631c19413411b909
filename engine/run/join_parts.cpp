#include <algorithm>
#include <utility>

#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run/joined_files.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

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
  std::vector<FileRecord> files;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const std::string its = parts.folder(part);
    files.push_back(record_of(folder, its + "/" + part_json_name));
  }
  for (const auto& [sonar, visibility] : whole.object_visibility) {
    const std::string picture = sonar + ".png", targets = sonar + "_targets.json";
    {
      const Claim claim = StagingFolder::wait_for(folder / picture, waiting);
      join_pictures(folder, parts, parts.count(), sonar);
    }
    files.push_back(record_of(folder, picture));
    if (std::ranges::none_of(whole.files, [](const FileRecord& file) {
          return file.name.ends_with("_targets.json");
        }))
      continue;
    const Claim claim = StagingFolder::wait_for(folder / targets, waiting);
    refine::write_file(folder / targets,
                       join_targets(folder, parts, sonar, visibility, whole.target_sights[sonar]));
    files.push_back(record_of(folder, targets));
  }
  files.push_back(record_of(folder, plan_file(folder).filename().string()));
  whole.files.insert(whole.files.end(), files.begin(), files.end());
  std::ranges::sort(whole.files, {}, &FileRecord::name);
  const std::vector<std::string> more = warnings_of(whole, plan.intersector);
  whole.warnings.insert(whole.warnings.end(), more.begin(), more.end());
  const Claim claim = StagingFolder::wait_for(folder / "manifest.json", waiting);
  refine::write_file(folder / "manifest.json", manifest_json(plan, whole));
  return whole;
}

}  // namespace ensonify::engine
