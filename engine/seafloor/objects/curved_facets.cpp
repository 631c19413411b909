#include <ensonify/engine/seafloor/objects/curved_facets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <ensonify/engine/base/work_control.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr double straight = 3.0;  // least ratio of lengths across an edge, see curved_facets.h

/// Fits a quadric to the places around a corner, by least squares. With the origin at the corner
/// and z along a normal: z = A x + B y + (C x^2 + 2 D x y + E y^2) / 2 - (F x + G y + H z) z.
class QuadricFit {
 public:
  /// `unit_m`: unit of length of the fit. `rounding_m`: least standard deviation of the places.
  QuadricFit(const Vector3d& corner, const Vector3d& normal, double unit_m, double rounding_m)
      : corner_(corner),
        unit_m_(unit_m),
        rounding_(rounding_m / unit_m),
        z_(normal),
        x_(normal.unitOrthogonal()),
        y_(z_.cross(x_)) {}

  void add(const Vector3d& place) {
    const Vector3d off = (place - corner_) / unit_m_;
    const double x = off.dot(x_), y = off.dot(y_), z = off.dot(z_);
    const Terms terms{x, y, 0.5 * x * x, x * y, 0.5 * y * y, -x * z, -y * z, -z * z};
    products_ += terms * terms.transpose();
    with_z_ += z * terms;
    z_squares_ += z * z;
    ++places_;
  }

  /// Moves a normal and a curvature towards the normal and the curvature of the quadric. They do
  /// not move if the places scatter so much about the quadric that the standard deviation of its
  /// curvature is more than a fifth of the difference.
  void improve(Vector3d& normal, double& per_m2) const {
    if (places_ <= unknowns) return;
    Products products = products_;
    products.diagonal().array() += rounding_ * rounding_ * places_;
    const Eigen::LDLT<Products> solver(products);
    const Terms k = solver.solve(with_z_);
    // The derivatives of z at the corner.
    const double x = k[0], y = k[1];
    const double xx = k[2] - 2.0 * x * (k[5] + k[7] * x);
    const double xy = k[3] - k[5] * y - k[6] * x - 2.0 * k[7] * x * y;
    const double yy = k[4] - 2.0 * y * (k[6] + k[7] * y);
    const double squared = 1.0 + x * x + y * y;
    const double per_unit2 = per_m2 * unit_m_ * unit_m_;
    const double fitted = (xx * yy - xy * xy) / (squared * squared);
    if (!(fitted * per_unit2 > 0.0)) return;
    const double scatter = std::max(z_squares_ - with_z_.dot(k), 0.0) / (places_ - unknowns);
    const Terms of_curvature{0.0, 0.0, yy, -2.0 * xy, xx, 0.0, 0.0, 0.0};
    const double variance =
        (scatter + rounding_ * rounding_) * of_curvature.dot(solver.solve(of_curvature));
    const double change = fitted - per_unit2;
    const double share = std::max(0.0, 1.0 - 25.0 * variance / (change * change));
    constexpr double most = 2.5;
    per_m2 *= 1.0 + share * (std::clamp(fitted / per_unit2, 1.0 / most, most) - 1.0);
    normal = (z_ - share * (x * x_ + y * y_)).normalized();
  }

 private:
  static constexpr int unknowns = 8;
  using Terms = Eigen::Vector<double, unknowns>;
  using Products = Eigen::Matrix<double, unknowns, unknowns>;
  Vector3d corner_;
  double unit_m_, rounding_;
  Vector3d z_, x_, y_;
  Products products_ = Products::Zero();
  Terms with_z_ = Terms::Zero();
  double z_squares_ = 0.0;
  int places_ = 0;
};

/// The straight line where two flat parts of a smooth surface meet.
struct Seam {
  std::array<std::uint32_t, 2> parts;
  std::array<Vector3d, 2> ends;
  std::array<float, 2> across_m;              // extents of the parts across the seam
  std::array<bool, 2> is_straight;            // whether each part is straight up to the seam
  std::uint32_t corner = FacesInParts::none;  // first of the two corners at the ends

