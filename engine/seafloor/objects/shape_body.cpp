#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/objects/shape_family.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

/// Makes one body of a kind that is not a family.
class BodyMaker {
 public:
  BodyMaker(const ShapeKind& kind, const ShapeSize& size, const RandomStream& random)
      : kind_(kind), given_(size), draws_(random) {}

  ShapeBody make() {
    struct Maker {
      std::string_view name;
      void (BodyMaker::*make)();
    };
    static constexpr std::array makers{
        Maker{"cylinder", &BodyMaker::cylinder}, Maker{"cone", &BodyMaker::cone},
        Maker{"wedge", &BodyMaker::wedge},       Maker{"sphere", &BodyMaker::sphere},
        Maker{"box", &BodyMaker::box},           Maker{"barrel", &BodyMaker::barrel},
        Maker{"tyre", &BodyMaker::tyre},         Maker{"anchor", &BodyMaker::anchor},
        Maker{"pot", &BodyMaker::pot},           Maker{"net", &BodyMaker::net},
        Maker{"boulder", &BodyMaker::boulder},   Maker{"debris", &BodyMaker::debris}};
    const auto maker = std::ranges::find(makers, kind_.name, &Maker::name);
    if (maker == makers.end())
      throw std::invalid_argument(fmt::format("a {} is laid along a path", kind_.name));
    (this->*maker->make)();
    std::vector<std::uint8_t> parts = solids_.face_parts();
    return {.mesh = std::move(solids_.mesh), .face_part = std::move(parts)};
  }

 private:
  double length_m() const { return kind_.size_m(given_, &ShapeSize::length_m); }
  double width_m() const { return kind_.size_m(given_, &ShapeSize::width_m); }
  double shape_height_m() const { return kind_.size_m(given_, &ShapeSize::shape_height_m); }
  double diameter_m() const { return kind_.size_m(given_, &ShapeSize::diameter_m); }

  int segments(double diameter_m) const {
    const double usual_rad = std::min(2.0 * pi / 48.0, given_.facet_rad.value_or(pi));
    const double facet_m = given_.facet_m.value_or(0.5 * diameter_m * usual_rad);
    return static_cast<int>(std::clamp(std::ceil(pi * diameter_m / facet_m - 1e-9), 8.0, 512.0));
  }
  /// Number of subdivisions of an icosahedron, whose edge is 1.05 radii or 1.107 radians long, for
  /// the facet size or the largest angle between facets; `usual` if neither is set.
  int ball_level(double radius_m, int usual) const {
    if (!given_.facet_m && !given_.facet_rad) return usual;
    const double halvings = given_.facet_m ? std::log2(1.05 * radius_m / *given_.facet_m)
                                           : std::log2(1.107 / *given_.facet_rad);
    const double least = given_.facet_m ? 1.0 : usual;
    return static_cast<int>(std::clamp(std::ceil(halvings), least, 7.0));
  }
  /// The thickness of rods. Throws if it is not less than a quarter of the body's smallest size.
  double rod_m(double min_m) const {
    const double rod = kind_.size_m(given_, &ShapeSize::rod_m);
    if (!(rod < 0.25 * min_m))
      throw std::invalid_argument(fmt::format(
          "a {} of {:.3g} m cannot have a rod_m of {:.3g}, expected less than a quarter of its "
          "smallest size",
          kind_.name, min_m, rod));
    return rod;
  }
  void rods(std::vector<Vector3d> points, double thick_m) {
    solids_.sweep(points, circle(0.5 * thick_m, 8),
                  std::abs((points[1] - points[0]).normalized().z()) > 0.9 ? Vector3d::UnitX()
                                                                           : Vector3d::UnitZ());
  }
  /// Turns the body's z axis to y.
  void lay_down() {
    for (Eigen::Vector3f& p : solids_.mesh.positions) p = {p.x(), p.z(), -p.y()};
  }

  void cylinder() {
    const double r = 0.5 * diameter_m(), half = 0.5 * length_m();
    solids_.revolve(std::array{Vector2d(r, -half), Vector2d(r, half)}, segments(2.0 * r));
    lay_down();
  }

  void cone() {
    const double top_m = kind_.size_m(given_, &ShapeSize::top_diameter_m);
    solids_.revolve(
        std::array{Vector2d(0.5 * diameter_m(), 0.0), Vector2d(0.5 * top_m, shape_height_m())},
        segments(std::max(diameter_m(), top_m)));
  }

