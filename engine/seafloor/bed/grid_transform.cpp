#include <ensonify/engine/seafloor/bed/grid_transform.h>

#include <pthread.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <new>
#include <stdexcept>

#include <fftw3.h>
#include <fmt/format.h>

namespace ensonify::engine {
namespace {

// Only fftw_execute may run in two threads at once. A fork() waits for the lock; otherwise the
// child could have a lock whose thread exists only in the parent.
std::mutex planner;
const int at_fork =
    pthread_atfork([] { planner.lock(); }, [] { planner.unlock(); }, [] { planner.unlock(); });

// No vector of FFTW is longer than 64 bytes. The memory is not from FFTW, so that a program's
// operator new can use large pages for it.
constexpr std::align_val_t values_begin{64};
GridTransform::Values values_of(std::size_t numbers) {
  return GridTransform::Values(
      static_cast<double*>(::operator new(numbers * sizeof(double), values_begin)));
}

}  // namespace

struct GridTransform::Plans {
  fftw_plan forward = nullptr, backward = nullptr;
  ~Plans() {
    const std::lock_guard lock(planner);
    if (forward) fftw_destroy_plan(forward);
    if (backward) fftw_destroy_plan(backward);
  }
};

void GridTransform::Free::operator()(double* values) const {
  ::operator delete(values, values_begin);
}

GridTransform::GridTransform(int rows, int columns, Ways ways)
    : rows_(rows), columns_(columns), plans_(std::make_unique<Plans>()) {
  // FFTW_ESTIMATE does not access the array, but needs one with the alignment of later arrays.
  const Values example = values_of(16);
  double* const values = example.get();
  auto* const spectrum = reinterpret_cast<fftw_complex*>(values);
  const std::lock_guard lock(planner);
  if (ways == Ways::both) {
    plans_->forward = fftw_plan_dft_r2c_2d(rows, columns, values, spectrum, FFTW_ESTIMATE);
    if (!plans_->forward) throw std::bad_alloc();
  }
  plans_->backward = fftw_plan_dft_c2r_2d(rows, columns, spectrum, values, FFTW_ESTIMATE);
  if (!plans_->backward) throw std::bad_alloc();
}

GridTransform::~GridTransform() = default;
GridTransform::GridTransform(GridTransform&&) noexcept = default;

GridTransform::Values GridTransform::allocate() const {
  return values_of(stride() * static_cast<std::size_t>(rows_));
}

void GridTransform::forward(double* values) const {
  fftw_execute_dft_r2c(plans_->forward, values, reinterpret_cast<fftw_complex*>(values));
}

void GridTransform::backward(double* values) const {
  fftw_execute_dft_c2r(plans_->backward, reinterpret_cast<fftw_complex*>(values), values);
}

int fast_length(double at_least) {
  if (!(at_least <= 0.5 * std::numeric_limits<int>::max()))
    throw std::invalid_argument(fmt::format(
        "relief: {:.3g} cells in a row are too many to synthesise; use larger cells or a smaller "
        "extent",
        at_least));
  for (int length = 2 * static_cast<int>(std::ceil(0.5 * at_least));; length += 2) {
    int rest = length;
    for (const int prime : {2, 3, 5})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return length;
  }
}

}  // namespace ensonify::engine