  Seam(const BentEdge& edge, const FacesInParts& faces)
      : parts{faces.part[edge.face], faces.part[edge.other]},
        ends{faces.mesh.positions[edge.from], faces.mesh.positions[edge.to]} {
    if (parts[0] > parts[1]) std::swap(parts[0], parts[1]);
  }
  Vector3d way() const { return ends[1] - ends[0]; }
  std::size_t side_of(std::uint32_t part) const { return parts[0] == part ? 0 : 1; }
  void join(const Seam& more) {
    const Vector3d along = way();
    for (const Vector3d& end : more.ends) {
      if ((end - ends[0]).dot(along) < 0.0) ends[0] = end;
      if ((end - ends[1]).dot(along) > 0.0) ends[1] = end;
    }
  }
};

std::vector<Seam> seams_of(const FacesInParts& faces, std::vector<BentEdge> edges,
                           std::span<const FlatPart> flat_parts) {
  std::vector<Seam> all;
  all.reserve(edges.size());
  for (const BentEdge& edge : edges)
    if (faces.part[edge.face] != faces.part[edge.other]) all.emplace_back(edge, faces);
  edges = {};  // large
  std::ranges::stable_sort(all, {}, &Seam::parts);
  std::vector<std::uint8_t> faces_in(flat_parts.size(), 0);  // at most 2 are counted
  for (const std::uint32_t part : faces.part)
    if (part != FacesInParts::none && faces_in[part] < 2) ++faces_in[part];
  std::size_t count = 0;
  for (std::size_t i = 0, end; i < all.size(); i = end) {
    Seam seam = all[i];
    for (end = i + 1; end < all.size() && all[end].parts == seam.parts; ++end) seam.join(all[end]);
    for (std::size_t k = 0; k < 2; ++k) {
      const FlatPart& part = flat_parts[seam.parts[k]];
      const Vector3d across = part.normal.cast<double>().cross(seam.way()).normalized();
      seam.across_m[k] = static_cast<float>(
          std::hypot(double(part.length_m) * across.dot(part.along.cast<double>()),
                     double(part.width_m) * across.dot(part.across.cast<double>())));
    }
    for (std::size_t k = 0; k < 2; ++k)
      seam.is_straight[k] = faces_in[seam.parts[k]] > 1 &&
                            double(seam.across_m[k]) > straight * double(seam.across_m[1 - k]);
    all[count++] = seam;
  }
  all.erase(all.begin() + static_cast<std::ptrdiff_t>(count), all.end());
  return all;
}

/// How the neighbours of a flat part continue its smooth surface.
struct Surroundings {
  std::uint32_t curved = 0;            // number of seams up to which the part is not straight
  std::array<std::uint32_t, 2> seams;  // the first two of these seams
  bool has_seams = false, strip = false;
};

class Builder {
 public:
  Builder(const FacesInParts& faces, std::vector<BentEdge> edges, std::span<FlatPart> flat_parts,
          const std::function<void()>& stop_check)
      : faces_(faces),
        flat_parts_(flat_parts),
        seams_(seams_of(faces, std::move(edges), flat_parts)),
        around_(flat_parts.size()),
        check_stop_(stop_check) {}

  CurvedFacets make() {
    find_strips();
    for (std::uint32_t p = 0; p < around_.size(); ++p)
      if (around_[p].strip) add_strip(p);
    add_triangles();
    std::ranges::stable_sort(in_parts_, {}, &InPart::part);
    for (const InPart& one : in_parts_) {
      FlatPart& part = flat_parts_[one.part];
      if (part.facets++ == 0) part.first_facet = static_cast<std::uint32_t>(made_.facets.size());
      made_.facets.push_back(one.facet);
    }
    for (FlatPart& part : flat_parts_) set_bends(part);
    return std::move(made_);
  }