  void wedge() {
    const double l = 0.5 * length_m(), w = 0.5 * width_m(), t = shape_height_m();
    const std::array rings{std::vector<Vector3d>{{-w, -l, 0}, {w, -l, 0}, {w, l, 0}, {-w, l, 0}},
                           std::vector<Vector3d>{{-0.8 * w, -0.85 * l, t},
                                                 {0.8 * w, -0.85 * l, t},
                                                 {0.8 * w, 0.95 * l, 0.25 * t},
                                                 {-0.8 * w, 0.95 * l, 0.25 * t}}};
    solids_.skin(rings);
  }

  void sphere() {
    const double r = 0.5 * diameter_m();
    solids_.ball(Vector3d::Zero(), r, ball_level(r, 3));
  }

  void box() { solids_.block(Vector3d::Zero(), {width_m(), length_m(), shape_height_m()}); }

  void barrel() {
    const double r = 0.5 * diameter_m(), l = length_m(), ridge = 0.03 * r, thick = 0.02 * l;
    std::vector<Vector2d> profile;
    for (const double at : {0.5 * thick, l / 3.0, 2.0 * l / 3.0, l - 0.5 * thick}) {
      if (profile.empty()) {
        profile.emplace_back(r, 0.0);
      } else {
        profile.emplace_back(r - ridge, at - thick);
        profile.emplace_back(r, at - 0.5 * thick);
      }
      profile.emplace_back(r, at + 0.5 * thick);
      if (at < l - thick) profile.emplace_back(r - ridge, at + thick);
    }
    solids_.revolve(profile, segments(2.0 * r));
    lay_down();
  }

  void tyre() {
    constexpr double hole = 0.58;  // diameter of the hole / outer diameter
    const int points =             // of the profile
        given_.facet_rad ? std::max(16, static_cast<int>(std::ceil(2.0 * pi / *given_.facet_rad)))
                         : 16;
    const double outer = 0.5 * diameter_m(), inner = hole * outer;
    const auto squared = [](double x) { return std::copysign(std::sqrt(std::abs(x)), x); };
    std::vector<Vector2d> profile;
    for (int k = 0; k < points; ++k) {
      const double angle = 2.0 * pi * (k + 0.5) / points;
      profile.emplace_back(0.5 * (outer + inner) + 0.5 * (outer - inner) * squared(std::cos(angle)),
                           0.5 * shape_height_m() * squared(std::sin(angle)));
    }
    const double reach = squared(std::cos(pi / points));  // height of the outermost points / half
    for (Vector2d& p : profile) p.y() /= reach;
    solids_.revolve(profile, segments(2.0 * outer), true);
  }

  void anchor() {
    // Thickness / length, and length of the ring beyond the shank / thickness.
    constexpr double thick_share = 0.08, ring_thicks = 2.25;
    const double l = length_m() / (1.0 + ring_thicks * thick_share);  // length without the ring
    const double w = width_m(), t = shape_height_m(), back = -0.5 * l, thick = thick_share * l;
    solids_.block({0.0, 0.0, 0.5 * thick}, {0.7 * thick, l, thick});               // shank
    solids_.block({0.0, back + 0.7 * thick, thick}, {w, 1.4 * thick, 2 * thick});  // crown
    for (const double side : {-1.0, 1.0}) {  // a fluke: wide at the crown, pointed at its tip
      const double x = side * 0.38 * w, half = 0.11 * w;
      const auto plate = [&](double half_m, double y, double z) {
        return std::vector<Vector3d>{{x - half_m, y, z - 0.3 * thick},
                                     {x - half_m, y, z + 0.3 * thick},
                                     {x + half_m, y, z + 0.3 * thick},
                                     {x + half_m, y, z - 0.3 * thick}};
      };
      solids_.skin(std::array{plate(half, back, thick), plate(0.8 * half, back + 0.35 * l, 0.6 * t),
                              plate(0.1 * half, back + 0.6 * l, t - 0.3 * thick)});
    }
    const double eye = 0.5 * l + thick;  // the shackle's ring
    std::vector<Vector3d> ring;
    for (int k = 0; k < 16; ++k)
      ring.emplace_back(thick * std::cos(k * pi / 8), eye + thick * std::sin(k * pi / 8),
                        0.5 * thick);
    solids_.sweep(ring, circle(0.25 * thick, 8), Vector3d::UnitZ(), true);
  }

