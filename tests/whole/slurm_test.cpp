#include <cstdlib>

#include "support/catch.h"
#include "support/files.h"
#include "support/paths.h"
#include "support/program.h"
#include "support/tiny_recipe.h"
#include "support/tree.h"

using namespace ensonify::tests;

TEST_CASE(
    "a dataset made with Slurm is the same although a task fails, one is requeued and one loses "
    "its node",
    "[.soak]") {
  if (std::system("command -v slurmctld slurmd munged >/dev/null") != 0) {
    WARN("no Slurm (slurm-wlm, munge): skipped");
    return;
  }
  const TemporaryFolder folder;
  std::string recipe = tiny_recipe;
  recipe.replace(recipe.find("samples = 8"), 11, "samples = 24");
  recipe.replace(recipe.find("elevations = 160"), 16, "elevations = 20000");  // seconds per sample
  write_text(folder / "recipe.toml", recipe);
  REQUIRE(
      run_program(folder.path(), {"generate", "recipe.toml", "-o", "expected", "--quiet"}).code ==
      0);
  REQUIRE(run_program(folder.path(), {"merge", "expected", "--quiet"}).code == 0);
  const std::string command = "bash " + (source_folder() / "tests/whole/slurm.sh").string() + " " +
                              program_file().string() + " " +
                              (source_folder() / "scenes").string() + " " +
                              (folder / "recipe.toml").string() + " " + folder.path().string();
  REQUIRE(std::system(command.c_str()) == 0);
  CHECK(difference(tree_of(folder / "set"), tree_of(folder / "expected")) == "");
}
