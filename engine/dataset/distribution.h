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
  /// constant: the value comes from the keys in `times` and `plus` only.
  Kind kind = Kind::constant;
  double a = 0.0, b = 0.0;  ///< the ends; of `normal` mean and standard deviation
  /// Least and greatest value of `normal`: it is drawn again until it lies between.
  std::optional<std::pair<double, double>> between;
  std::vector<std::string> choices;
  std::vector<double> weights;  ///< empty: all equal
  bool stratified = false;
  std::vector<std::string> times, plus;       ///< keys whose values are factors and summands
  std::string by;                             ///< the key that selects an entry of `table`
  std::map<std::string, Distribution> table;  ///< see entry_for()
  std::string place;                          ///< in the recipe, as file:line:column

  /// The keys that it depends on, including those of its table's entries.
  std::vector<std::string> needs() const;
  /// The share of a `normal` that lies in `between`; 1 without it.
  double share_between() const;
  /// Appends the possible words of its choices and its table's entries.
  void collect_values(std::vector<std::string>& values) const;
  /// Whether these are all values that it can give.
  bool gives_only_words() const;

  /// The entry of `table` for a value: the entry of that name; else, of those whose names have a *
  /// and match the value, the one with the most other characters; else the entry "default"; null if
  /// there is none.
  const std::pair<const std::string, Distribution>* entry_for(const std::string& value) const;

  /// The value for two numbers in (0, 1]; only `normal` uses v.
  std::string value(double u, double v) const;
};

/// Whether a text matches a pattern, in which each * stands for any characters except /.
bool matches(std::string_view text, std::string_view pattern);

/// A number in (0, 1] for each index. Each aligned run of 2^k indices has one number in each of 2^k
/// equal parts. Sequences of two seeds are independent of each other: van der Corput's sequence in
/// base 2, whose digits and whose order are scrambled (Owen 1995, as in Burley, J. Computer
/// Graphics Techniques 9(4), 2020).
double stratified_number(std::uint32_t index, std::uint32_t order_seed, std::uint32_t digit_seed);

/// A number as the text of a value.
std::string value_text(double number);

}  // namespace ensonify::engine