  void pot() {
    constexpr int arch_points = 12;
    const double l = length_m(), w = width_m(), t = shape_height_m();
    const double rod = rod_m(std::min({l, w, t})), twine = rod / 4.0;
    solids_.block({0.0, 0.0, 0.5 * rod}, {w, l, rod});  // boards
    const auto on_arch = [&](double k, double y) {
      const double angle = pi * k / arch_points;
      return Vector3d(-0.5 * (w - rod) * std::cos(angle), y,
                      0.5 * rod + (t - rod) * std::sin(angle));
    };
    for (int i = 0; i <= 12; ++i) {  // arches: every sixth is a hoop, the others are netting
      std::vector<Vector3d> arch;
      for (int k = 0; k <= arch_points; ++k)
        arch.push_back(on_arch(k, (l - rod) * (i / 12.0 - 0.5)));
      rods(arch, i % 6 == 0 ? rod : twine);
    }
    for (int k = 1; k < arch_points; ++k)
      rods({on_arch(k, -0.5 * l), on_arch(k, 0.5 * l)}, k % 3 == 0 ? 0.7 * rod : twine);
    for (const double end : {-0.5, 0.5})  // the end walls' netting
      for (int k = 1; k < arch_points; ++k) {
        const Vector3d top = on_arch(k, end * (l - rod));
        rods({{top.x(), top.y(), 0.5 * rod}, top}, twine);
      }
  }

  void net() {
    constexpr double two_pi = 2.0 * pi;
    const double l = length_m(), w = width_m(), t = shape_height_m();
    const double rod = rod_m(std::min({l, w, t}));
    std::array<double, 9> phase{};
    for (double& p : phase) p = draws_.between(0.0, two_pi);
    // Folds grow towards the side of the floats, x = 1.
    const auto place = [&](double x, double y) {
      const double lift = 0.12 + 0.48 * x * x;
      const double fold = std::cos(two_pi * 1.5 * y + phase[0]) +
                          0.6 * std::cos(two_pi * (3.0 * y + x) + phase[1]) +
                          0.4 * std::cos(two_pi * (5.0 * y - 2.0 * x) + phase[2]);
      return Vector3d(w * (x - 0.5) + 0.08 * w * std::cos(two_pi * 2.0 * y + phase[3]),
                      l * (y - 0.5) + 0.03 * l * std::cos(two_pi * (x + y) + phase[4]),
                      t * lift * (1.0 + fold / 3.0));
    };
    const double mesh_m = std::max({w / 12.0, l / 200.0, 4.0 * rod});
    const int across = std::max(2, static_cast<int>(w / mesh_m));
    const int along = std::max(2, static_cast<int>(l / mesh_m));
    for (int i = 0; i <= across; ++i) {
      solids_.begin_part(i == 0 || i == across ? 1 : 0);
      std::vector<Vector3d> twine;
      for (int j = 0; j <= along; ++j)
        twine.push_back(place(double(i) / across, double(j) / along));
      rods(twine, i == 0 || i == across ? 2.0 * rod : rod);  // ground rope and head rope
    }
    for (int j = 0; j <= along; ++j) {
      std::vector<Vector3d> twine;
      for (int i = 0; i <= across; ++i)
        twine.push_back(place(double(i) / across, double(j) / along));
      rods(twine, rod);
    }
    solids_.begin_part(2);
    for (int j = 0; j <= along; j += 4) solids_.ball(place(1.0, double(j) / along), 4.0 * rod, 1);
  }

  void boulder() {
    solids_.ball(Vector3d::Zero(), 1.0, ball_level(0.5 * diameter_m(), 2));
    // An ellipsoid with waves on its surface, cut by planes.
    const double height = draws_.between(0.5, 0.8), width = draws_.between(0.65, 0.9);
    const Vector3d axes(width, 1.0, height);
    struct Plane {
      Vector3d normal;
      double distance, wave, phase;
    };
    std::array<Plane, 9> planes;
    for (Plane& p : planes)
      p = {draws_.direction(), draws_.between(0.62, 0.95), draws_.between(2.0, 4.0),
           draws_.between(0.0, 2.0 * pi)};
    double longest = 0.0;
    for (Eigen::Vector3f& at : solids_.mesh.positions) {
      const Vector3d way = at.cast<double>();
      double r = 1.0;
      for (const Plane& p : planes) r += 0.03 * std::cos(p.wave * way.dot(p.normal) + p.phase);
      for (const Plane& p : planes)
        if (const double along = way.dot(p.normal); r * along > p.distance) r = p.distance / along;
      at = (r * way.cwiseProduct(axes)).cast<float>();
      longest = std::max(longest, 2.0 * double(at.norm()));
    }
    for (Eigen::Vector3f& at : solids_.mesh.positions)
      at *= static_cast<float>(diameter_m() / longest);
  }

