// The documents: every relative link names a file that exists, and a heading in it.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "support/catch.h"
#include "support/paths.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

/// A Markdown file without its code: fenced blocks and code in a line become nothing.
struct Page {
  explicit Page(const fs::path& file) {
    static const std::regex code_in_line("`[^`]*`");
    std::ifstream in(file);
    std::string line;
    bool in_block = false;
    while (std::getline(in, line)) {
      if (line.starts_with("```")) {
        in_block = !in_block;
        line.clear();
      }
      if (in_block) line.clear();
      const std::size_t level = line.find_first_not_of('#');
      if (level != 0 && level != line.npos && line[level] == ' ')
        headings.push_back(anchor_of(std::string_view(line).substr(level + 1)));
      lines.push_back(std::regex_replace(line, code_in_line, ""));
    }
  }
  /// As GitHub makes an anchor of a heading: lower case, without punctuation, - for each space.
  static std::string anchor_of(std::string_view heading) {
    std::string anchor;
    for (const char c : heading) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == ' ')
        anchor += '-';
      else if (byte >= 0x80 || std::isalnum(byte) != 0 || c == '-' || c == '_')
        anchor += static_cast<char>(std::tolower(byte));
    }
    return anchor;
  }
  std::vector<std::string> lines, headings;
};

/// What is wrong with a link of a file; empty: nothing, or it leads out of the repository.
std::string fault_of(const fs::path& file, const std::string& link) {
  static const std::regex scheme("[A-Za-z][A-Za-z0-9+.-]*:.*");
  if (std::regex_match(link, scheme)) return "";
  const std::size_t hash = link.find('#');
  const std::string path = link.substr(0, hash);
  const fs::path to = path.empty() ? file : file.parent_path() / path;
  if (!fs::exists(to)) return "there is no " + path;
  if (hash == link.npos || to.extension() != ".md") return "";
  const std::string anchor = link.substr(hash + 1);
  const Page page(to);
  return std::ranges::find(page.headings, anchor) != page.headings.end()
             ? ""
             : "there is no heading #" + anchor;
}

/// Every dead link of a tree's documents, as file:line: what.
std::vector<std::string> dead_links(const fs::path& tree) {
  static const std::regex link(R"(\]\(([^)\s]+)\))");
  std::vector<fs::path> files;
  const auto take = [&](const fs::path& file) {
    if (file.extension() == ".md") files.push_back(file);
  };
  for (const fs::directory_entry& entry : fs::directory_iterator(tree)) take(entry.path());
  for (const char* folder : {"bench", "doc", "engine", "refine", "scatter", "scenes", "tests"})
    if (fs::is_directory(tree / folder))
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(tree / folder))
        take(entry.path());
  std::ranges::sort(files);

  std::vector<std::string> dead;
  for (const fs::path& file : files) {
    const Page page(file);
    for (std::size_t i = 0; i < page.lines.size(); ++i) {
      const std::string& line = page.lines[i];
      for (std::sregex_iterator found(line.begin(), line.end(), link), end; found != end; ++found)
        if (const std::string fault = fault_of(file, (*found)[1]); !fault.empty())
          dead.push_back(file.lexically_relative(tree).string() + ":" + std::to_string(i + 1) +
                         ": " + fault);
    }
  }
  return dead;
}

}  // namespace

TEST_CASE("every relative link of the documents names a file that exists, and a heading in it") {
  REQUIRE(fs::is_regular_file(ensonify::tests::source_folder() / "README.md"));
  for (const std::string& dead : dead_links(ensonify::tests::source_folder())) FAIL_CHECK(dead);
}

TEST_CASE("dead links of the documents are found, and nothing else") {
  const ensonify::tests::TemporaryFolder tree;
  fs::create_directories(tree.path() / "doc");
  std::ofstream(tree.path() / "README.md")
      << "# Top\n[a](doc/a.md) [b](doc/b.md) [c](doc/a.md#what-is-exact)\n"
         "[d](doc/a.md#gone) [`e`](https://example.org/x.md) ![f](doc/f.png) [g](#top)\n"
         "```\n[h](h.md)\n```\n`[i](i.md)` [j](doc)\n";
  std::ofstream(tree.path() / "doc" / "a.md")
      << "## What is `exact`?\n[up](../README.md#nowhere)\n";
  CHECK(dead_links(tree.path()) ==
        std::vector<std::string>{
            "README.md:2: there is no doc/b.md", "README.md:3: there is no heading #gone",
            "README.md:3: there is no doc/f.png", "doc/a.md:2: there is no heading #nowhere"});
}
