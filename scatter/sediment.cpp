#include <ensonify/scatter/sediment.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/nearest_names.h>
#include <ensonify/scatter/validity.h>

namespace ensonify::scatter {
namespace {

/// The name of the default model (backscatter.h).
constexpr std::string_view handbook = "tr9407";

constexpr double finest_gravel_phi = -1.0, medium_sand_phi = 1.5, very_fine_sand_phi = 3.5;

struct Grain {
  std::string_view name;
  double mean_size_phi;
};
// TR 9407 table 2.
constexpr std::array<Grain, 26> grains = {
    {{"sandy gravel", -1.0},      {"very coarse sand", -0.5},
     {"muddy sandy gravel", 0.0}, {"coarse sand", 0.5},
     {"gravelly sand", 0.5},      {"gravelly muddy sand", 1.0},
     {"medium sand", 1.5},        {"muddy gravel", 2.0},
     {"fine sand", 2.5},          {"silty sand", 2.5},
     {"muddy sand", 3.0},         {"very fine sand", 3.5},
     {"clayey sand", 4.0},        {"coarse silt", 4.5},
     {"sandy silt", 5.0},         {"gravelly mud", 5.0},
     {"medium silt", 5.5},        {"sand silt clay", 5.5},
     {"sandy mud", 6.0},          {"silt", 6.0},
     {"fine silt", 6.5},          {"clayey silt", 6.5},
     {"sandy clay", 7.0},         {"very fine silt", 7.5},
     {"silty clay", 8.0},         {"clay", 9.0}}};

struct Stone {
  std::string_view name;
  double sound_speed_ratio, strength_cm4;
  std::optional<double> strength_at_20_deg_db = {};  // measured
};
// The strength of cobble reproduces table 3; its number in table 2 is hard to read in the scan.
constexpr std::array<Stone, 7> stones = {{{"rough rock", 2.5, 0.20693, -25.0},
                                          {"rock", 2.5, 0.01862, -29.5},
                                          {"handbook rough rock", 2.5, 0.20693},
                                          {"handbook rock", 2.5, 0.01862},
                                          {"cobble", 1.8, 0.0160},
                                          {"gravel", 1.8, 0.0160},
                                          {"pebble", 1.8, 0.0160}}};

/// 10 log10 mu of the Lambert's law that has this strength at 20 degrees.
double lambert_mu_db(double strength_at_20_deg_db) {
  return strength_at_20_deg_db - amplitude_to_db(std::sin(20.0 * degree));
}

// TR 9407 eqs 2-6: M is the mean grain size in phi.
double density_ratio(double M) {
  if (M < 1.0) return 0.007797 * M * M - 0.17057 * M + 2.3139;
  if (M < 5.3) return -0.0165406 * M * M * M + 0.2290201 * M * M - 1.1069031 * M + 3.0455;
  return -0.0012973 * M + 1.1565;
}

double sound_speed_ratio(double M) {
  if (M < 1.0) return 0.002709 * M * M - 0.056452 * M + 1.2778;
  if (M < 5.3) return -0.0014881 * M * M * M + 0.0213937 * M * M - 0.1382798 * M + 1.3425;
  return -0.0024324 * M + 1.0019;
}

double attenuation_db_per_m_khz(double M) {
  if (M < 0.0) return 0.4556;
  if (M < 2.6) return 0.4556 + 0.0245 * M;
  if (M < 4.5) return 0.1978 + 0.1245 * M;
  if (M < 6.0) return 8.0399 - 2.5228 * M + 0.20098 * M * M;
  return 0.9431 - 0.2041 * M + 0.0117 * M * M;
}

double loss(double M) {
  constexpr double c1 = 1.528;  // m/ms, in the handbook's water, whatever the scene's water is
  return attenuation_db_per_m_khz(M) * sound_speed_ratio(M) * c1 * std::numbers::ln10 /
         (40.0 * std::numbers::pi);
}

// Eqs 9-10. h_cm is the rms height of the relief over a track of 100 cm.
double strength_cm4(double M) {
  const double h_cm = M < 5.0 ? (2.03846 - 0.26923 * M) / (1.0 + 0.076923 * M) : 0.5;
  return 0.00207 * h_cm * h_cm;
}

/// Changes a name to lower case, with one space between words, and removes a remark in brackets.
std::string plain_name(std::string_view name) {
  std::string out;
  bool gap = false;
  for (const char c : name.substr(0, name.find('('))) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isspace(u) || c == '-' || c == '_') {
      gap = !out.empty();
      continue;
    }
    if (gap) out += ' ';
    gap = false;
    out += static_cast<char>(std::tolower(u));
  }
  return out;
}

std::string unknown_name(std::string_view name, const std::vector<NamedSediment>& all) {
  std::vector<std::string_view> names;
  for (const NamedSediment& one : all) names.push_back(one.name);
  const std::vector<std::string_view> nearest =
      nearest_names(plain_name(name.substr(0, 64)), names, 3, name.npos);
  std::string text = fmt::format("'{}'", nearest.front());
  for (std::size_t i = 1; i < nearest.size(); ++i)
    text += fmt::format("{}'{}'", i + 1 < nearest.size() ? ", " : " and ", nearest[i]);
  return fmt::format("sediment '{}' is not known; the nearest {} {}", name.substr(0, 64),
                     nearest.size() == 1 ? "name is" : "names are", text);
}

}  // namespace