  void debris() {
    const double l = length_m() * draws_.between(0.3, 1.0);
    const double kind = draws_.between(0.0, 5.0);
    const double bend = draws_.between(0.1, 0.5) * l, turn = draws_.between(0.5, 1.5);
    std::vector<Vector3d> way;  // bent upwards and to the side
    for (int k = 0; k <= 8; ++k) {
      const double s = k / 8.0 - 0.5;
      way.emplace_back(0.5 * bend * s * s, l * s, bend * s * s * turn);
    }
    if (kind < 1.5) {
      solids_.sweep(way, rectangle(draws_.between(0.3, 0.8) * l, 0.02));  // plate
    } else if (kind < 2.5) {
      const double deep = draws_.between(0.06, 0.12) * l;
      solids_.sweep(std::array{way.front(), way.back()}, rectangle(0.6 * deep, deep));  // beam
    } else if (kind < 3.3) {
      const double r = draws_.between(0.02, 0.08) * l;
      solids_.sweep(way, circle(r, 16));  // pipe
    } else if (kind < 4.2) {
      for (Vector3d& p : way) p.z() *= 2.0;
      solids_.sweep(way, rectangle(0.1 * l, 0.04 * l));  // rib
    } else {                                             // a machine: a block with a drum on it
      const Vector3d size(0.5 * l, 0.6 * l, draws_.between(0.2, 0.5) * l);
      solids_.block({0.0, 0.0, 0.5 * size.z()}, size);
      const double r = 0.2 * l;
      solids_.sweep(std::array{Vector3d(0.0, -0.4 * l, size.z()), Vector3d(0.0, 0.4 * l, size.z())},
                    circle(r, 16));
    }
  }

  const ShapeKind& kind_;
  const ShapeSize& given_;
  Draws draws_;
  Solids solids_;
};

/// Scales a member of a family to the given sizes along its axes, and sets sunk_m. `lies`: the
/// member is a drum that lies on one of its flanges.
void fit(const ShapeKind& kind, const ShapeSize& given, double main_m, bool lies, ShapeBody& body) {
  const refine::Bounds box = refine::bounds(body.mesh);
  const Vector3d extent = (box.highest - box.lowest).cast<double>();
  const bool has_length = kind.dimensions.front().size == &ShapeSize::length_m;
  const auto axis_of = [&](std::optional<double> ShapeSize::*size) {
    if (size == &ShapeSize::length_m) return 1;
    if (size == &ShapeSize::shape_height_m) return 2;
    if (size == &ShapeSize::diameter_m && !has_length) return 1;
    return size == &ShapeSize::width_m && lies ? 2 : 0;
  };
  const int main_axis = axis_of(kind.dimensions.front().size);
  Vector3d factors = Vector3d::Constant(main_m > 0.0 ? main_m / extent[main_axis] : 1.0);
  for (const Dimension& dimension : kind.dimensions)
    if (const std::optional<double> size_m = given.*dimension.size) {
      const int axis = axis_of(dimension.size);
      factors[axis] = *size_m / extent[axis];
      // A round shape has its diameter along two axes.
      if (dimension.size == &ShapeSize::diameter_m) factors[lies ? 0 : 2] = factors[axis];
    }
  for (Eigen::Vector3f& p : body.mesh.positions)
    p = p.cast<double>().cwiseProduct(factors).cast<float>();
  body.sunk_m = std::max(0.0, -double(box.lowest.z()) * factors.z());
}

ShapeBody make_member(const ShapeKind& kind, const ShapeSize& size, const RandomStream& random,
                      std::string_view variant) {
  FamilyForm form{.size_m = 0.0,
                  .variant = variant,
                  .facet_rad = size.facet_rad,
                  .draws = Draws(random),
                  .solids = {}};
  const Dimension& main = kind.dimensions.front();
  const double drawn = form.draws.between(0.0, 1.0);
  form.size_m =
      (size.*main.size)
          .value_or(main.max_m > 0.0 ? main.usual_m * std::pow(main.max_m / main.usual_m, drawn)
                                     : main.usual_m);
  // The square makes the variants that are listed first more frequent.
  const double share = std::pow(form.draws.between(0.0, 1.0), 2.0);
  if (variant.empty() && !kind.variants.empty())
    form.variant = kind.variants[std::min(
        static_cast<std::size_t>(share * static_cast<double>(kind.variants.size())),
        kind.variants.size() - 1)];
  kind.family(form);
  std::vector<std::uint8_t> parts = form.solids.face_parts();
  ShapeBody body{.mesh = std::move(form.solids.mesh), .face_part = std::move(parts)};
  fit(kind, size, form.size_m, form.variant == "lying", body);
  return body;
}

}  // namespace

ShapeBody make_body(const ShapeKind& kind, const ShapeSize& size, const RandomStream& random,
                    std::string_view variant) {
  if (!variant.empty() && std::ranges::find(kind.variants, variant) == kind.variants.end())
    throw std::invalid_argument(fmt::format("a {} has no variant '{}', expected one of: {}",
                                            kind.name, variant, fmt::join(kind.variants, ", ")));
  return kind.family ? make_member(kind, size, random, variant)
                     : BodyMaker(kind, size, random).make();
}

}  // namespace ensonify::engine
