#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/paths.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

// The rooms (folders) of engine in order; each may include those before it. A file that combines
// the inner rooms of its folder is a room by itself, for example "trace/back_ends".
constexpr std::array rooms{"base",
                           "simd",
                           "trace",
                           "trace/exact",
                           "trace/embree",
                           "trace/fan_scan",
                           "trace/grid_scan",
                           "trace/face_sources",
                           "trace/refraction",
                           "trace/fan_tracer",
                           "trace/back_ends",
                           "trace/check",
                           "seafloor",
                           "seafloor/bed",
                           "seafloor/layers",
                           "seafloor/objects",
                           "seafloor/seafloor_options",
                           "seafloor/base",
                           "seafloor/seafloor_memory",
                           "seafloor/add_objects",
                           "seafloor/analysis",
                           "seafloor/seafloor_in_tiles",
                           "seafloor/make_seafloor",
                           "sonar/vehicle",
                           "sonar/instrument",
                           "sonar/echo",
                           "sonar/reception",
                           "image",
                           "output",
                           "recording",
                           "scene",
                           "scene/keys",
                           "scene/tables",
                           "scene/checks",
                           "scene/track_poses",
                           "scene/scene_paths",
                           "scene/reader",
                           "scene/dump",
                           "scene/json_schema",
                           "preparation",
                           "moving_object",
                           "stage_times",
                           "simulate",
                           "session_keys",
                           "run",
                           "mosaic",
                           "comparison",
                           "imitation",
                           "dataset",
                           "live",
                           "app",
                           "python"};

// The floor and room of a file. Floor scatter: "scatter/decibel.h". Floor engine: "engine/run.h" is
// in the room run, "engine/trace/ray.h" in trace, "engine/trace/exact/pluecker.h" in trace/exact.
struct FloorAndRoom {
  explicit FloorAndRoom(const fs::path& file) : floor(file.begin()->string()) {
    if (floor != "engine") return;
    const fs::path inside = file.lexically_relative("engine");
    std::string by_itself = (inside.parent_path() / inside.stem()).string();
    // What class Simulator is made of.
    if (by_itself.starts_with("simulator/")) by_itself = "simulate";
    const bool is_room = std::ranges::find(rooms, by_itself) != rooms.end();
    room = is_room || inside.parent_path().empty() ? by_itself : inside.parent_path().string();
  }
  bool is_library() const {
    return floor != "bench" && room != "live" && room != "app" && room != "python";
  }
  std::string floor, room;
};

std::string wrong_include(const fs::path& file, const std::string& name, bool quoted) {
  const FloorAndRoom from(file);
  if (name.find("../") != std::string::npos) return "../ in an include";
  if (quoted) {
    const bool private_header = !from.is_library() && name.find('/') == std::string::npos;
    return private_header ? "" : "a header of our own is spelled <ensonify/...>";
  }
  if (name.starts_with("ensonify/")) {
    const FloorAndRoom to(name.substr(std::string("ensonify/").size()));
    if (from.floor == "bench") return "";
    if (from.floor != "engine" || to.floor == "bench")
      return to.floor == from.floor ? "" : from.floor + " includes " + to.floor;
    if (to.floor != "engine") return "";
    const auto from_room = std::ranges::find(rooms, from.room);
    const auto to_room = std::ranges::find(rooms, to.room);
    if (from_room == rooms.end()) return "the room " + from.room + " has no place in the order";
    return to_room <= from_room ? "" : "the room " + from.room + " includes " + to.room;
  }
  const bool standard = name.find_first_of("/.") == std::string::npos;
  // Parts of sources, NAME-inl.h, are not installed, and no other header includes them.
  const bool header = file.extension() == ".h" && !file.stem().string().ends_with("-inl");
  if (from.is_library() && header && !standard && !name.starts_with("Eigen/"))
    return "a header shows more than std and Eigen: " + name;
  return "";
}

