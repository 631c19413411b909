#include <stdexcept>

#include <ensonify/engine/run/joined_files.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/run_plan.h>

#include "fuzz/fuzz.h"

#include "support/files.h"

using namespace ensonify;

// A run in parts: run.json, then, each after a zero byte, part.json and the targets of a part.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  const std::vector<std::string> texts = tests::texts(data, size, 3);
  std::filesystem::create_directories(folder / "part_0001");
  const std::filesystem::path record = folder / "part_0001/part.json";
  tests::write_text(folder / "run.json", texts[0]);
  tests::write_text(record, texts[1]);
  tests::write_text(folder / "part_0001/left-right_0001_targets.json", texts[2]);
  try {
    engine::PartRecord part = engine::read_part_json(record);
    part += engine::PartRecord(part);
    engine::part_json(part);
    const engine::RunPlan plan = engine::read_plan(folder.path());
    engine::differences(plan, plan);
    engine::join_targets(folder.path(), plan.parts, "left-right",
                         part.object_visibility["left-right"], part.target_sights["left-right"]);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
