// The numbers of scatter/levels.md are what the models give.

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/paths.h"

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>

using namespace ensonify;
using namespace ensonify::scatter;

namespace {

/// The cells of a row of a table in Markdown.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream row(line.substr(1));
  for (std::string cell; std::getline(row, cell, '|');) {
    const std::size_t first = cell.find_first_not_of(' ');
    if (first != cell.npos)
      cells.push_back(cell.substr(first, cell.find_last_not_of(' ') - first + 1));
  }
  return cells;
}

}  // namespace

TEST_CASE("the page of levels has the strengths of the models, and the bound") {
  std::ifstream page(tests::source_folder() / "scatter/levels.md");
  std::vector<double> angles_deg;
  int rows = 0;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("|") || line.starts_with("|---")) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells[0] == "sediment") {
      for (std::size_t i = 3; i < cells.size(); ++i) angles_deg.push_back(std::stod(cells[i]));
      continue;
    }
    if (angles_deg.empty()) continue;  // another table
    CAPTURE(line);
    REQUIRE(cells.size() == 3 + angles_deg.size());
    for (std::size_t i = 0; i < angles_deg.size(); ++i) {
      const double grazing_rad = angles_deg[i] * std::numbers::pi / 180.0;
      const double sigma =
          cells[0] == "energy bound"
              ? diffuse_bound(grazing_rad)
              : Bottom(sediment_named(cells[0]), 1e3 * std::stod(cells[2]), 1500.0, cells[1])
                    .cross_section(grazing_rad);
      CHECK(std::abs(to_db(sigma) - std::stod(cells[3 + i])) < 0.051);
    }
    ++rows;
  }
  CHECK(rows > 60);
}
