#include <ensonify/engine/run/whole_run.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/run/join_pictures.h>
#include <ensonify/engine/run/join_targets.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

PartRecord sum_of_parts(const fs::path& folder, const RunParts& parts, std::size_t first,
                        std::size_t end) {
  PartRecord sum{.counts = {{"pings", 0}}};
  for (std::size_t part = first; part < end; ++part) {
    const std::string its = parts.folder(part);
    PartRecord record = read_part_json(folder / its / "part.json");
    for (FileRecord& file : record.files) file.name = its + "/" + file.name;
    if (part == first)
      sum = std::move(record);
    else
      sum += record;
  }
  return sum;
}

std::vector<std::string> warnings_of(const PartRecord& run, const std::string& intersector) {
  std::vector<std::string> warnings;
  if (!run.verification.empty()) {
    AgreementCounts found;
    for_each_count(
        found, [&](const char* name, std::uint64_t& count) { count = run.verification.at(name); });
    for (const Limit& limit : limits(RaySource::scene, intersector_kind(intersector).precision))
      if (exceeds(limit, found))
        warnings.push_back(fmt::format(
            "of {} rays that were verified {} are of the class '{}', more than rounding "
            "explains (at most {:.0f})",
            found.rays, limit.of(found), limit.name, std::floor(most_allowed(limit, found.rays))));
  }
  if (run.pings_over_hole > 0)
    warnings.push_back(fmt::format(
        "{} of {} pings have no bed straight below (a hole in the seafloor); their altitude is "
        "empty",
        run.pings_over_hole, run.pings.count));
  return warnings;
}

std::map<std::string, std::uint64_t> counts_of(const PartRecord& run) {
  std::map<std::string, std::uint64_t> counts = run.counts;
  counts.insert(run.seafloor.begin(), run.seafloor.end());
  return counts;
}

std::string manifest_of(const PartRecord& run, const RunPlan& plan,
                        std::vector<ManifestPart> parts) {
  std::map<std::string, std::uint64_t> counts = counts_of(run);
  counts["warnings"] = run.warnings.size();
  return manifest_json({.scene_toml = plan.scene_toml,
                        .seed = plan.seed,
                        .surface = run.surface,
                        .intersector = plan.intersector,
                        .code_path = run.code_path,
                        .reference = plan.reference,
                        .classes = run.names.classes,
                        .materials = run.names.materials,
                        .counts = std::move(counts),
                        .verification = run.verification,
                        .warnings = run.warnings,
                        .parts = std::move(parts),
                        .files = run.files});
}

PartRecord finish_run(const fs::path& folder, const RunPlan& plan,
                      const std::function<void()>& waiting) {
  const RunParts& parts = plan.parts;
  PartRecord whole = sum_of_parts(folder, parts, 0, parts.count());
  std::vector<ManifestPart> listed;
  std::vector<FileRecord> files;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const std::string its = parts.folder(part);
    listed.push_back({its, parts.range(part).first, parts.range(part).count});
    files.push_back(record_of(folder, its + "/part.json"));
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
  refine::write_file(folder / "manifest.json", manifest_of(whole, plan, std::move(listed)));
  return whole;
}

bool is_run_in_parts(const fs::path& folder) { return fs::exists(plan_file(folder)); }

RunMergeReport merge_run(const fs::path& folder,
                         const std::function<bool(std::size_t done, std::size_t of)>& progress) {
  const RunPlan plan = read_plan(folder);
  const RunParts& parts = plan.parts;
  RunMergeReport report{.parts = parts.count()};
  for (std::size_t part = 0; part < parts.count(); ++part) {
    if (progress && !progress(part, parts.count())) throw Stopped("stopped on request");
    const fs::path place = folder / parts.folder(part);
    if (!fs::exists(place)) {
      report.missing.push_back(part + 1);
      continue;
    }
    const PartRecord record = read_part_json(place / "part.json");
    if (record.run_xxh128 != hash_of(plan))
      report.damaged.push_back(fmt::format("{}: it is a part of another run", place.string()));
    for (const FileRecord& file : record.files) {
      const fs::path there = place / file.name;
      if (!fs::exists(there))
        report.damaged.push_back(fmt::format("{}: the file is missing", there.string()));
      else if (xxh128_of_file(there) != file.xxh128)
        report.damaged.push_back(fmt::format("{}: its content has changed", there.string()));
    }
  }
  if (!report.missing.empty() || !report.damaged.empty()) return report;
  report.warnings = finish_run(folder, plan, [&] {
                      if (progress && !progress(parts.count(), parts.count()))
                        throw Stopped("stopped on request");
                    }).warnings;
  return report;
}

}  // namespace ensonify::engine
