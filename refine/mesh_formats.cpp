#include <ensonify/refine/mesh_formats.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <system_error>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/refine/printable.h>

namespace ensonify::refine {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool is_line_end(char c) { return c == '\n' || c == '\r'; }

std::string_view without_plus(std::string_view word) {
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  return plus ? word.substr(1) : word;
}

/// Reads a word as a number, nan or inf. Numbers too small for double become 0, too large ones inf.
std::optional<double> to_number(std::string_view word) {
  word = without_plus(word);
  double value = 0.0;
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  if (read.ptr != word.data() + word.size()) return std::nullopt;
  if (read.ec == std::errc::result_out_of_range)
    return word.find("e-") != word.npos || word.find("E-") != word.npos ? 0.0 : HUGE_VAL;
  if (read.ec != std::errc{}) return std::nullopt;
  return value;
}

/// Cuts ears off a polygon. An ear is a corner whose triangle with its two neighbours is inside the
/// polygon and has no other corner in it.
class EarCutter {
 public:
  /// `corners` are counter-clockwise when the normal points to the viewer.
  EarCutter(const std::vector<std::uint32_t>& corners,
            const std::vector<Eigen::Vector3d>& positions, const Eigen::Vector3d& normal)
      : corners_(corners), left_(corners.size()) {
    const Eigen::Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
    for (const std::uint32_t corner : corners) {
      const Eigen::Vector3d from_first = positions[corner] - positions[corners.front()];
      places_.emplace_back(x.dot(from_first), y.dot(from_first));
    }
    std::iota(left_.begin(), left_.end(), std::size_t{0});
  }

  /// Returns the triangles; none if the polygon has no ear, because it crosses itself.
  std::vector<Face> cut() {
    std::vector<Face> faces;
    std::size_t tried = 0, i = 0;
    while (left_.size() > 3) {
      // A corner on a straight line is cut off only if there is no other ear.
      const bool all_tried = tried >= left_.size();
      if (tried >= 2 * left_.size()) return {};
      i %= left_.size();
      if (!is_ear(i, all_tried)) {
        ++tried;
        ++i;
        continue;
      }
      faces.push_back(face_at(i));
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(i));
      tried = 0;
    }
    faces.push_back(face_at(1));
    return faces;
  }

 private:
  std::size_t corner(std::size_t i) const { return left_[i % left_.size()]; }
  std::size_t before(std::size_t i) const { return corner(i + left_.size() - 1); }
  Face face_at(std::size_t i) const {
    return {corners_[before(i)], corners_[corner(i)], corners_[corner(i + 1)]};
  }
  /// Twice the area of a triangle, positive if its corners are counter-clockwise.
  double area(std::size_t a, std::size_t b, std::size_t c) const {
    const Eigen::Vector2d ab = places_[b] - places_[a], ac = places_[c] - places_[a];
    return ab.x() * ac.y() - ab.y() * ac.x();
  }
  bool is_ear(std::size_t i, bool may_be_flat) const {
    const std::size_t a = before(i), b = corner(i), c = corner(i + 1);
    const double own = area(a, b, c);
    if (own < 0.0 || (own == 0.0 && !may_be_flat)) return false;
    return std::ranges::none_of(left_, [&](std::size_t other) {
      const Eigen::Vector2d& place = places_[other];
      return place != places_[a] && place != places_[b] && place != places_[c] &&
             area(a, b, other) >= 0.0 && area(b, c, other) >= 0.0 && area(c, a, other) >= 0.0;
    });
  }

  const std::vector<std::uint32_t>& corners_;
  std::vector<Eigen::Vector2d> places_;
  std::vector<std::size_t> left_;  // the corners that are not cut off, in order
};

}  // namespace

void split_concave_polygons(FileMesh& mesh, std::string_view name) {
  constexpr double rounding = 1e-5;        // of a polygon's area
  constexpr std::size_t max_faces = 1000;  // the work grows with the square of this, or faster
  const auto product = [&](const Face& face) -> Eigen::Vector3d {  // twice the area
    const Eigen::Vector3d& origin = mesh.positions[face[0]];
    return (mesh.positions[face[1]] - origin).cross(mesh.positions[face[2]] - origin);
  };
  for (const FileMesh::Polygon& polygon : mesh.polygons) {
    const std::span<Face> fan = std::span(mesh.faces).subspan(polygon.first, polygon.faces);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Face& face : fan) sum += product(face);
    if (std::ranges::none_of(fan, [&](const Face& face) {
          return product(face).dot(sum) < -rounding * sum.squaredNorm();
        }))
      continue;
    if (fan.size() > max_faces)
      throw MeshError(
          fmt::format("{}: a polygon with {} corners is concave, expected at most {}; write the "
                      "file again as triangles",
                      name, fan.size() + 2, max_faces + 2));
    std::vector<std::uint32_t> corners{fan[0][0], fan[0][1]};
    for (const Face& face : fan) corners.push_back(face[2]);
    std::ranges::copy(EarCutter(corners, mesh.positions, sum.normalized()).cut(), fan.begin());
  }
}

