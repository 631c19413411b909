#include <cmath>
#include <map>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"

using namespace ensonify::tests;

namespace {

using NamedFields = std::map<std::string, std::string>;

/// The rows of a CSV, each by column name.
std::vector<NamedFields> rows_by_name(const std::string& text) {
  const auto fields_of = [](const std::string& line) {
    std::vector<std::string> fields(1);
    for (const char c : line)
      if (c == ',')
        fields.emplace_back();
      else
        fields.back() += c;
    return fields;
  };
  std::istringstream stream(text);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> names = fields_of(line);
  std::vector<NamedFields> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> fields = fields_of(line);
    REQUIRE(fields.size() == names.size());
    NamedFields& row = rows.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields[i];
  }
  return rows;
}

Outcome backscatter(const std::string& arguments) {
  std::vector<std::string> words = {"backscatter"};
  std::istringstream stream(arguments);
  for (std::string word; stream >> word;) words.push_back(word);
  const TemporaryFolder folder;
  return run_program(folder.path(), words);
}

std::vector<NamedFields> answer(const std::string& arguments) {
  const Outcome outcome = backscatter(arguments);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return rows_by_name(outcome.out);
}

const std::string at_30_khz = "--frequency-hz 30000 --sound-speed-mps 1528 ";

}  // namespace

TEST_CASE("backscatter prints the terms of the bottom model") {
  const Outcome outcome = backscatter(at_30_khz + "--sediment medium_sand --angles-deg 0,10,60,90");
  REQUIRE(outcome.code == 0);
  CHECK(outcome.err.empty());
  CHECK(
      outcome.out.starts_with("grazing_deg,strength_db,roughness,volume,kirchhoff,composite,"
                              "large_roughness,reflection_loss_db,bound_db\n"));
  const std::vector<NamedFields> rows = rows_by_name(outcome.out);
  REQUIRE(rows.size() == 4);
  CHECK(std::stod(rows[3].at("bound_db")) == Approx(-4.9715));  // 10 log10(1 / pi)
  CHECK(std::stod(rows[1].at("strength_db")) == Approx(-35.4).margin(0.1));
  CHECK(std::stod(rows[1].at("kirchhoff")) == 0.0);
  CHECK(10.0 * std::log10(std::stod(rows[2].at("kirchhoff"))) == Approx(-24.54).margin(0.006));
  CHECK(10.0 * std::log10(std::stod(rows[2].at("volume"))) == Approx(-24.04).margin(0.006));
  CHECK(std::stod(rows[3].at("reflection_loss_db")) == Approx(-20.0 * std::log10(0.369775)));
  for (const NamedFields& row : rows)
    CHECK(std::stod(row.at("strength_db")) ==
          Approx(10.0 * std::log10(std::stod(row.at("roughness")) + std::stod(row.at("volume")))));
}

TEST_CASE("a seabed is given by name, grain size or parameters, and parameters override") {
  const std::string angles = " --angles-deg 5,30,85";
  const auto strengths = [&](const std::string& seabed) {
    std::vector<std::string> out;
    for (const NamedFields& row : answer(at_30_khz + seabed + angles))
      out.push_back(row.at("strength_db"));
    return out;
  };
  const auto named = strengths("--sediment medium-sand");
  CHECK(named == strengths("--mean-grain-size-phi 1.5"));
  const TemporaryFolder folder;
  const NamedFields sand = rows_by_name(
      run_program(folder.path(), {"sediments", "--mean-grain-size-phi", "1.5"}).out)[0];
  CHECK(named == strengths("--density-ratio " + sand.at("density_ratio") + " --sound-speed-ratio " +
                           sand.at("sound_speed_ratio") + " --loss " + sand.at("loss") +
                           " --volume " + sand.at("volume") + " --exponent " + sand.at("exponent") +
                           " --strength-cm4 " + sand.at("strength_cm4")));
  const auto quiet = strengths("--sediment medium_sand --volume 0");
  CHECK(quiet != named);
  CHECK(quiet == strengths("--mean-grain-size-phi 1.5 --volume 0"));
}