 private:
  struct InPart {
    std::uint32_t part;
    CurvedFacet facet;
  };

  void find_strips() {
    for (std::uint32_t s = 0; s < seams_.size(); ++s)
      for (std::size_t k = 0; k < 2; ++k) {
        Surroundings& around = around_[seams_[s].parts[k]];
        around.has_seams = true;
        if (seams_[s].is_straight[k]) continue;
        if (around.curved < 2) around.seams[around.curved] = s;
        ++around.curved;
      }
    // A triangle at the edge of a dome also has two neighbours, but they have three neighbours
    // each, so the triangle is not a strip.
    for (std::uint32_t p = 0; p < around_.size(); ++p) {
      check_stop_();
      Surroundings& around = around_[p];
      if (around.curved < 1 || around.curved > 2) continue;
      around.strip = true;
      for (std::size_t i = 0; i < around.curved; ++i) {
        const Seam& seam = seams_[around.seams[i]];
        if (around_[seam.parts[1 - seam.side_of(p)]].curved > 2) around.strip = false;
      }
      if (around.curved == 2 && std::abs(seams_[around.seams[0]].way().normalized().dot(
                                    seams_[around.seams[1]].way().normalized())) < 0.5)
        around.strip = false;
    }
  }

  std::uint32_t add_corners(const std::array<Vector3d, 2>& ends, const Vector3d& normal) {
    const auto first = static_cast<std::uint32_t>(made_.corners.size());
    for (const Vector3d& end : ends) made_.corners.push_back({end, normal.cast<float>()});
    return first;
  }

  /// The first of the two corners at the ends of a seam.
  std::uint32_t corner_of(Seam& seam) {
    if (seam.corner != FacesInParts::none) return seam.corner;
    // A chord of a circle differs in direction from the circle at its end by half of the arc's
    // angle, so the normal of the shorter part has the larger weight.
    Vector3d normal = Vector3d::Zero();
    for (std::size_t k = 0; k < 2; ++k)
      if (!seam.is_straight[1 - k])
        normal += (seam.is_straight[k] ? 1.0 : double(seam.across_m[1 - k])) *
                  flat_parts_[seam.parts[k]].normal.cast<double>();
    return seam.corner = add_corners(seam.ends, normal.normalized());
  }

  void add_strip(std::uint32_t p) {
    const Surroundings& around = around_[p];
    const FlatPart& part = flat_parts_[p];
    const Seam& seam = seams_[around.seams[0]];
    const std::uint32_t one = corner_of(seams_[around.seams[0]]);
    std::uint32_t other;
    bool reversed = false;
    if (around.curved == 2) {
      other = corner_of(seams_[around.seams[1]]);
      reversed = seams_[around.seams[1]].way().dot(seam.way()) < 0.0;
    } else {  // the other side is symmetric to the side with the seam
      const Vector3d normal = part.normal.cast<double>();
      Vector3d across = normal.cross(seam.way()).normalized();
      if (across.dot(part.middle - seam.ends[0]) < 0.0) across = -across;
      const Vector3d off =
          double(part.length_m) * double(part.width_m) / seam.way().norm() * across;
      const Vector3d at_seam = made_.corners[one].normal.cast<double>();
      other = add_corners({seam.ends[0] + off, seam.ends[1] + off},
                          2.0 * at_seam.dot(normal) * normal - at_seam);
    }
    in_parts_.push_back(
        {p,
         {.corners = {one, one + 1, reversed ? other + 1 : other, reversed ? other : other + 1},
          .strip = true}});
  }

