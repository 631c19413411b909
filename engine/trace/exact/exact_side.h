#pragma once

#include <Eigen/Core>

namespace ensonify::engine {

/// On which side of a ray's line the edge p = from, q = to runs: the sign of the permuted inner
/// product of their Plücker coordinates, direction . ((p - origin) x (q - origin)). Exact for all
/// doubles and floats within 1e18, denormal ones too.
///
/// The tie rule: a line that meets the edge passes it on the side that it would pass if its origin
/// were moved by (e, e^2, e^3) for an infinitely small e > 0. A move by m adds m . (direction x (q
/// - p)). So the sign is that of the first non-zero number among the product and the three
/// components of direction x (q - p). All are zero only for an edge along the ray, or of no length:
/// then the result is 0. Swapping p and q swaps the sign.
///
/// Consequences: all edges see the same moved line, and it meets none of them. So it passes through
/// the inside of each face that it meets, and crosses a closed surface an even number of times. The
/// three products of a face sum to direction . (twice its area vector), for the moved line as well.
/// Where that is zero (a face seen edge on, or without area) they cannot have one sign, so no such
/// face is hit.
int exact_side(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
               const Eigen::Vector3f& from, const Eigen::Vector3f& to);

}  // namespace ensonify::engine