TEST_CASE("the other models fill only the columns of their terms") {
  for (const NamedFields& row :
       answer(at_30_khz + "--sediment clay --model lambert --angles-deg 30,90")) {
    CHECK(std::stod(row.at("strength_db")) ==
          Approx(std::stod(row.at("grazing_deg")) == 90.0 ? -27.0 : -33.0206));
    CHECK(std::stod(row.at("volume")) == 0.0);
  }
  const std::vector<NamedFields> slope = answer(at_30_khz + "--sediment clay --model small-slope");
  CHECK(slope.size() == 90);
  CHECK(std::stod(slope[44].at("roughness")) > 0.0);
  CHECK(std::stod(slope[44].at("volume")) > 0.0);
  CHECK(std::stod(slope[89].at("kirchhoff")) == 0.0);
  CHECK(backscatter(at_30_khz + "--sediment clay --model small_slope").out ==
        backscatter(at_30_khz + "--sediment clay --model small-slope").out);
}

TEST_CASE("a frequency outside the model's range gives one warning on stderr") {
  const Outcome rock = backscatter(
      "--frequency-hz 400000 --sound-speed-mps 1500 --sediment rock --angles-deg 5,6,7");
  CHECK(rock.code == 0);
  CHECK(rock.err.find("400 kHz") != std::string::npos);
  CHECK(rock.err.find("expected within 10 dB") != std::string::npos);
  CHECK(std::count(rock.err.begin(), rock.err.end(), '\n') == 1);
}

TEST_CASE("rock has its measured strength, and the handbook's by its own name or by parameters") {
  const std::string at_20 =
      "--frequency-hz 100000 --sound-speed-mps 1500 --angles-deg 20 --sediment ";
  const auto strength = [&](const std::string& sediment) {
    return std::stod(answer(at_20 + sediment)[0].at("strength_db"));
  };
  CHECK(strength("rock") == Approx(-29.5));
  CHECK(strength("rough_rock") == Approx(-25.0));
  CHECK(strength("handbook_rock") == Approx(-12.0).margin(0.1));
  CHECK(strength("handbook_rough_rock") == Approx(-6.2).margin(0.1));
  CHECK(strength("rock --volume 0.002") == strength("handbook_rock"));
  const Outcome rough = backscatter(at_20 + "handbook_rough_rock");
  CHECK(rough.err.find("stronger than any opaque surface") != std::string::npos);
  CHECK(backscatter(at_20 + "rough_rock").err.empty());
}

TEST_CASE("backscatter prints any material: of a scene by measurement, or by its name") {
  const TemporaryFolder folder;
  write_text(folder / "s.csv", "grazing_deg,strength_db\n10,-30\n40,-20\n");
  write_text(folder / "s.toml",
             "version = 1\n[material.table]\nmodel = \"table\"\ntable = \"s.csv\"\n"
             "[material.gravel-bed]\nmodel = \"gsab\"\ngsab_lambert_db = -20\n"
             "gsab_specular_db = -10\ngsab_specular_width_deg = 5\n"
             "[material.slope]\nlike = \"rock\"\nmodel = \"small-slope\"\n");
  const auto printed = [&](const std::string& arguments) {
    std::vector<std::string> words = {"backscatter", "--frequency-hz", "400000",
                                      "--sound-speed-mps", "1500"};
    std::istringstream stream(arguments);
    for (std::string word; stream >> word;) words.push_back(word);
    return run_program(folder.path(), words);
  };
  const Outcome table = printed("--scene s.toml --material table --angles-deg 10,40");
  INFO(table.err);
  REQUIRE(table.code == 0);
  const std::vector<NamedFields> rows = rows_by_name(table.out);
  CHECK(std::stod(rows[0].at("strength_db")) == Approx(-30.0));
  CHECK(std::stod(rows[1].at("strength_db")) == Approx(-20.0));
  CHECK(std::stod(rows[1].at("roughness")) == Approx(0.01));
  CHECK(rows[1].at("reflection_loss_db").empty());
  CHECK(table.err.find("material table: its table begins at 10 degrees") != std::string::npos);

  const NamedFields gsab =
      rows_by_name(printed("--scene s.toml --material gravel-bed --angles-deg 80").out)[0];
  const double lobe = 0.1 * std::exp(-0.5 * 10.0 * 10.0 / (5.0 * 5.0));
  const double cosine = std::cos(10.0 * 3.14159265358979 / 180.0);
  CHECK(std::stod(gsab.at("strength_db")) ==
        Approx(10.0 * std::log10(lobe + 0.01 * cosine * cosine)));

  // Small slope does not have the strength that was measured on rock, and not its spread.
  const Outcome slope = printed("--scene s.toml --material slope --angles-deg 20");
  CHECK(slope.err.find("expected within 26 dB") != std::string::npos);
  const Outcome named = printed("--sediment rock --model small-slope --angles-deg 20");
  CHECK(named.err.find("levels are extrapolated, expected within 26 dB") != std::string::npos);
  CHECK(slope.out == named.out);
  CHECK(printed("--material rock --angles-deg 20").out ==
        printed("--sediment rock --angles-deg 20").out);
  CHECK(printed("--material steel --angles-deg 20").code == 0);
  CHECK(printed("--material lava").err.find("is not known") != std::string::npos);
  CHECK(printed("--material rock --sediment rock").err.find("excludes") != std::string::npos);
}

