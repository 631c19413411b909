// Tests the JSON Schema of scenes and recipes with Python's jsonschema: the schema and the reader
// accept and refuse the same texts.

#include <cstdlib>
#include <string>
#include <vector>

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/json_schema.h>
#include <ensonify/engine/scene/reader.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/paths.h"
#include "support/program.h"
#include "support/temporary_folder.h"

using namespace ensonify;
using namespace ensonify::tests;

TEST_CASE(
    "Editors' JSON Schema takes the shipped scenes and recipes, and refuses what run refuses") {
  const TemporaryFolder folder;
  for (const bool recipe : {false, true}) {
    std::vector<std::string> arguments{"schema", "--json-schema"};
    if (recipe) arguments.emplace_back("--recipe");
    const Outcome outcome = run_program(folder.path(), arguments);
    REQUIRE(outcome.code == 0);
    CHECK(outcome.out == engine::json_schema(recipe));
    write_text(folder / (recipe ? "recipe.json" : "scene.json"), outcome.out);
  }
  write_text(folder / "every_key.toml", engine::dump_scene({}));
  const std::vector<std::pair<std::string, std::string>> faults{
      {"unknown key", "sede = 1"},
      {"unknown table", "[see]\ntemperature_c = 4"},
      {"number too large", "[sea]\ntemperature_c = 41"},
      {"number too small", "[sonar.a]\nvertical_beamwidth_deg = -1"},
      {"text for a number", "[track]\nspeed_mps = \"2\""},
      {"fraction for a whole number", "[track]\npings = 2.5"},
      {"unknown word", "[seafloor]\nkind = \"fractals\""},
      {"three coordinates", "[[objects]]\nshape = \"cable\"\npath = [[0, 0, 0], [1, 1, 1]]"},
      {"a sonar's name", "[sonar.\"a b\"]\nrange_m = 30"},
      {"a table for a value", "[sea]\ntemperature_c = { uniform = [1, 2] }"}};
  const std::vector<std::string> right{"[sea]\ntemperature_c = 40",
                                       "[sonar.a]\nsides = \"port\"\n[sonar.b]\nrange_m = 20",
                                       "[run]\nintersector = \"fan-scan\""};
  std::size_t number = 0;
  for (const auto& [why, text] : faults) {
    CAPTURE(why);
    const std::string scene = "version = 1\n" + text + "\n";
    CHECK_THROWS_AS(engine::parse_scene(scene, "s.toml"), engine::SceneError);
    write_text(folder / ("fault" + std::to_string(number++) + ".toml"), scene);
  }
  for (const std::string& text : right) {
    CAPTURE(text);
    const std::string scene = "version = 1\n" + text + "\n";
    CHECK_NOTHROW(engine::parse_scene(scene, "s.toml"));
    write_text(folder / ("right" + std::to_string(number++) + ".toml"), scene);
  }
  write_text(folder / "check.py", R"py(
import glob, json, sys
try:
    import jsonschema, tomllib
except ImportError:
    sys.exit(77)

schemas = {name: json.load(open(name + ".json")) for name in ("scene", "recipe")}
for schema in schemas.values():
    jsonschema.Draft7Validator.check_schema(schema)

def faults(path):
    with open(path, "rb") as file:
        document = tomllib.load(file)
    schema = schemas["recipe" if "dataset" in document else "scene"]
    return [error.message for error in jsonschema.Draft7Validator(schema).iter_errors(document)]

shipped = sorted(glob.glob(sys.argv[1] + "/**/*.toml", recursive=True))
assert len(shipped) > 10
assert any("dataset" in open(path).read() for path in shipped)
for path in shipped + glob.glob("right*.toml") + ["every_key.toml"]:
    assert not faults(path), (path, faults(path))
for path in glob.glob("fault*.toml"):
    assert faults(path), path + " passes: " + open(path).read()
)py");
  const int status =
      std::system(("cd '" + folder.path().string() + "' && /usr/bin/python3 check.py '" +
                   (source_folder() / "scenes").string() + "' 2> log")
                      .c_str());
  INFO(read_text(folder / "log"));
  if (status == 77 << 8)
    WARN("skipped: no jsonschema here");
  else
    CHECK(status == 0);
}

TEST_CASE("Editors' JSON Schema has whole limits of whole numbers, none beyond 64 bits") {
  // 9223372036854775807 is the largest whole number of TOML; as a double it would be one larger.
  for (const bool recipe : {false, true}) {
    const std::string schema = engine::json_schema(recipe);
    CHECK(schema.find("\"maximum\": 9223372036854775807") != std::string::npos);
    CHECK(schema.find("9.22") == std::string::npos);
  }
}

TEST_CASE("The table of keys states what run takes, and rounds degrees") {
  const TemporaryFolder folder;
  const std::string scene = run_program(folder.path(), {"schema"}).out;
  const std::string recipe = run_program(folder.path(), {"dump-default", "generate"}).out;
  const auto line_of = [](const std::string& text, const std::string& begin) {
    const std::size_t at = text.find("\n" + begin);
    REQUIRE(at != text.npos);
    return text.substr(at + 1, text.find('\n', at + 1) - at - 1);
  };
  CHECK(scene.find("every key has a default") == scene.npos);
  CHECK(line_of(scene, "| `png_bits`").ends_with("| 8 or 16 | 8 |"));
  CHECK(line_of(scene, "| `start_time`").ends_with("| a time, \"2025-06-01T12:00:00Z\" | unset |"));
  CHECK(line_of(scene, "| `bend_deg`").ends_with("| 8 |"));
  CHECK(line_of(scene, "| `dip_deg`").ends_with("| 2.865 |"));
  CHECK(line_of(recipe, "# Its date").ends_with("(a date, YYYY-MM-DD)"));
  CHECK(line_of(recipe, "# Its page").ends_with("(an address)"));
  // A file of all defaults has their exact values.
  CHECK(engine::dump_scene({}).find("dip_deg = 2.864788975654116") != std::string::npos);
}
