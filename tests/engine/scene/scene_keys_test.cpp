// The tables of keys: help, ranges, formats, the page of the reference.

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/reader.h>

#include <set>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/parsed_scene.h"

#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/output_formats.h>

using namespace ensonify::engine;
using ensonify::tests::error_of;
using ensonify::tests::head;
using ensonify::tests::parsed;

TEST_CASE("Each output format has a key, and no two the same") {
  std::set<std::string_view> names;
  for (const OutputFormat& format : output_formats()) {
    INFO(format.name);
    CHECK(names.insert(format.name).second);
    Scene scene = parsed(head, {fmt::format("output.{}=true", format.name)});
    CHECK(scene.output.*format.wanted);
    scene.output.*format.wanted = false;
    CHECK_FALSE(parsed(dump_scene(scene)).output.*format.wanted);
  }
}

TEST_CASE("One recording for more sonars than its format holds is refused") {
  std::string text = head + "[output]\none_recording = true\n";
  for (int i = 0; i < 4; ++i) text += "[sonar.s" + std::to_string(i) + "]\n";
  CHECK(parsed(text, {"output.jsf=true"}).sonars.size() == 4);
  CHECK(
      error_of(text, {"output.xtf=true"}).find("puts 4 sonars into one file, and an XTF holds 3") !=
      std::string::npos);
}

TEST_CASE("The reference page has a row for every key") {
  const std::string page = schema_text();
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      CHECK(page.find(fmt::format("| `{}` | {} | {} |", key.name, key.help, expectation(key))) !=
            std::string::npos);
  for (const auto& key : sonar_section().keys)
    CHECK(page.find(fmt::format("| `{}` | {} |", key.name, key.help)) != std::string::npos);
}