  void add_triangles() {
    const auto count = static_cast<std::uint32_t>(faces_.mesh.faces.size());
    const auto first_triangle_corner = static_cast<std::uint32_t>(made_.corners.size());
    // A linked list of the corners at one place, which belong to different surfaces.
    struct Listed {
      std::uint32_t surface, next;
      Vector3d normal = Vector3d::Zero();
      bool at_straight = false;
    };
    std::vector<Listed> listed;
    std::vector<std::uint32_t> first_at(faces_.place.size(), FacesInParts::none);
    const auto find = [&](std::uint32_t place, std::uint32_t surface) {
      std::uint32_t at = first_at[place];
      while (at != FacesInParts::none && listed[at].surface != surface) at = listed[at].next;
      return at;
    };
    for (std::uint32_t f = 0; f < count; ++f) {
      check_stop_();
      const std::uint32_t p = faces_.part[f];
      if (p == FacesInParts::none || around_[p].curved == 0 || around_[p].strip) continue;
      CurvedFacet facet{.corners = {}, .strip = false};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = faces_.mesh.faces[f][k], place = faces_.place[vertex];
        std::uint32_t at = find(place, faces_.surface[f]);
        if (at == FacesInParts::none) {
          at = static_cast<std::uint32_t>(listed.size());
          listed.push_back({faces_.surface[f], first_at[place]});
          first_at[place] = at;
          made_.corners.push_back({faces_.mesh.positions[vertex], flat_parts_[p].normal});
        }
        facet.corners[k] = first_triangle_corner + at;
      }
      facet.corners[3] = facet.corners[2];
      in_parts_.push_back({p, facet});
    }
    if (listed.empty()) return;
    for (std::uint32_t f = 0; f < count; ++f) {
      check_stop_();
      const std::uint32_t p = faces_.part[f];
      if (p == FacesInParts::none || !around_[p].has_seams) continue;
      const bool is_straight = around_[p].strip || around_[p].curved == 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t at = find(faces_.place[faces_.mesh.faces[f][k]], faces_.surface[f]);
        if (at == FacesInParts::none || (listed[at].at_straight && !is_straight)) continue;
        if (is_straight && !listed[at].at_straight) {
          listed[at].at_straight = true;
          listed[at].normal = Vector3d::Zero();
        }
        const Vector3d corner = faces_.mesh.corner(f, k),
                       one = faces_.mesh.corner(f, (k + 1) % 3) - corner,
                       other = faces_.mesh.corner(f, (k + 2) % 3) - corner;
        listed[at].normal += one.cross(other) / (one.squaredNorm() * other.squaredNorm());
      }
    }
    for (std::size_t i = 0; i < listed.size(); ++i)
      if (listed[i].normal.norm() > 0.0)
        made_.corners[first_triangle_corner + i].normal =
            listed[i].normal.normalized().cast<float>();
    set_curvatures();
    std::vector<bool> straight_there(made_.corners.size(), false);
    for (std::size_t i = 0; i < listed.size(); ++i)
      straight_there[first_triangle_corner + i] = listed[i].at_straight;
    fit_quadrics(straight_there);
  }

  void fit_quadrics(const std::vector<bool>& keeps_normal) {
    const std::size_t count = made_.corners.size();
    // The triangles at corner i are triangles[first[i]] to triangles[first[i + 1] - 1].
    std::vector<std::uint32_t> first(count + 1, 0), triangles;
    for (const InPart& one : in_parts_)
      if (!one.facet.strip)
        for (std::size_t k = 0; k < 3; ++k) ++first[one.facet.corners[k] + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    triangles.resize(first.back());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < in_parts_.size(); ++i)
      if (!in_parts_[i].facet.strip)
        for (std::size_t k = 0; k < 3; ++k) triangles[next[in_parts_[i].facet.corners[k]]++] = i;
    // If a corner has very many triangles, only some of them are used.
    const auto for_triangles_at = [&](std::uint32_t corner, const auto& use) {
      constexpr std::uint32_t enough = 32;
      const std::uint32_t step = 1 + (first[corner + 1] - first[corner]) / enough;
      for (std::uint32_t i = first[corner]; i < first[corner + 1]; i += step)
        for (std::size_t k = 0; k < 3; ++k) use(in_parts_[triangles[i]].facet.corners[k]);
    };
    const std::vector<FacetCorner> before = made_.corners;
    // For each corner, the last corner i of which it was a neighbour, and the last corner i to
    // whose fit it was added.
    std::vector<std::uint32_t> near_to(count, FacesInParts::none), taken = near_to;
    for (std::uint32_t i = 0; i < count; ++i) {
      check_stop_();
      if (first[i] == first[i + 1]) continue;
      const Vector3d& place = before[i].place;
      double unit_m = 0.0;
      for_triangles_at(i, [&](std::uint32_t corner) {
        unit_m = std::max(unit_m, (before[corner].place - place).norm());
      });
      QuadricFit fit(place, before[i].normal.cast<double>().normalized(), unit_m,
                     faces_.mesh.rounding_m);
      for_triangles_at(i, [&](std::uint32_t near) {
        if (std::exchange(near_to[near], i) == i) return;
        for_triangles_at(near, [&](std::uint32_t corner) {
          if (corner == i || std::exchange(taken[corner], i) == i) return;
          fit.add(before[corner].place);
        });
      });
      Vector3d normal = before[i].normal.cast<double>();
      double per_m2 = double(before[i].per_m2);
      fit.improve(normal, per_m2);
      made_.corners[i].per_m2 = static_cast<float>(per_m2);
      if (!keeps_normal[i]) made_.corners[i].normal = normal.cast<float>();
    }
  }

  /// Sets the curvature at each corner: the mean over its triangles.
  void set_curvatures() {
    std::vector<std::array<double, 2>> sums(made_.corners.size());  // of normals, of places
    for (const InPart& one : in_parts_) {
      if (one.facet.strip) continue;
      const Vector3d normal = flat_parts_[one.part].normal.cast<double>();
      const auto area = [&](auto FacetCorner::*what) {
        const auto from_first = [&](std::size_t i) {
          return (made_.corners[one.facet.corners[i]].*what -
                  made_.corners[one.facet.corners[0]].*what)
              .template cast<double>()
              .eval();
        };
        return from_first(1).cross(from_first(2)).dot(normal);
      };
      const double of_normals = area(&FacetCorner::normal), of_places = area(&FacetCorner::place);
      for (std::size_t i = 0; i < 3; ++i) {
        sums[one.facet.corners[i]][0] += of_normals;
        sums[one.facet.corners[i]][1] += of_places;
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (sums[i][1] > 0.0) made_.corners[i].per_m2 = static_cast<float>(sums[i][0] / sums[i][1]);
  }

  void set_bends(FlatPart& part) const {
    for (const auto& [axis, bend_rad] : {std::pair(&part.along, &part.bend_along_rad),
                                         std::pair(&part.across, &part.bend_across_rad)}) {
      float least = 1.0f, most = -1.0f;
      for (const CurvedFacet& facet : made_.of(part))
        for (const std::uint32_t corner : facet.corners) {
          const float sine = axis->dot(made_.corners[corner].normal);
          least = std::min(least, sine);
          most = std::max(most, sine);
        }
      *bend_rad = std::max(most - least, 0.0f);
    }
  }

  const FacesInParts& faces_;
  std::span<FlatPart> flat_parts_;
  std::vector<Seam> seams_;
  std::vector<Surroundings> around_;  // by flat part
  RareStopCheck check_stop_;
  std::vector<InPart> in_parts_;
  CurvedFacets made_;
};

}  // namespace

CurvedFacets curved_facets(const FacesInParts& faces, std::vector<BentEdge> edges,
                           std::span<FlatPart> flat_parts,
                           const std::function<void()>& stop_check) {
  return Builder(faces, std::move(edges), flat_parts, stop_check).make();
}

}  // namespace ensonify::engine
