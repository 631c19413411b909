#include <ensonify/engine/scene/tables/profile_reader.h>

#include <random>
#include <string>
#include <vector>

#include <sys/stat.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/program.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/refine/printable.h>

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::scatter::SoundSpeedProfile;

namespace {

const std::string good =
    "depth_m,soundspeed_mps\n"
    "0,1500\n"
    "10,1490.5\n"
    "30,1485\n";

/// The same profile in the form that a CastAway writes: the instrument's header, then columns with
/// the instrument's names.
const std::string castaway =
    "% Device,11E101663\n"
    "% Cast time (UTC),2012-08-21 12:28:17\n"
    "% \n"
    "Pressure (Decibar),Depth (Meter),Temperature (Celsius),Sound velocity (Meters per Second)\n"
    "0.1,0,18.36,1500\n"
    "10.1,10,18.32,1490.5\n"
    "30.2,30,17.1,1485\n";

void check_is_good(const SoundSpeedProfile& profile) {
  CHECK(profile.layers().size() == 4);
  CHECK(profile.shallowest_m() == 0.0);
  CHECK(profile.deepest_m() == 30.0);
  CHECK(profile.speed_mps(0.0) == 1500.0);
  CHECK(profile.speed_mps(10.0) == 1490.5);
  CHECK(profile.speed_mps(30.0) == 1485.0);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t place = 0; (place = text.find(from, place)) != std::string::npos;
       place += to.size())
    text.replace(place, from.size(), to);
  return text;
}

/// The reader's complaint: one printable line that begins with file and line.
void check_refused(const std::string& text, int line, const std::string& expected) {
  try {
    parse_profile(text, "cast.csv");
    FAIL_CHECK("was read; expected: " << expected);
  } catch (const SceneError& error) {
    const std::string what = error.what();
    INFO(what);
    CHECK(what.starts_with("cast.csv:" + std::to_string(line) + ": "));
    CHECK(what.find(expected) != std::string::npos);
    CHECK(what.size() < 400);
    CHECK(ensonify::refine::printable(what) == what);
  }
}

/// The second line of a file with a good header.
void check_row_refused(const std::string& row, const std::string& expected) {
  INFO(row);
  check_refused("depth_m,soundspeed_mps\n0,1500\n" + row + "\n20,1490\n", 3, expected);
}

}  // namespace

TEST_CASE("A profile is read by its header and rows") { check_is_good(parse_profile(good, "")); }

TEST_CASE("All forms that programs write are read the same") {
  const std::string mark = "\xef\xbb\xbf";
  const std::string rows = good.substr(good.find('\n') + 1);
  const std::vector<std::string> texts = {
      mark + good,
      replaced(good, "\n", "\r\n"),
      mark + replaced(good, "\n", "\r\n"),
      replaced(good, "\n", "\r"),       // an old Mac's lines
      good.substr(0, good.size() - 1),  // no last line end
      good + "\n\n\n",                  // blank lines
      replaced(good, "\n", "\n\n"),
      "\n" + good,
      "# a cast\n# of today\n" + good,
      mark + "# a cast\n" + good,
      replaced(good, "10,", "# then\n10,"),
      "  # indented\r\n" + good,
      replaced(good, ",", " , "),
      replaced(good, ",", ",\t"),
      replaced(replaced(good, "\n", " \n"), ",", "\t,"),
      "soundspeed_mps,depth_m\n1500,0\n1490.5,10\n1485,30\n",  // columns in the other order
      "\"depth_m\",\"soundspeed_mps\"\n" + rows,               // as R writes it
      "\"depth_m\",\"soundspeed_mps\"\n\"0\",\"1500\"\n\"10\",\"1490.5\"\n\"30\",\"1485\"\n",
      "depth_m,soundspeed_mps\n30,1485\n10,1490.5\n0,1500\n",  // an upcast
      "depth_m,soundspeed_mps\n10,1490.5\n0,1500\n30,1485\n",
      good + rows,  // down and up
      "depth_m,soundspeed_mps\n0.0,1.5e3\n1e1,14905E-1\n3.0E+1,1485.\n",
      "depth_m,soundspeed_mps\n+0,+1500\n+10,+1490.5\n+30,+1485\n",
      "depth_m,soundspeed_mps\n00,01500\n010,001490.500\n30.000000000000000000000,1485\n",
      "depth_m,soundspeed_mps\n-0,1500\n10,1490.5\n30,1485\n",
      "time,depth_m,temperature_c,soundspeed_mps\n12:00,0,18,1500\n12:01,10,,1490.5\n,30,9,1485\n",
      "depth_m,soundspeed_mps\n0,1500\n10,1490\n10,1491\n30,1485\n",  // one depth twice: the mean
  };
  CHECK(texts.size() >= 20);
  for (const std::string& text : texts) {
    INFO(text);
    check_is_good(parse_profile(text, "cast.csv"));
  }
}

