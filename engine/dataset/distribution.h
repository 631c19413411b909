#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace ensonify::engine {

/// How a key of a recipe is drawn. Values are texts as in TOML.
struct Distribution {
  enum class Kind { constant, uniform, log_uniform, normal, whole, choice, table, unset };
  Kind kind = Kind::constant;  ///< 1 where only other keys make it
  double a = 0.0, b = 0.0;     ///< ends, or mean and deviation
  std::optional<std::pair<double, double>> between;
  std::vector<std::string> choices;
  std::vector<double> weights;  ///< empty: all alike
  bool stratified = false;
  std::vector<std::string> times, plus;  ///< keys
  std::string by;                        ///< the key of a table
  std::map<std::string, Distribution> table;
  std::string place;  ///< file:line:column

  /// Keys that it needs, those of its table's entries among them.
  std::vector<std::string> needs() const;
  /// Its possible words, of choices and tables.
  void collect_values(std::vector<std::string>& values) const;

  /// The text for two numbers of (0, 1].
  std::string value(double u, double v) const;
};

/// The radical inverse of a number in a prime base (Halton, Numer. Math. 2, 84, 1960).
double radical_inverse(std::size_t number, unsigned prime);
/// The k-th prime, from 0.
unsigned prime_number(std::size_t k);

/// A number as a value.
std::string value_text(double number);

}  // namespace ensonify::engine