void check(const Sediment& sediment) {
  struct Range {
    std::string_view name;
    double value, low, high;
  };
  for (const Range& r :
       {Range{"density_ratio", sediment.density_ratio, 1.0, 3.0},
        Range{"sound_speed_ratio", sediment.sound_speed_ratio, 0.8, 3.0},
        Range{"loss", sediment.loss, 0.0, 0.1}, Range{"volume", sediment.volume, 0.0, 1.0},
        Range{"strength_cm4", sediment.strength_cm4, 0.0, 1.0},
        Range{"strength_offset_db", sediment.strength_offset_db, -100.0, 100.0}})
    if (!(r.value >= r.low && r.value <= r.high))
      throw std::invalid_argument(
          fmt::format("sediment: {} is {}, expected {} to {}", r.name, r.value, r.low, r.high));
  if (!(sediment.exponent > 2.0 && sediment.exponent < 4.0))
    throw std::invalid_argument(
        fmt::format("sediment: exponent is {}, expected more than 2 and less than 4 (and best 2.4 "
                    "to 3.9)",
                    sediment.exponent));
}

std::vector<NamedSediment> named_sediments() {
  std::vector<NamedSediment> all;
  for (const Stone& s : stones) {
    Sediment sediment{.density_ratio = 2.5,
                      .sound_speed_ratio = s.sound_speed_ratio,
                      .loss = 0.01374,
                      .volume = 0.002,
                      .strength_cm4 = s.strength_cm4};
    if (s.strength_at_20_deg_db) sediment.lambert_mu_db = lambert_mu_db(*s.strength_at_20_deg_db);
    all.push_back({s.name, std::nullopt, sediment});
  }
  for (const Grain& g : grains)
    all.push_back({g.name, g.mean_size_phi, sediment_of_grain_size(g.mean_size_phi)});
  return all;
}

Sediment sediment_named(std::string_view name) {
  const std::vector<NamedSediment> all = named_sediments();
  const std::string wanted = plain_name(name);
  const auto found = std::ranges::find(all, wanted, &NamedSediment::name);
  if (found == all.end()) throw std::invalid_argument(unknown_name(name, all));
  return found->sediment;
}

Sediment sediment_of_grain_size(double mean_grain_size_phi) {
  const double M = mean_grain_size_phi;
  if (!(M >= -1.0 && M <= 9.0))
    throw std::invalid_argument(fmt::format(
        "mean grain size is {} phi, expected -1 to 9 (coarser: name a sediment, such as "
        "gravel or rock)",
        M));
  return {.density_ratio = density_ratio(M),
          .sound_speed_ratio = sound_speed_ratio(M),
          .loss = loss(M),
          .volume = M < 5.5 ? 0.002 : 0.001,  // eq. 6
          .strength_cm4 = strength_cm4(M)};
}

bool gravel_or_rock(const Sediment& sediment) {
  return sediment.sound_speed_ratio >= sound_speed_ratio(finest_gravel_phi);
}

double wavenumber_per_cm(double frequency_hz, double sound_speed_mps) {
  const auto require_positive = [](std::string_view name, double value) {
    if (!(value > 0.0 && std::isfinite(value)))
      throw std::invalid_argument(fmt::format("{} is {}, expected more than 0", name, value));
  };
  require_positive("frequency_hz", frequency_hz);
  require_positive("sound_speed_mps", sound_speed_mps);
  return 2.0 * std::numbers::pi * frequency_hz / (100.0 * sound_speed_mps);
}

double relief_wavenumber_per_cm(const Sediment& sediment, double frequency_hz,
                                double sound_speed_mps) {
  if (gravel_or_rock(sediment)) frequency_hz = std::min(frequency_hz, highest_valid_hz);
  return wavenumber_per_cm(frequency_hz, sound_speed_mps);
}

double expected_spread_db(const Sediment& sediment, double frequency_hz, std::string_view model) {
  if (frequency_hz >= lowest_valid_hz && frequency_hz <= highest_valid_hz) return 0.0;
  if (!(frequency_hz > highest_valid_hz && frequency_hz <= highest_compared_hz))
    return std::numeric_limits<double>::infinity();
  if (sediment.lambert_mu_db && model == handbook) return 10.0;
  const double nu = sediment.sound_speed_ratio;
  if (nu > 2.0) return 26.0;
  if (nu > sound_speed_ratio(finest_gravel_phi)) return 15.0;
  if (nu > sound_speed_ratio(medium_sand_phi)) return 10.0;
  return nu > sound_speed_ratio(very_fine_sand_phi) ? 6.0 : 2.0;
}

std::string spread_text(double spread_db) {
  return std::isfinite(spread_db) ? fmt::format("expected within {:g} dB", spread_db)
                                  : "by how much they may be off is not known";
}

std::optional<std::string> validity_warning(const Sediment& sediment, double frequency_hz,
                                            std::string_view model) {
  std::string warning;
  if (!(frequency_hz >= lowest_valid_hz && frequency_hz <= highest_valid_hz))
    warning = fmt::format(
        "{:g} kHz is outside 10 to 100 kHz, where the bottom model is validated: {}, {}",
        frequency_hz / 1000.0,
        model != handbook        ? "levels are extrapolated"
        : sediment.lambert_mu_db ? "levels are those measured at 100 kHz"
        : frequency_hz > highest_valid_hz && gravel_or_rock(sediment)
            ? "levels are extrapolated by the roughness of 100 kHz"
            : "levels are extrapolated",
        spread_text(expected_spread_db(sediment, frequency_hz, model)));
  if (!(sediment.exponent >= 2.4 && sediment.exponent <= 3.9))
    warning += fmt::format("{}exponent {} is outside the recommended 2.4 to 3.9",
                           warning.empty() ? "" : "; ", sediment.exponent);
  if (warning.empty()) return std::nullopt;
  return warning;
}

double relief_spectrum_cm4(const Sediment& sediment, double k_per_cm) {
  return sediment.strength_cm4 * std::pow(k_per_cm, -sediment.exponent);
}

}  // namespace ensonify::scatter