TEST_CASE("A single sample is a profile") {
  CHECK(parse_profile("depth_m,soundspeed_mps\n5,1500\n", "").speed_mps(80.0) == 1500.0);
}

TEST_CASE("A file without a profile is refused, and the error names what is missing") {
  check_refused("", 1, "the file is empty");
  check_refused("\xef\xbb\xbf", 1, "the file is empty");
  check_refused("\n\r\n  \n", 3, "the file is empty");
  check_refused("# only\n# comments\n", 2, "the file is empty");
  check_refused("depth_m,soundspeed_mps", 1, "no sample");
  check_refused("depth_m,soundspeed_mps\n\n# end\n", 3, "no sample");
  check_refused("0,1500\n10,1490\n", 1, "no column depth_m in '0,1500'");
  check_refused("depth_m\n0\n", 1, "no column soundspeed_mps");
  check_refused("soundspeed_mps\n1500\n", 1, "no column depth_m");
  check_refused("depth,soundspeed_mps\n0,1500\n", 1, "no column depth_m");
  check_refused("depth_m,soundspeed\n0,1500\n", 1, "no column soundspeed_mps");
  check_refused("Depth_m,Soundspeed_mps\n0,1500\n", 1, "no column depth_m");
  check_refused("depth_m;soundspeed_mps\n0;1500\n", 1, "separated by semicolons");
  check_refused("depth_m soundspeed_mps\n0 1500\n", 1, "no column depth_m");
  check_refused("depth_m,depth_m,soundspeed_mps\n0,0,1500\n", 1, "depth_m appears twice");
  check_refused("depth_m,soundspeed_mps,soundspeed_mps\n0,1,2\n", 1,
                "soundspeed_mps appears twice");
  check_refused("\n# x\nz,c\n", 3, "no column depth_m in 'z,c'");
  check_refused(std::string("\xff\xfe"
                            "d\0e\0p\0t\0h\0",
                            12),
                1, "is in UTF-16");
  check_refused(std::string(300, '\0'), 1, "no column depth_m");
  check_refused("\x89PNG\r\n\x1a\n", 1, "no column depth_m");
  check_refused("{\"depth_m\": [0, 10]}", 1, "no column");
  check_refused(std::string(2'000'000, ','), 1, "a line of more than 4096 characters");
  check_refused(good + std::string(5000, '1'), 5, "a line of more than 4096 characters");
}

TEST_CASE("A cast in a CastAway's format is read") {
  check_is_good(parse_profile(castaway, "cast.csv"));
  check_is_good(parse_profile("\xef\xbb\xbf" + replaced(castaway, "\n", "\r\n"), "cast.csv"));
  check_is_good(parse_profile(castaway.substr(castaway.find("Pressure")), "cast.csv"));
  // Our own names go before.
  check_is_good(parse_profile(
      "Depth (Meter),depth_m,soundspeed_mps\n1,0,1500\n2,10,1490.5\n3,30,1485\n", ""));
}

TEST_CASE("An error in a CastAway's file names its line and quotes it") {
  check_refused(replaced(castaway, "1490.5", "fast"), 6,
                "Sound velocity (Meters per Second) is 'fast'");
  check_refused(replaced(castaway, "1490.5", "nan"), 6, "is 'nan'");
  check_refused(replaced(castaway, "1490.5", "-1490.5"), 6, "the sound speed is -1490.5 m/s");
  check_refused(replaced(castaway, ",10,", ",1e9,"), 6, "the depth is 1000000000 m");
  check_refused(replaced(castaway, ",10,", ","), 6, "3 values");
  check_refused(replaced(castaway, "Depth (Meter)", "Depth (Foot)"), 4, "no column depth_m");
  check_refused(
      replaced(castaway, "Sound velocity (Meters per Second)", "Density"), 4,
      "expected a header row with depth_m,soundspeed_mps (or Depth (Meter),Sound velocity "
      "(Meters per Second))");
  check_refused(replaced(castaway, "Temperature (Celsius)", "Depth (Meter)"), 4,
                "column Depth (Meter) appears twice");
  check_refused(castaway.substr(0, castaway.find("Pressure")), 3, "the file is empty");
  check_refused(castaway.substr(0, castaway.find("0.1,")), 4, "no sample");
  check_refused(castaway + "% End of file\n", 8, "1 values");
  check_refused("%" + std::string(5000, 'x') + "\n" + castaway, 1, "a line of more than 4096");
}

