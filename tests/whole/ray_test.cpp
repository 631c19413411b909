#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"

using namespace ensonify::tests;

namespace {

std::vector<std::vector<double>> rows(const std::string& out) {
  std::istringstream stream(out);
  std::string line;
  std::getline(stream, line);
  REQUIRE(line == "range_m,depth_m,time_s,path_m,angle_deg,loss_db");
  std::vector<std::vector<double>> all;
  while (std::getline(stream, line)) {
    std::istringstream fields(line);
    std::vector<double>& row = all.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(std::stod(field));
    REQUIRE(row.size() == 6);
  }
  REQUIRE(!all.empty());
  return all;
}

struct Casts {
  TemporaryFolder folder;
  Casts() {
    write_text(folder / "bend.csv", "depth_m,soundspeed_mps\n0,1500.6\n100,1480.6\n");
    write_text(folder / "one.csv", "depth_m,soundspeed_mps\n20,1500\n");
  }
  Outcome ray(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "ray");
    return run_program(folder.path(), arguments);
  }
};

}  // namespace

TEST_CASE("ensonify ray ends at its range, an eigenray at its target, at the closed form's time") {
  const Casts casts;
  const Outcome ray = casts.ray({"--profile", "bend.csv", "--source-depth-m", "30", "--launch-deg",
                                 "-10", "--range-m", "500", "--bottom-depth-m", "50"});
  INFO(ray.err);
  REQUIRE(ray.code == 0);
  CHECK(ray.err.empty());
  CHECK(rows(ray.out).front() == std::vector<double>{0, 30, 0, 0, -10, 0});
  CHECK(rows(ray.out).back()[0] == Approx(500.0).epsilon(1e-12));
  double shallowest_m = 30.0, deepest_m = 30.0, time_s = -1.0;
  for (const auto& row : rows(ray.out)) {
    shallowest_m = std::min(shallowest_m, row[1]), deepest_m = std::max(deepest_m, row[1]);
    CHECK(row[2] > time_s);
    time_s = row[2];
  }
  CHECK(shallowest_m == 0.0);  // reflected there, as at the bottom
  CHECK(deepest_m == 50.0);

  const Outcome eigen = casts.ray({"--profile", "bend.csv", "--source-depth-m", "3",
                                   "--target-range-m", "60", "--target-depth-m", "25"});
  REQUIRE(eigen.code == 0);
  const std::vector<double> end = rows(eigen.out).back();
  CHECK(end[0] == Approx(60.0).margin(1e-9));
  CHECK(end[1] == Approx(25.0).margin(1e-9));
  CHECK(end[2] == Approx(42.666615e-3).margin(1e-9));
}

TEST_CASE(
    "ensonify ray in water of one speed loses 20 log r, and warns that the cast is one sample") {
  const Casts casts;
  const Outcome ray = casts.ray({"--profile", "one.csv", "--source-depth-m", "5",
                                 "--target-range-m", "300", "--target-depth-m", "405"});
  REQUIRE(ray.code == 0);
  const std::vector<double> end = rows(ray.out).back();
  CHECK(end[3] == Approx(500.0));
  CHECK(end[5] == Approx(20.0 * std::log10(500.0)));
  CHECK(ray.err.find("one.csv: the cast is one sample") != std::string::npos);
}

TEST_CASE("ensonify ray refuses wrong arguments with one message") {
  const Casts casts;
  const std::vector<std::string> cast = {"--profile", "bend.csv", "--source-depth-m", "3"};
  const auto fails = [&](std::vector<std::string> more, const std::string& with) {
    more.insert(more.begin(), cast.begin(), cast.end());
    const Outcome outcome = casts.ray(more);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.find(with) != std::string::npos);
    CHECK(std::ranges::count(outcome.err, '\n') == 1);
  };
  fails({"--target-range-m", "3000", "--target-depth-m", "3"}, "shadow zone");
  fails({"--target-range-m", "30"}, "--target-depth-m");
  fails({"--launch-deg", "5"}, "--range-m");
  fails({}, "--launch-deg with --range-m");
  fails({"--launch-deg", "90", "--range-m", "5"}, "89.999");
  fails({"--launch-deg", "5", "--range-m", "5", "--bottom-depth-m", "2"}, "--bottom-depth-m");
  fails({"--launch-deg", "89.99", "--range-m", "50000", "--bottom-depth-m", "3.1"}, "flatter");
}