TEST_CASE("a wrong seabed or angle gives one message and exit code 2") {
  for (const auto& [arguments, message] : std::vector<std::pair<std::string, std::string>>{
           {"--sediment medum_sand", "'medium sand'"},
           {"--sediment rock --exponent 4", "less than 4"},
           {"--sediment rock --loss -0.1", "0 to 0.1"},
           {"--mean-grain-size-phi 12", "-1 to 9"},
           {"--density-ratio 2", "--sound-speed-ratio is missing"},
           {"--sediment rock --mean-grain-size-phi 1", "excludes"},
           {"--sediment rock --angles-deg 5,95", "0 to 90"},
           {"--sediment rock --angles-deg 5,x", "x"},
           {"--sediment rock --model cosine", "small-slope"}}) {
    const Outcome outcome = backscatter(at_30_khz + arguments);
    CAPTURE(arguments, outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
  }
  CHECK(backscatter("--frequency-hz 0 --sound-speed-mps 1500 --sediment rock").code == 2);
  CHECK(backscatter("--frequency-hz 30000 --sound-speed-mps 1e-3 --sediment rock").code == 2);
}

TEST_CASE("a grazing angle of 0 stands for 0.001 degrees, in every column and model") {
  for (const char* bed :
       {"rock", "medium_sand", "medium_sand --model small-slope", "medium_sand --model lambert"}) {
    const Outcome outcome =
        backscatter(at_30_khz + "--sediment " + bed + " --angles-deg 0,0.0005,0.001");
    CAPTURE(bed, outcome.err);
    REQUIRE(outcome.code == 0);
    std::vector<NamedFields> rows = rows_by_name(outcome.out);
    REQUIRE(rows.size() == 3);
    for (NamedFields& row : rows) row.erase("grazing_deg");
    CHECK(rows[0] == rows[2]);
    CHECK(rows[1] == rows[2]);
    CHECK(std::isfinite(std::stod(rows[0].at("strength_db"))));
  }
}

TEST_CASE("presets lists every instrument with its documented keys") {
  const TemporaryFolder folder;
  const Outcome outcome = run_program(folder.path(), {"presets"});
  REQUIRE(outcome.code == 0);
  CHECK(outcome.err.empty());
  CHECK(outcome.out.starts_with("name,instrument,frequency_hz,bandwidth_hz,"));
  CHECK(outcome.out.find("\nklein-5000,\"Klein 5000\",455000,20000,150,") != std::string::npos);
  CHECK(outcome.out.find("\ngemini-720is,") != std::string::npos);
  CHECK(outcome.out.find(",frequency_hz bandwidth_hz beams,sidescan,,5\n") != std::string::npos);
}

TEST_CASE("sediments lists every name with its parameters") {
  const TemporaryFolder folder;
  const Outcome outcome = run_program(folder.path(), {"sediments"});
  REQUIRE(outcome.code == 0);
  CHECK(
      outcome.out.starts_with("name,mean_grain_size_phi,density_ratio,sound_speed_ratio,loss,"
                              "volume,exponent,strength_cm4,lambert_mu_db\n"));
  const std::vector<NamedFields> rows = rows_by_name(outcome.out);
  CHECK(rows.size() == 33);
  for (const NamedFields& row : rows) {
    CAPTURE(row.at("name"));
    CHECK(row.at("mean_grain_size_phi").empty() == (std::stod(row.at("loss")) == 0.01374));
    CHECK(row.at("lambert_mu_db").empty() ==
          (row.at("name") != "rock" && row.at("name") != "rough rock"));
  }
  CHECK(run_program(folder.path(), {"sediments", "--mean-grain-size-phi", "-1.5"}).code == 2);
}
