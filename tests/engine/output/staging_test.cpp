#include <ensonify/engine/output/staging.h>

#include <filesystem>
#include <set>
#include <string>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

using ensonify::engine::Claim;
using ensonify::engine::StagingFolder;
using namespace ensonify::tests;
namespace fs = std::filesystem;

TEST_CASE("who claims a place removes its temporaries, and those of no other place") {
  const TemporaryFolder folder;
  for (const char* name : {".out.0.tmp", ".out.12.tmp", ".out.tif.0.tmp", "000007"})
    fs::create_directories(folder / name / "inner");
  for (const char* name : {".out.1.tmp", ".out.lock", ".000003.lock", ".hidden", "seen.0.tmp"})
    write_text(folder / name, "");
  CHECK(StagingFolder::places_with_remains(folder.path()) ==
        std::set<std::string>{"000003", "out", "out.tif"});
  {
    const auto claim = StagingFolder::try_claim(folder / "out");
    REQUIRE(claim);
    CHECK_FALSE(StagingFolder::try_claim(folder / "out"));
  }
  CHECK(names_in(folder.path()) ==
        std::set<std::string>{".000003.lock", ".hidden", ".out.tif.0.tmp", "000007", "seen.0.tmp"});
}