std::string wrong_line(const fs::path& file, const std::string& line) {
  static const std::regex text(R"("([^"\\]|\\.)*"|//.*)");
  static const std::regex call(
      R"(\b(cout|cerr|clog|fmt::print|(f?printf|f?puts|_?exit|quick_exit|abort|terminate)\s*\())");
  std::smatch found;
  const std::string code = std::regex_replace(line, text, "");
  if (FloorAndRoom(file).is_library() && std::regex_search(code, found, call))
    return "a library prints or ends the program: " + found.str(1);
  const bool door = file == "engine/base/untrusted.h" || file == "engine/scene/keys/toml_value.cpp";
  const bool parses = std::ranges::any_of(
      std::array{"toml::parse(", "son::parse(", "son::accept("},
      [&](const char* parser) { return code.find(parser) != std::string::npos; });
  if (FloorAndRoom(file).floor == "engine" && !door && parses)
    return "text is parsed without a limit of its depth: json_of() and parse_toml() have it";
  // A fork() leaves the locks of GDAL as they are, too.
  static const std::regex constant(R"(^ +static (const|auto) (?!bool registered)[^(]*(=|\{))");
  if (FloorAndRoom(file).is_library() && std::regex_search(code, constant))
    return "a constant whose making a child of fork() may wait for: use made_once()";
  return "";
}

/// Every breach of the layering in a tree, as "file:line: what".
std::vector<std::string> breaches(const fs::path& tree) {
  static const std::regex include(R"(^\s*#\s*include\s*([<"])([^>"]*).*)");
  std::vector<std::string> all;
  for (const char* floor : {"scatter", "refine", "engine", "bench"}) {
    if (!fs::is_directory(tree / floor)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(tree / floor)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      const fs::path file = entry.path().lexically_relative(tree);
      std::ifstream in(entry.path());
      std::string line;
      for (int number = 1; std::getline(in, line); ++number) {
        std::smatch found;
        const std::string what = std::regex_match(line, found, include)
                                     ? wrong_include(file, found[2], found[1] == "\"")
                                     : wrong_line(file, line);
        if (!what.empty())
          all.push_back(file.string() + ":" + std::to_string(number) + ": " + what);
      }
    }
  }
  std::ranges::sort(all);
  return all;
}

}  // namespace

TEST_CASE("the floors hold: includes go down and libraries are quiet") {
  REQUIRE(fs::is_regular_file(ensonify::tests::source_folder() / "engine/simulate.h"));
  for (const std::string& breach : breaches(ensonify::tests::source_folder())) FAIL_CHECK(breach);
}

TEST_CASE("the floors hold: planted breaches are found") {
  struct Planted {
    std::string file, line, what;  // what: the expected fault; empty: none
  };
  const std::vector<Planted> planted{
      {"scatter/a.cpp", "#include <ensonify/refine/b.h>", "scatter includes refine"},
      {"refine/a.cpp", "#include <ensonify/engine/run.h>", "refine includes engine"},
      {"engine/trace/a.h", "#include <ensonify/engine/sonar/echo/b.h>",
       "the room trace includes sonar/echo"},
      {"engine/scene/a.h", " # include <ensonify/engine/run.h>", "the room scene includes run"},
      {"engine/base/random.cpp", "#include <ensonify/engine/trace/ray.h>",
       "the room base includes trace"},
      {"engine/trace/b.cpp", "#include <ensonify/engine/attic/b.h>",
       "the room trace includes attic"},
      {"engine/trace/a.cpp", "#include <ensonify/engine/trace/exact/b.h>",
       "the room trace includes trace/exact"},
      {"engine/trace/exact/a.cpp", "#include <ensonify/engine/trace/back_ends.h>",
       "the room trace/exact includes trace/back_ends"},
      {"engine/attic/a.h", "#include <ensonify/engine/attic/b.h>",
       "the room attic has no place in the order"},
      {"engine/run.cpp", "#include <ensonify/bench/b.h>", "engine includes bench"},
      {"engine/app/a.cpp", "#include \"../run.h\"", "../ in an include"},
      {"engine/image/a.cpp", "#include \"b.h\"", "a header of our own is spelled <ensonify/...>"},
      {"engine/app/b.cpp", "#include \"trace/b.h\"",
       "a header of our own is spelled <ensonify/...>"},
      {"engine/output/a.h", "#include <png.h>", "a header shows more than std and Eigen: png.h"},
      {"refine/a.h", "#include <tbb/task_arena.h>",
       "a header shows more than std and Eigen: tbb/task_arena.h"},
      {"scatter/b.cpp", "  std::cerr << 1;", "a library prints or ends the program: cerr"},
      {"refine/b.cpp", "  std::printf(\"%d\", 1);  // exit(2)",
       "a library prints or ends the program: printf("},
      {"engine/simulate.cpp", "  if (bad) std::abort();",
       "a library prints or ends the program: abort("},
      {"engine/app/e.cpp", "  const auto json = nlohmann::json::parse(text);",
       "text is parsed without a limit of its depth: json_of() and parse_toml() have it"},
      {"engine/scene/b.cpp", "  return toml::parse(text);",
       "text is parsed without a limit of its depth: json_of() and parse_toml() have it"},
      {"refine/c.cpp", "  static const std::vector<int> all = {1};",
       "a constant whose making a child of fork() may wait for: use made_once()"},

      {"engine/run.h", "#include <ensonify/engine/simulate.h>", ""},
      {"engine/trace/back_ends.cpp", "#include <ensonify/engine/trace/exact/b.h>", ""},
      {"engine/sonar/echo/a.cpp", "#include <ensonify/scatter/decibel.h>", ""},
      {"engine/trace/c.h", "#include <Eigen/Core>", ""},
      {"engine/trace/d.h", "#include <vector>", ""},
      {"engine/trace/embree/d.cpp", "#include <embree3/rtcore.h>", ""},
      {"engine/trace/embree/d-inl.h", "#include <embree3/rtcore.h>", ""},
      {"engine/app/c.cpp", "#include \"arguments.h\"", ""},
      {"engine/app/d.cpp", "  std::cout << 1;", ""},
      {"engine/base/untrusted.h", "    return Json::parse(text);", ""},
      {"bench/b.cpp", "  return nlohmann::json::parse(text);", ""},
      {"refine/d.cpp", "  static constexpr int one = 1;", ""},
      {"bench/a.cpp", "#include <ensonify/engine/trace/ray.h>", ""},
      {"scatter/c.cpp", "  std::snprintf(text, 9, \"exit(1)\");  // std::cout, abort()", ""},
  };
  const ensonify::tests::TemporaryFolder tree;
  std::vector<std::string> expected;
  for (const Planted& p : planted) {
    fs::create_directories((tree.path() / p.file).parent_path());
    std::ofstream(tree.path() / p.file) << "\n" << p.line << "\n";
    if (!p.what.empty()) expected.push_back(p.file + ":2: " + p.what);
  }
  std::ranges::sort(expected);
  CHECK(breaches(tree.path()) == expected);
}

namespace {

/// The types that a tree defines at the top of its floors' namespaces, outside unnamed ones, as
/// "floor::Name", with their files. Two of one name would be one type to the linker.
std::map<std::string, std::set<std::string>> types_of(const fs::path& tree) {
  static const std::regex definition(
      R"(^(?:struct|class|enum class|enum)\s+(\w+)\b(?!::)[^;()]*(\{.*|,)?$)");
  std::map<std::string, std::set<std::string>> types;
  for (const char* floor : {"scatter", "refine", "engine"}) {
    if (!fs::is_directory(tree / floor)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(tree / floor)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      bool unnamed = false;
      for (std::string line; std::getline(in, line);) {
        if (line == "namespace {") unnamed = true;
        if (line == "}  // namespace") unnamed = false;
        std::smatch found;
        if (!unnamed && std::regex_match(line, found, definition))
          types[std::string(floor) + "::" + found.str(1)].insert(
              entry.path().lexically_relative(tree).string());
      }
    }
  }
  return types;
}

}  // namespace

TEST_CASE("the table of rooms in doc/architecture.md has the rooms in their order") {
  std::ifstream in(ensonify::tests::source_folder() / "doc/architecture.md");
  std::vector<std::string> described;
  bool in_table = false;
  for (std::string line; std::getline(in, line);) {
    in_table = line.starts_with("| room of `engine` |") || (in_table && line.starts_with("|"));
    if (!in_table || line.starts_with("| room of")) continue;
    const std::string cell = line.substr(0, line.find('|', 1));
    static const std::regex name("`([^`]+)`");
    for (std::sregex_iterator found(cell.begin(), cell.end(), name), end; found != end; ++found)
      if ((*found)[1] != "simulator") described.push_back((*found)[1]);  // what simulate is made of
  }
  CHECK(described == std::vector<std::string>(rooms.begin(), rooms.end()));
}

TEST_CASE("files are opened for reading by the one door, FileReader") {
  // What these open was not named by a user and is not in a folder that is read back: files of the
  // system, locks, and files that they write.
  const std::set<std::string> others{
      "engine/app/program.cpp", "engine/base/memory.cpp",  "engine/output/staging.cpp",
      "refine/atomic_file.cpp", "refine/height_tiles.cpp", "refine/progressive_mesh_file.cpp",
      "refine/read_file.cpp"};
  static const std::regex opens(R"(\bifstream\b|\bfopen\(|(^|[^\w>])::open\(|read_open_filename)");
  std::set<std::string> found;
  const fs::path source = ensonify::tests::source_folder();
  for (const char* const floor : {"scatter", "refine", "engine"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(source / floor)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cpp" && extension != ".h") continue;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);)
        if (std::regex_search(line, opens))
          found.insert(entry.path().lexically_relative(source).string());
    }
  CHECK(found == others);
}

TEST_CASE("no two types of a floor have one name") {
  for (const auto& [name, files] : types_of(ensonify::tests::source_folder())) {
    CAPTURE(name, files);
    // The inner namespaces of these are not known here.
    const bool in_app_or_live = std::ranges::any_of(files, [](const std::string& file) {
      return file.starts_with("engine/app/") || file.starts_with("engine/live/");
    });
    CHECK((files.size() == 1 || in_app_or_live));
  }
  const ensonify::tests::TemporaryFolder tree;
  fs::create_directories(tree.path() / "engine");
  std::ofstream(tree.path() / "engine/a.h") << "struct One;\nstruct Two {\n};\nstruct Three {};\n";
  std::ofstream(tree.path() / "engine/b.cpp")
      << "struct Two final : Base {\n};\nnamespace {\nstruct Three {\n};\n}  // namespace\n";
  const auto types = types_of(tree.path());
  CHECK(types.size() == 2);
  CHECK(types.at("engine::Two").size() == 2);
  CHECK(types.at("engine::Three").size() == 1);
}