std::string quoted(std::string_view text) { return '"' + printable(shortened(text, 60)) + '"'; }

void fail_at_byte(std::string_view name, std::size_t byte, const std::string& what) {
  throw MeshError(fmt::format("{}: byte {}: {}", name, byte, what));
}

std::string index_fault(std::int64_t index, std::uint64_t vertices) {
  return fmt::format("a face names vertex {}, but there are {}; correct the face or the vertices",
                     index, vertices);
}

MeshText::MeshText(std::string_view bytes, std::string_view name, Rules rules)
    : bytes_(bytes), name_(name), rules_(rules) {
  if (bytes.starts_with("\xef\xbb\xbf")) place_ = 3;
}

std::size_t MeshText::line_end_bytes(std::size_t place) const {
  if (place >= bytes_.size() || !is_line_end(bytes_[place])) return 0;
  return bytes_.substr(place, 2) == "\r\n" ? 2 : 1;
}

/// If a backslash at this place joins two lines, the number of bytes from it to the end of the line
/// end after it; otherwise 0.
std::size_t MeshText::joint_bytes() const {
  if (!rules_.joined_lines || bytes_[place_] != '\\') return 0;
  std::size_t place = place_ + 1;
  while (place < bytes_.size() && is_blank(bytes_[place])) ++place;
  const std::size_t end = line_end_bytes(place);
  return end == 0 ? 0 : place + end - place_;
}

std::string_view MeshText::word() {
  while (place_ < bytes_.size()) {
    if (const std::size_t joint = joint_bytes(); joint > 0) {
      place_ += joint;
      ++line_;
    } else if (is_blank(bytes_[place_])) {
      ++place_;
    } else {
      break;
    }
  }
  if (rules_.hash_comments && place_ < bytes_.size() && bytes_[place_] == '#')
    while (place_ < bytes_.size() && !is_line_end(bytes_[place_])) ++place_;
  const std::size_t first = place_;
  while (place_ < bytes_.size() && !is_blank(bytes_[place_]) && !is_line_end(bytes_[place_]) &&
         !(rules_.hash_comments && bytes_[place_] == '#') && joint_bytes() == 0)
    ++place_;
  return bytes_.substr(first, place_ - first);
}

bool MeshText::to_word() {
  for (;;) {
    if (const std::string_view found = word(); !found.empty()) {
      place_ -= found.size();
      return true;
    }
    const std::size_t end = line_end_bytes(place_);
    if (end == 0) return false;
    place_ += end;
    ++line_;
  }
}

std::string_view MeshText::next_word(std::string_view wanted) {
  if (const std::string_view found = word(); !found.empty()) return found;
  if (!to_word())
    fail(fmt::format("the file ends where {} should be; it is cut short: fetch or write it again",
                     wanted));
  return word();
}

void MeshText::end_line(std::string_view after) {
  if (const std::string_view found = word(); !found.empty())
    fail(fmt::format("{} follows {}; remove it, or correct what is before it", quoted(found),
                     after));
}

void MeshText::skip_line() {
  while (!word().empty()) {
  }
}

double MeshText::coordinate() { return coordinate(next_word("a coordinate")); }

std::int64_t MeshText::integer(std::string_view wanted) {
  return integer(next_word(wanted), wanted);
}

void MeshText::skip_number() { check_number(next_word("a number")); }

double MeshText::coordinate(std::string_view word) const {
  const std::optional<double> value = to_number(word);
  if (!value) fail(fmt::format("found {}, expected a number; correct it", quoted(word)));
  if (!(std::abs(*value) <= largest_mesh_m))
    fail(fmt::format("a coordinate is {}, not a number of metres; correct it", quoted(word)));
  return *value;
}

std::int64_t MeshText::integer(std::string_view word, std::string_view wanted) const {
  const std::string_view digits = without_plus(word);
  std::int64_t value = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (read.ec != std::errc{} || read.ptr != digits.data() + digits.size())
    fail(fmt::format("found {}, expected {}; correct it", quoted(word), wanted));
  return value;
}

void MeshText::check_number(std::string_view word) const {
  if (!to_number(word)) fail(fmt::format("found {}, expected a number; correct it", quoted(word)));
}

void MeshText::fail(const std::string& what, std::size_t line) const {
  throw MeshError(fmt::format("{}:{}: {}", name_, line, what));
}

}  // namespace ensonify::refine
