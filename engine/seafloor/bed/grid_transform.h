#pragma once

#include <cstddef>
#include <memory>

namespace ensonify::engine {

/// Fourier transforms of a real grid, in place. A row of `columns` numbers has room for columns / 2
/// + 1 complex numbers. Thread-safe, but only one thread may use an array at a time.
class GridTransform {
 public:
  struct Free {
    void operator()(double* values) const;
  };
  using Values = std::unique_ptr<double, Free>;

  enum class Ways { both, backward };

  /// `columns` must be even. Throws std::bad_alloc.
  GridTransform(int rows, int columns, Ways ways);
  ~GridTransform();
  GridTransform(GridTransform&&) noexcept;
  GridTransform& operator=(GridTransform&&) = delete;

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  /// The distance from row to row, in numbers.
  std::size_t stride() const { return 2 * (static_cast<std::size_t>(columns_) / 2 + 1); }
  /// Throws std::bad_alloc.
  Values allocate() const;
  /// The transforms, only for arrays from allocate(), and forward() only with Ways::both. They have
  /// no factor, so forward() and then backward() multiply by rows * columns.
  void forward(double* values) const;
  void backward(double* values) const;

 private:
  struct Plans;
  int rows_, columns_;
  std::unique_ptr<Plans> plans_;
};

/// The least length of at least `at_least` that is 2^a 3^b 5^c with a >= 1. Transforms of such
/// lengths are fast and have a Nyquist term. Throws std::invalid_argument for more than 2^30.
int fast_length(double at_least);

/// The frequency of row `index` of a transform, in frequency steps.
inline double signed_frequency(int index, int length) {
  return index <= length / 2 ? index : index - length;
}

}  // namespace ensonify::engine