TEST_CASE("A CastAway's file gives the same cast as the plain file made from it") {
  const auto own = data_file("soundspeed/castaway__11E101663_20120821_122817.csv");
  const auto converted = data_file("soundspeed/castaway_portsmouth_1.csv");
  if (!own || !converted) {
    WARN("skipped: the CastAway's cast is not among the data");
    return;
  }
  const SoundSpeedProfile cast = read_profile(*own), expected = read_profile(*converted);
  CHECK(cast.layers().size() == expected.layers().size());
  CHECK(cast.deepest_m() == Approx(expected.deepest_m()).margin(0.0006));  // to three decimals
  for (double depth_m = 0.0; depth_m < 30.0; depth_m += 0.1)
    CHECK(cast.speed_mps(depth_m) == Approx(expected.speed_mps(depth_m)).margin(0.005));
}

TEST_CASE("A damaged row is refused with its line") {
  check_row_refused("10", "1 values in '10', expected 2");
  check_row_refused("10,1490,3", "3 values");
  check_row_refused("10,1490,", "3 values");
  check_row_refused(",", "depth_m is '', expected a number");
  check_row_refused("10,", "soundspeed_mps is '', expected a number");
  check_row_refused(",1490", "depth_m is ''");
  check_row_refused("10;1490", "1 values");
  check_row_refused("10,1490 m/s", "soundspeed_mps is '1490 m/s'");
  check_row_refused("10 m,1490", "depth_m is '10 m'");
  check_row_refused("ten,1490", "depth_m is 'ten'");
  check_row_refused("10,5", "the sound speed is 5 m/s, expected 1000 to 2000");
  check_row_refused("10,1,490", "3 values");
  check_row_refused("10,1490.5.1", "soundspeed_mps is '1490.5.1'");
  check_row_refused("0x10,1490", "depth_m is '0x10'");
  check_row_refused("--10,1490", "depth_m is '--10'");
  check_row_refused("+-10,1490", "depth_m is '+-10'");
  check_row_refused("1e,1490", "depth_m is '1e'");
  check_row_refused("1e400,1490", "depth_m is '1e400'");
  check_row_refused("10,1e-400", "soundspeed_mps is '1e-400'");
  check_row_refused("nan,1490", "depth_m is 'nan', expected a number");
  check_row_refused("10,NaN", "soundspeed_mps is 'NaN'");
  check_row_refused("inf,1490", "depth_m is 'inf'");
  check_row_refused("10,-inf", "soundspeed_mps is '-inf'");
  check_row_refused("-10,1490", "the depth is -10 m");
  check_row_refused("-1e-9,1490", "the depth is -1e-09 m");
  check_row_refused("12000.5,1490", "the depth is 12000.5 m");
  check_row_refused("1e38,1490", "the depth is 1e+38");
  check_row_refused("10,999.9", "the sound speed is 999.9 m/s");
  check_row_refused("10,2000.1", "the sound speed is 2000.1 m/s");
  check_row_refused("10,-1490", "the sound speed is -1490 m/s");
  check_row_refused("10,4890", "the sound speed is 4890 m/s");  // feet
  check_row_refused("1490,10", "the sound speed is 10 m/s");    // columns swapped
  check_row_refused("-9999,-9999", "the depth is -9999 m");     // no data
  check_row_refused("10,1490\x01", "soundspeed_mps is '1490\\x01'");
  check_row_refused("10,149\xc3\xa9", "soundspeed_mps is '149\xc3\xa9'");
  check_row_refused("10,149\xe9", "soundspeed_mps is '149\\xE9'");
  check_row_refused("10,\"1490", "soundspeed_mps is '\"1490'");
  check_row_refused("depth_m,soundspeed_mps", "depth_m is 'depth_m'");
  check_row_refused("% 10,1490", "depth_m is '% 10'");
  check_row_refused(std::string(200, '9') + "," + std::string(200, '9'), "the depth is 1e+200");
  check_row_refused(std::string(400, '9') + ",1490", "depth_m is '9999");
  check_row_refused("10," + std::string(1000, '\t') + "x", "soundspeed_mps is 'x'");
  check_row_refused(std::string(4000, ','), "4001 values");
}

