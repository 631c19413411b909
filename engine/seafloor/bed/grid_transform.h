#pragma once

#include <cstddef>
#include <memory>

namespace ensonify::engine {

/// Fourier transforms of a real grid, in place. A row of `columns` numbers has room for columns / 2
/// + 1 complex ones. Thread-safe, except that each array belongs to one thread.
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
  /// From row to row, in numbers.
  std::size_t stride() const { return 2 * (static_cast<std::size_t>(columns_) / 2 + 1); }
  /// Throws std::bad_alloc.
  Values allocate() const;
  /// Both without a factor: one after the other multiplies by rows * columns. Only for arrays of
  /// allocate(). forward() is only for a transform of both ways.
  void forward(double* values) const;
  void backward(double* values) const;

 private:
  struct Plans;
  int rows_, columns_;
  std::unique_ptr<Plans> plans_;
};

/// The next length of 2^a 3^b 5^c with a >= 1: transforms are fast at these, and they have a
/// Nyquist term. Throws std::invalid_argument for more than 2^30.
int fast_length(double at_least);

/// The frequency, in steps, of a row of a transform.
inline double signed_frequency(int index, int length) {
  return index <= length / 2 ? index : index - length;
}

}  // namespace ensonify::engine
