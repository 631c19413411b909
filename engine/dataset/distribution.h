#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ensonify::engine {

/// How the value of a recipe's key is drawn. Values are texts as in TOML.
struct Distribution {
  enum class Kind { constant, uniform, log_uniform, normal, whole, choice, table, unset };
  /// constant: the value follows only from the keys in `times` and `plus`.
  Kind kind = Kind::constant;
  double a = 0.0, b = 0.0;  ///< the ends; of `normal` mean and standard deviation
  /// Least and greatest value of `normal`: the draw is repeated until the value lies between them.
  std::optional<std::pair<double, double>> between;
  std::vector<std::string> choices;
  std::vector<double> weights;  ///< empty: all equal
  bool stratified = false;
  std::vector<std::string> times, plus;       ///< keys whose values are factors and summands
  std::string by;                             ///< the key that selects an entry of `table`
  std::map<std::string, Distribution> table;  ///< see entry_for()
  std::string place;                          ///< in the recipe, as file:line:column

  /// The keys on which the value depends, including the keys of the table's entries.
  std::vector<std::string> needs() const;
  /// The share of the values of `normal` that lie in `between`; 1 without `between`.
  double share_between() const;
  /// Appends the choices, and those of the table's entries.
  void collect_values(std::vector<std::string>& values) const;
  /// Whether collect_values() appends all possible values.
  bool gives_only_words() const;

  /// The entry of `table` for a value. This is the entry whose name is the value. Otherwise it is
  /// the entry whose name has a * and matches the value; of several, the one with the most other
  /// characters. Otherwise it is the entry "default", or null if there is none.
  const std::pair<const std::string, Distribution>* entry_for(const std::string& value) const;

  /// The value for two random numbers in (0, 1]; only `normal` uses v.
  std::string value(double u, double v) const;
};

/// Whether a text matches a pattern, in which each * stands for any characters except /.
bool matches(std::string_view text, std::string_view pattern);

/// A number in (0, 1] for each index. If (0, 1] is divided into 2^k equal parts, 2^k consecutive
/// indices that begin at a multiple of 2^k have one number in each part. The numbers are van der
/// Corput's sequence in base 2; the seeds scramble its digits and its order (Owen 1995, as in
/// Burley, J. Computer Graphics Techniques 9(4), 2020). Sequences with different seeds are
/// independent of each other.
double stratified_number(std::uint32_t index, std::uint32_t order_seed, std::uint32_t digit_seed);

/// A number as TOML has it; -0 becomes 0.
std::string value_text(double number);

}  // namespace ensonify::engine