TEST_CASE("A byte-order mark does not shift the lines, nor do comments and CRLF") {
  check_refused("\xef\xbb\xbf# x\r\ndepth_m,soundspeed_mps\r\n\r\n0,1500\r\n1,x\r\n", 5, "'x'");
}

TEST_CASE("A missing file, a pipe, a folder, an endless or a huge file is refused at once") {
  const TemporaryFolder folder;
  const auto refused = [](const std::filesystem::path& file, const std::string& expected) {
    CHECK_THROWS_WITH(read_profile(file),
                      Catch::StartsWith(file.string() + ":") && Catch::Contains(expected));
  };
  refused(folder / "none.csv", "there is no such file");
  refused(folder.path(), "is a folder");
  refused("/dev/zero", "is not a regular file");
  REQUIRE(mkfifo((folder / "pipe.csv").c_str(), 0600) == 0);
  refused(folder / "pipe.csv", "is not a regular file");
  write_text(folder / "huge.csv", "");
  std::filesystem::resize_file(folder / "huge.csv", std::uintmax_t{1} << 40);
  refused(folder / "huge.csv", "expected at most 67108864");
  write_text(folder / "bad.csv", replaced(good, "1485", "fast"));
  refused(folder / "bad.csv", ":4: soundspeed_mps is 'fast'");
  write_text(folder / "good.csv", good);
  check_is_good(read_profile(folder / "good.csv"));
}

TEST_CASE("A damaged profile is read within bounds or refused with a place") {
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return random() % n; };
  int read = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = i % 2 ? good : castaway;
    for (std::size_t left = 1 + below(4); left > 0; --left) {
      const std::size_t place = below(text.size());
      switch (below(4)) {
        case 0: text[place] = static_cast<char>(below(256)); break;
        case 1: text.erase(place, below(5)); break;
        case 2: text.insert(place, 1, "0123456789.,-+e#\n\r\"\t "[below(21)]); break;
        default:
          if (below(4) == 0) text.resize(place);
      }
      if (text.empty()) text = good;
    }
    try {
      const SoundSpeedProfile profile = parse_profile(text, "cast.csv");
      ++read;
      for (const double depth_m : {0.0, 5.0, 20.0, 12000.0}) {
        REQUIRE(profile.speed_mps(depth_m) >= 1000.0);
        REQUIRE(profile.speed_mps(depth_m) <= 2000.0);
      }
    } catch (const SceneError& error) {
      ++refused;
      const std::string what = error.what();
      REQUIRE(what.starts_with("cast.csv:"));
      REQUIRE(std::isdigit(static_cast<unsigned char>(what.at(9))));
    }
  }
  CHECK(read > 1000);
  CHECK(refused > 1000);
}

TEST_CASE("Real casts are read, one depth measured twice among them") {
  struct Cast {
    std::string file;
    std::size_t layers;
    double shallowest_m, deepest_m;
  };
  for (const auto& [name, layers, shallowest_m, deepest_m] :
       {Cast{"castaway_portsmouth_1.csv", 76, 0.15, 22.357},
        {"hypack_sfbay.csv", 36, 0.0, 54.2},
        {"simrad_shallow_duct.csv", 13, 1.81, 100.0}}) {
    const auto file = data_file("soundspeed/" + name);
    if (!file) {
      WARN("skipped: " << name << " is not among the data");
      continue;
    }
    INFO(name);
    const SoundSpeedProfile profile = read_profile(*file);
    CHECK(profile.layers().size() == layers);
    CHECK(profile.shallowest_m() == shallowest_m);
    CHECK(profile.deepest_m() == deepest_m);
    CHECK(profile.mean_speed_mps(0.0, 20.0) == Approx(1490.0).margin(25.0));
    if (name.starts_with("hypack")) CHECK(profile.speed_mps(1.6) == Approx(1504.875));
  }
  // As the instruments write them, these are no profiles, and the message says what is wanted.
  for (const std::string name : {"hypack__20190819_SV_1549_D.vel", "simrad__00018_001241535.ssp"})
    if (const auto file = data_file("soundspeed/" + name))
      CHECK_THROWS_WITH(read_profile(*file),
                        Catch::Contains("expected a header row with depth_m,soundspeed_mps"));
}
